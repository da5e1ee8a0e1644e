"""Meshes to measure and test on, all by formulas of this folder; nothing here was tuned on.

Every function returns a list of :class:`Design`, the same ones every time. The seed moves the
coefficients of the surfaces, so that settings can be chosen on some seeds and shown on others.
Lengths have no unit; the designs are between 2 and 30 across.
"""

from __future__ import annotations

from designs.base import Design, Symmetry
from designs.curved import curved
from designs.holes import holes
from designs.irregular import irregular
from designs.planar import planar
from designs.symmetric import symmetric

#: The functions by the name of their kind.
KINDS = {make.__name__: make for make in (holes, irregular, planar, symmetric, curved)}

__all__ = ["KINDS", "Design", "Symmetry", *KINDS]
