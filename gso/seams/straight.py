"""Straight seams of pieces that were found, where the pieces stay what they are."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.mesh.topology import pair_keys
from gso.seams.candidates import Candidate
from gso.seams.cutting import cut
from gso.seams.kinds import Edges
from gso.seams.options import NARROWEST, PieceSettings
from gso.seams.sheets import Sheet, flattened
from gso.seams.straightening import straight_seams
from gso.seams.tree import Ground
from gso.typing import Flags, Ints

#: How often seams are straightened, each time without those of pieces that did not hold.
_ROUNDS = 4


def straight(ground: Ground, found: Candidate, settings: PieceSettings) -> Candidate:
    """Straighten the seams of a triangle mesh where patterns, strain and necks allow it.

    The seams of pieces that do not hold what is allowed then stay as they are.
    """
    settings.say("straight seams")
    most = max(found.strain, settings.max_strain)
    known: dict[bytes, Sheet | None] = {}
    stay = np.empty((0, 2), np.int64)
    for _ in range(_ROUNDS):
        own = straightened_pieces(ground, found.pieces, stay)
        if own is None:
            break
        of = _earlier(own, found.pieces)
        bad = []
        for piece, k in zip(own, of.tolist(), strict=True):
            name = piece.mesh.vertices.tobytes() + piece.mesh.faces.tobytes()
            if name not in known:
                known[name] = flattened(piece.mesh)
            sheet, before = known[name], found.sheets[k]
            holds = sheet is not None and sheet.sound and sheet.strain <= most
            if not holds or (before is not None and _narrow(sheet) and not _narrow(before)):
                bad.append(k)
        if not bad:
            names = [p.mesh.vertices.tobytes() + p.mesh.faces.tobytes() for p in own]
            return Candidate(own, tuple(known[name] for name in names))
        cut_edges, sides = found.pieces.edges, found.pieces.sides
        stay = np.concatenate([stay, cut_edges[np.isin(sides, bad).any(axis=1)]])
        if _held(cut_edges, stay, len(own.design.vertices)).all():
            break
    return found


def _held(edges: Ints, stay: Ints, count: int) -> Flags:
    """Mark the edges (e,) that are among others."""
    return np.isin(pair_keys(edges, count), pair_keys(stay, count))


def _narrow(sheet: Sheet | None) -> bool:
    """Tell whether a piece has a narrow neck."""
    if sheet is None:
        return True
    least = NARROWEST * float(np.sqrt(metrics.area(sheet.mesh)))
    return sheet.neck(1.01 * least) < least


def _earlier(pieces: Pieces, before: Pieces) -> Ints:
    """Return the piece (k,) that each piece was before seams were straightened."""
    vertex = before.opened.vertex
    inside = np.bincount(vertex, minlength=len(before.design.vertices)) == 1
    own = np.full(len(pieces.design.vertices), -1)
    own[vertex] = np.where(inside[vertex], before.of_vertex, -1)
    table = np.zeros((len(pieces), len(before)), np.int64)
    for k, piece in enumerate(pieces):
        of = own[piece.vertices]
        table[k] = np.bincount(of[of >= 0], minlength=len(before))
    return np.asarray(table.argmax(axis=1))


def straightened_pieces(ground: Ground, pieces: Pieces, stay: Ints | None = None) -> Pieces | None:
    """Return pieces with straight seams; None where nothing can be straightened.

    Seams with an edge of `stay` (k, 2) are left.
    """
    if not ground.mesh.is_triangles or not len(pieces.edges) or ground.mirror is not None:
        return None
    firm = _firm(ground) if stay is None else np.concatenate([_firm(ground), stay])
    try:
        mesh, edges = straight_seams(pieces, firm)
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
