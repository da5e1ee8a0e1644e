"""Strips along the lines of quad meshes: the design itself, or grids that are copies of it.

A family of lines (:mod:`~gso.ruled.lines.line_families`) gives the creases: which of its lines, the
sagittas decide (:mod:`~gso.ruled.lines.line_choice`). Faces between two creases become planar
polygons (:mod:`~gso.ruled.lines.strip_cells`), with the mesh's own rulings or with conjugate ones
(:mod:`~gso.ruled.lines.free_rulings`). The package's solver moves their corners
(:mod:`~gso.ruled.lines.line_fit`), and :mod:`~gso.ruled.lines.line_surface` unrolls them. Lines may
end at irregular vertices, close around, and surround holes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.ruled.lines.grid_copies import grid_copies
    from gso.ruled.lines.line_families import Family, families
    from gso.ruled.lines.line_fit import planarised
    from gso.ruled.lines.line_search import EXACT, LineStrips
    from gso.ruled.lines.line_surface import line_surface
    from gso.ruled.lines.strip_cells import Cells

__all__ = [
    "EXACT",
    "Cells",
    "Family",
    "LineStrips",
    "families",
    "grid_copies",
    "line_surface",
    "planarised",
]

# These import SciPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "grid_copies": "grid_copies",
        "line_families": "Family families",
        "line_fit": "planarised",
        "line_search": "EXACT LineStrips",
        "line_surface": "line_surface",
        "strip_cells": "Cells",
    },
)
