"""What strips are made of: a design, or pieces that were given."""

from __future__ import annotations

from gso.cut_pieces import Pieces
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.seams import Edges, Segmentation, cut
from gso.typing import MeshLike


def design_of(given: MeshLike | Pieces) -> Mesh:
    """Return the design from which distances count."""
    if isinstance(given, Segmentation) and given.given is not None:
        return given.given
    return given.design if isinstance(given, Pieces) else as_mesh(given)


def without_darts(found: Segmentation) -> Pieces:
    """Return pieces of the design as it was given, without darts where that leaves disks."""
    design, sides = found.unchanged, found.sides
    pieces = cut(design, Edges(found.edges[sides[:, 0] != sides[:, 1]]))
    # A seam within a piece may open a ring or a handle.
    whole = len(pieces) == 1 or all(piece.is_disk for piece in pieces)
    return pieces if whole else cut(design, Edges(found.edges))
