"""A surface cut into pieces along seams, and the search for the seams.

:func:`gso.cut` cuts a mesh along seams (:mod:`gso.seams.kinds`) and returns
:class:`~gso.cut_pieces.Pieces`: separate meshes, which edges were joined, and the way back.
:func:`gso.pieces` finds seams along which a design can be cut into pieces that can be laid flat.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.cut_pieces import Piece, Pieces
from gso.first_use import at_first_use
from gso.geometry.polygon import rectangle
from gso.seams.cutting import cut
from gso.seams.kinds import Creases, Edges, Groups, Labels, Path, Seam, Slice
from gso.seams.polyline_seam import Polyline

if TYPE_CHECKING:
    from gso.seams.coarse_copy import CoarseCopy
    from gso.seams.disks import opening
    from gso.seams.gores import Gores
    from gso.seams.inverted_faces import inverted_at_seams
    from gso.seams.regions import Regions
    from gso.seams.remaining_time import RemainingTime
    from gso.seams.revolution import Revolution
    from gso.seams.search import pieces
    from gso.seams.segmentation import Segmentation
    from gso.seams.sheets import Sheet

__all__ = [
    "CoarseCopy",
    "Creases",
    "Edges",
    "Gores",
    "Groups",
    "Labels",
    "Path",
    "Piece",
    "Pieces",
    "Polyline",
    "Regions",
    "RemainingTime",
    "Revolution",
    "Seam",
    "Segmentation",
    "Sheet",
    "Slice",
    "cut",
    "inverted_at_seams",
    "opening",
    "pieces",
    "rectangle",
]

# These import SciPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "coarse_copy": "CoarseCopy",
        "disks": "opening",
        "gores": "Gores",
        "regions": "Regions",
        "remaining_time": "RemainingTime",
        "revolution": "Revolution",
        "search": "pieces",
        "inverted_faces": "inverted_at_seams",
        "segmentation": "Segmentation",
        "sheets": "Sheet",
    },
)
