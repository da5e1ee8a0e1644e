"""Interior vertices and their rings of neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.errors import MeshError
from gso.mesh.topology.half_edges import HalfEdges
from gso.mesh.topology.triangulation import _place_in_face, are_quads
from gso.typing import Flags, Ints

#: Rings are padded to one of these lengths, so that few distinct kernels are needed.
RING_SIZES = (3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 64, 128, 256, 512, 1024, 4096)


#: Interior vertices (n,) and their rings (n, k), one entry per length of rings.
Stars = list[tuple[Ints, Ints]]


def grid_stars(ids: Ints, ring: Sequence[tuple[int, int]]) -> Stars:
    """List the stars of a grid's interior vertices (H, W), with rings as index offsets (i, j)."""
    h, w = ids.shape
    if min(h, w) < 3:
        return []
    around = [ids[1 + i : h - 1 + i, 1 + j : w - 1 + j].ravel() for i, j in ring]
    return [(ids[1:-1, 1:-1].ravel(), np.stack(around, axis=1))]


def vertex_stars(faces: Ints, he: HalfEdges, turned: Flags) -> tuple[Stars, Stars]:
    """Build closed stars of the interior vertices in two triangulations of the quads around them.

    Around a vertex the quads are split alternately: along the diagonal through the vertex, and
    along the other one. The second star swaps the two. Together they use both diagonals of
    every quad and do not depend on the numbering of the mesh. The first star is the one that
    agrees with more of the splits in `turned`. An odd number of quads cannot alternate: then
    both stars split all quads through the vertex. Triangles are kept.

    Returns
    -------
    (first, second) : lists of (centres (n,), rings (n, k))
        One entry per ring length in use. Rings run anticlockwise; shorter ones repeat
        their last vertex, which adds neither angle nor area.

    Raises
    ------
    MeshError
        A vertex is non-manifold (two fans of faces meet there), or has too many faces.
    """
    quad = are_quads(faces)
    through = (_place_in_face(he, quad) % 2 == 0) != turned[he.face]
    found: tuple[Stars, Stars] = ([], [])
    for centre, spokes in _spokes(he):
        four = quad[he.face[spokes]]
        count = four.sum(axis=1, keepdims=True)
        odd = count % 2 == 1
        even_turn = np.cumsum(four, axis=1) % 2 == 1
        agrees = ((through[spokes] == even_turn) & four).sum(axis=1, keepdims=True)
        own = even_turn == (2 * agrees >= count)
        for stars, split in zip(found, (own, ~own), strict=True):
            stars += _rings(he, centre, spokes, four & (split | odd))
    return _merged(found[0]), _merged(found[1])


def face_stars(he: HalfEdges) -> Stars:
    """List the interior vertices with the corners of the faces around them.

    Returns
    -------
    list of (centres (n,), corners (n, 2 k))
        One entry per number k of faces around a vertex, anticlockwise: of each face the next
        corner and the one opposite to the centre, which of a triangle is the last one.
    """
    found = []
    for centre, spokes in _spokes(he):
        after = he.next[spokes]
        found.append(
            (centre, np.stack([he.dest[spokes], he.dest[after]], 2).reshape(len(centre), -1))
        )
    return found


def boundary_fans(he: HalfEdges, loops: Sequence[Ints]) -> Ints:
    """List the vertices of boundary loops with their open fans of neighbours, (r, 1 + k).

    One row per vertex of each loop, in their order: the vertex, then its neighbours from the next
    vertex of the loop to the one before, anticlockwise. Shorter fans repeat their last vertex,
    which adds no angle; k is one of :data:`RING_SIZES`. A vertex where two fans meet has a row for
    each.

    Parameters
    ----------
    he : HalfEdges
        Those of a triangulation.
    loops : sequence of ndarray of int
        Its boundary loops, anticlockwise round the surface.
    """
    if not loops:
        return np.empty((0, 1 + RING_SIZES[0]), np.int64)
    centre = np.concatenate(loops)
    following = np.concatenate([np.roll(loop, -1) for loop in loops])
    rim = np.flatnonzero(he.twin < 0)
    key = he.origin[rim] * np.int64(he.vertex_count) + he.dest[rim]
    order = np.argsort(key)
    h = rim[order[np.searchsorted(key[order], centre * np.int64(he.vertex_count) + following)]]
    columns = [centre, following]
    while True:
        back = he.prev[h]
        columns.append(he.origin[back])
        across = he.twin[back]
        if (across < 0).all():
            break
        h = np.where(across < 0, h, across)
    length = next((k for k in RING_SIZES if k >= len(columns) - 1), len(columns) - 1)
    columns += (length + 1 - len(columns)) * columns[-1:]
    return np.stack(columns, axis=1)


def _spokes(he: HalfEdges) -> Stars:
    """List the interior vertices and the half-edges from them, anticlockwise, by their number.

    Raises
    ------
    MeshError
        Two fans of faces meet at a vertex.
    """
    interior = np.flatnonzero(~he.boundary_vertex & (he.face_count > 0))
    start = np.zeros(he.vertex_count, np.int64)
    start[he.origin] = np.arange(he.origin.size)
    found = []
    for valence in np.unique(he.face_count[interior]):
        centre = interior[he.face_count[interior] == valence]
        spokes = np.empty((centre.size, valence), np.int64)
        h = start[centre]
        for k in range(int(valence)):
            spokes[:, k] = h
            h = he.twin[he.prev[h]]
        if (h != spokes[:, 0]).any():
            raise MeshError(
                f"vertex {centre[h != spokes[:, 0]][0]} joins two parts of the surface that "
                "touch nowhere else: give each part its own copy of the vertex"
            )
        found.append((centre, spokes))
    return found


def _rings(he: HalfEdges, centre: Ints, spokes: Ints, through: Flags) -> Stars:
    """Build the stars of vertices with equal face counts, padded to :data:`RING_SIZES`.

    A quad that is split through the centre adds its opposite corner to the ring.
    """
    both = np.stack([he.dest[spokes], he.dest[he.next[spokes]]], axis=2)
    wanted = np.stack([np.ones_like(through), through], axis=2)
    both, wanted = both.reshape(len(centre), -1), wanted.reshape(len(centre), -1)
    size = wanted.sum(axis=1)
    if size.max(initial=0) > RING_SIZES[-1]:
        at = centre[size.argmax()]
        raise MeshError(
            f"vertex {at} has {size.max()} triangles, more than {RING_SIZES[-1]}; "
            "remesh the surface there"
        )
    both = np.take_along_axis(both, np.argsort(~wanted, axis=1, kind="stable"), axis=1)
    lengths = np.asarray(RING_SIZES)[np.searchsorted(RING_SIZES, size)]
    stars = []
    for length in np.unique(lengths):
        pick = lengths == length
        column = np.minimum(np.arange(length), size[pick][:, None] - 1)
        stars.append((centre[pick], np.take_along_axis(both[pick], column, axis=1)))
    return stars


def _merged(stars: Stars) -> Stars:
    """Merge stars into one entry per ring length, sorted by vertex."""
    out = []
    for length in sorted({ring.shape[1] for _, ring in stars}):
        some = [(c, r) for c, r in stars if r.shape[1] == length]
        centre = np.concatenate([c for c, _ in some])
        order = np.argsort(centre, kind="stable")
        out.append((centre[order], np.concatenate([r for _, r in some])[order]))
    return out
