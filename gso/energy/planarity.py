"""Planarity of quads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.typing import Ints, S, Vec

#: Rigid motions do not change planarity.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the distance between the diagonals' lines. Constants: a shift, 0 for a soft term."""
    return (geometry.diagonal_distance(*points) + constants[0],)


def build(quads: Ints, *, weight: float = 1.0) -> Term:
    """Build the planarity of quads (k, 4), each with the same weight."""
    return Term(
        "planarity",
        residual,
        (("surface", quads),),
        weights=np.full(len(quads), weight),
        constants=np.zeros((1, len(quads))),
    )
