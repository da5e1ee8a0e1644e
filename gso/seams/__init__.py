"""A surface cut into pieces along seams.

:func:`gso.cut` cuts a mesh along seams (:mod:`gso.seams.kinds`) and returns
:class:`~gso.seams.pieces.Pieces`: separate meshes, which edges were joined, and the way back.
"""

from gso.seams.cutting import cut
from gso.seams.kinds import Creases, Edges, Labels, Path, Seam, Slice
from gso.seams.pieces import Piece, Pieces
from gso.seams.polyline import Polyline

__all__ = [
    "Creases",
    "Edges",
    "Labels",
    "Path",
    "Piece",
    "Pieces",
    "Polyline",
    "Seam",
    "Slice",
    "cut",
]
