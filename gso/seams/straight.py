"""Straight seams of pieces that were found, where the pieces stay what they are."""

from __future__ import annotations

import numpy as np

from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.seams.candidates import Candidate
from gso.seams.cutting import cut
from gso.seams.kinds import Edges
from gso.seams.options import PieceSettings
from gso.seams.sheets import flattened
from gso.seams.straightening import straight_seams
from gso.seams.tree import Ground
from gso.typing import Ints


def straight(ground: Ground, found: Candidate, settings: PieceSettings) -> Candidate:
    """Straighten the seams of a triangle mesh, if patterns and strain allow it."""
    settings.say("straight seams")
    own = straightened_pieces(ground, found.pieces)
    if own is None:
        return found
    sheets = tuple(flattened(piece.mesh) for piece in own)
    new = Candidate(own, sheets)
    good = new.sound and new.strain <= max(found.strain, settings.max_strain)
    return new if good else found


def straightened_pieces(ground: Ground, pieces: Pieces) -> Pieces | None:
    """Return pieces with straight seams; None where nothing can be straightened."""
    if not ground.mesh.is_triangles or not len(pieces.edges) or ground.mirror is not None:
        return None
    try:
        mesh, edges = straight_seams(pieces, _firm(ground))
        own = cut(mesh, Edges(edges))
    except MeshError:
        # Two lines met in a way that was not foreseen: the zigzags are right, only longer.
        return None
    return own if len(own) == len(pieces) and all(piece.is_disk for piece in own) else None


def _firm(ground: Ground) -> Ints:
    """Return the edges (k, 2) that are not straightened: those that are kept, or to follow."""
    if ground.factor is None:
        return ground.kept
    return np.concatenate([ground.kept, ground.mesh.edges[ground.factor < 1.0]])
