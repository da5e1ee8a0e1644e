"""A surface cut into pieces along seams, and the search for the seams.

:func:`gso.cut` cuts a mesh along seams (:mod:`gso.seams.kinds`) and returns
:class:`~gso.cut_pieces.Pieces`: separate meshes, which edges were joined, and the way back.
:func:`gso.pieces` finds seams along which a design can be cut into pieces that can be laid flat.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from gso.cut_pieces import Piece, Pieces
from gso.seams.cutting import cut
from gso.seams.kinds import Creases, Edges, Labels, Path, Seam, Slice
from gso.seams.polyline_seam import Polyline

if TYPE_CHECKING:
    from gso.seams.search import pieces
    from gso.seams.segmentation import Segmentation
    from gso.seams.sheets import Sheet

__all__ = [
    "Creases",
    "Edges",
    "Labels",
    "Path",
    "Piece",
    "Pieces",
    "Polyline",
    "Seam",
    "Segmentation",
    "Sheet",
    "Slice",
    "cut",
    "pieces",
]

#: Names that are imported at first use, as they import SciPy, and their modules.
_SEARCH = {"pieces": "search", "Segmentation": "segmentation", "Sheet": "sheets"}


def __getattr__(name: str) -> object:
    if name not in _SEARCH:
        raise AttributeError(f"module 'gso.seams' has no attribute {name!r}")
    value = getattr(import_module(f"gso.seams.{_SEARCH[name]}"), name)
    globals()[name] = value
    return value
