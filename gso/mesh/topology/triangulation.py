"""Triangulations of quads."""

from __future__ import annotations

import numpy as np

from gso.errors import MeshError
from gso.mesh.topology.half_edges import HalfEdges, edge_keys, pair_keys, tree_parity
from gso.typing import Flags, Ints


def are_quads(faces: Ints) -> Flags:
    """Mark the faces (m, 3) or (m, 4) that have four corners, (m,)."""
    return faces[:, 3] >= 0 if faces.shape[1] == 4 else np.zeros(len(faces), bool)


def by_size(faces: Ints) -> tuple[Ints, Ints]:
    """Split faces into quads (q, 4) and triangles (t, 3)."""
    if faces.shape[1] == 3:
        return np.empty((0, 4), np.int64), faces
    quad = are_quads(faces)
    return faces[quad], faces[~quad, :3]


def four_corners(faces: Ints) -> Ints:
    """Pad faces to four corners (m, 4): a triangle repeats its first corner at the end."""
    first, last = faces[:, :1], faces[:, 3:]
    return np.asarray(np.c_[faces[:, :3], np.where(last < 0, first, last) if last.size else first])


def triangulate(faces: Ints, turned: Flags) -> Ints:
    """Triangulate faces (t, 3); quads where `turned` is set are split along the diagonal 1-3."""
    if faces.shape[1] == 3:
        return faces
    quad = faces[:, 3] >= 0
    corners = np.where(turned[:, None], np.roll(faces, -1, axis=1), faces)
    tris = np.stack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]], axis=1)
    tris[~quad, 0] = faces[~quad, :3]
    keep = np.ones((len(faces), 2), bool)
    keep[~quad, 1] = False
    return tris[keep]


def quad_splits(faces: Ints, he: HalfEdges, reflex: Ints | None = None) -> Flags:
    """Choose consistent diagonals: mask of the quads split along 1-3 instead of 0-2.

    A quad that is not convex is split through its reflex corner (m,), -1 for the convex ones.

    The choice is propagated from the first face over its neighbours. Nearly every regular
    vertex then has six triangles, the only valence at which the angle defect converges
    (Borrelli et al. 2003). Around vertices of odd valence it cannot be consistent.

    Returns
    -------
    ndarray of bool, (m,)
        False for triangles.

    Raises
    ------
    MeshError
        Both diagonals of a quad are already edges of the mesh or diagonals of other quads.
    """
    if faces.shape[1] == 3:
        return np.zeros(len(faces), bool)
    quad = faces[:, 3] >= 0
    inner = he.interior[quad[he.face[he.interior]]]
    inner = inner[quad[he.face[he.twin[inner]]]]
    local = _place_in_face(he, quad)
    # For each of the two faces: is the origin of this half-edge on its diagonal 0-2?
    here = local[inner] % 2 == 0
    there = local[he.twin[inner]] % 2 == 1
    # Consistent: the diagonals of two neighbours do not meet at an end of the shared edge.
    turn, _ = tree_parity(len(faces), he.face[inner], he.face[he.twin[inner]], here == there)
    if reflex is not None:
        turn = np.where(reflex < 0, turn, reflex % 2 == 1)
    # Two quads with the same diagonal, or a diagonal that is also an edge, would give a
    # non-manifold triangulation: such quads are split the other way.
    clash = _clashing_splits(faces[quad], turn[quad], he)
    if clash.any():
        turn[quad] ^= clash
        clash = _clashing_splits(faces[quad], turn[quad], he)
        if clash.any():
            at = np.flatnonzero(quad)[clash.argmax()]
            raise MeshError(
                f"face {at} = {faces[at].tolist()} cannot be split into triangles: its diagonals "
                "are edges of other faces; subdivide the mesh there"
            )
    return turn & quad


def _place_in_face(he: HalfEdges, quad: Flags) -> Ints:
    """Return the index within its face, 0 to 3, of the corner where each half-edge starts."""
    first = np.concatenate([[0], np.cumsum(np.where(quad, 4, 3))[:-1]])
    return np.asarray(np.arange(he.face.size) - first[he.face])


def _clashing_splits(quads: Ints, turn: Flags, he: HalfEdges) -> Flags:
    """Mark the quads whose diagonal is also an edge or the diagonal of another quad."""
    ends = np.where(turn[:, None], quads[:, [1, 3]], quads[:, [0, 2]])
    split = pair_keys(ends, he.vertex_count)
    _, which, often = np.unique(split, return_inverse=True, return_counts=True)
    return (often[which] > 1) | np.isin(split, edge_keys(he.origin, he.dest, he.vertex_count))


def corner_triangles(faces: Ints) -> Ints:
    """List the corner triangles of faces: four per quad, one per triangle.

    Those of a quad are (corner, next, previous), so a positive area means a corner that is not
    inverted. First all corners 0 of the quads, then all corners 1 ..., then the triangles.
    """
    if faces.shape[1] == 3:
        return faces
    q, triangles = by_size(faces)
    corners = [q[:, [k, (k + 1) % 4, (k + 3) % 4]] for k in range(4)]
    return np.concatenate([*corners, triangles])
