"""Connectivity of face arrays: half-edges, grids, stars, polylines, boundary loops.

Faces are integer arrays (m, 3) or (m, 4). In a mixed mesh the rows have four columns
and a triangle ends in -1. Everything is vectorised: Python loops run over the valence of
a vertex or the side of a grid, never over elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gso.errors import MeshError
from gso.typing import Ints

# Rings are padded to one of these lengths, so that few distinct kernels are needed.
RING_SIZES = (3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 64, 128, 256, 512, 1024, 4096)


def grid_faces(height: int, width: int) -> Ints:
    """List the quads of a grid whose vertices are numbered row by row.

    Face (i, j) is (i, j), (i+1, j), (i+1, j+1), (i, j+1). Its first diagonal, between corners
    0 and 2, is the one along which the package splits grid cells into triangles.
    """
    v = np.arange(height * width).reshape(height, width)
    corners = (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:])
    return np.stack([c.ravel() for c in corners], axis=1)


@dataclass(frozen=True)
class HalfEdges:
    """Half-edges of an oriented manifold; arrays over half-edges unless stated otherwise.

    Attributes
    ----------
    origin, dest : vertex at the start and at the end
    face : face on the left
    next, prev : next and previous half-edge of the face
    twin : the opposite half-edge, or -1 on the boundary
    """

    origin: Ints
    dest: Ints
    face: Ints
    next: Ints
    prev: Ints
    twin: Ints
    vertex_count: int

    @cached_property
    def boundary_vertex(self) -> NDArray[np.bool_]:
        """Mask over vertices: boundary vertices."""
        mask = np.zeros(self.vertex_count, bool)
        open_edges = self.twin < 0
        mask[self.origin[open_edges]] = True
        mask[self.dest[open_edges]] = True
        return mask

    @cached_property
    def face_count(self) -> Ints:
        """Number of faces at each vertex."""
        return np.bincount(self.origin, minlength=self.vertex_count)


def _half_edge_table(faces: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Return origin, dest, face and next of every half-edge, grouped by face."""
    m, k = faces.shape
    size = np.full(m, k) if k == 3 else np.where(faces[:, 3] < 0, 3, 4)
    face = np.repeat(np.arange(m), size)
    start = np.concatenate([[0], np.cumsum(size)[:-1]])
    local = np.arange(face.size) - start[face]
    nxt = start[face] + (local + 1) % size[face]
    origin = faces[face, local]
    return origin, origin[nxt], face, nxt


def edge_keys(origin: Ints, dest: Ints, vertex_count: int) -> Ints:
    """Encode undirected edges as integers."""
    return np.minimum(origin, dest) * np.int64(vertex_count) + np.maximum(origin, dest)


def half_edges(faces: Ints, vertex_count: int) -> HalfEdges:
    """Build the half-edge structure of consistently oriented manifold faces."""
    origin, dest, face, nxt = _half_edge_table(faces)
    prev = np.empty_like(nxt)
    prev[nxt] = np.arange(nxt.size)
    key = edge_keys(origin, dest, vertex_count)
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    twin = np.full(origin.size, -1)
    twin[order[:-1][same]] = order[1:][same]
    twin[order[1:][same]] = order[:-1][same]
    return HalfEdges(origin, dest, face, nxt, prev, twin, vertex_count)


def _tree_parity(
    count: int, a: Ints, b: Ints, odd: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], Ints]:
    """Propagate a parity along a spanning forest; edges a-b with `odd` change it.

    Returns the parity and the component label of each node. Pointer jumping takes
    log2(depth) vectorised passes.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    _, once = np.unique(edge_keys(a, b, count), return_index=True)
    a, b, odd = a[once], b[once], odd[once]
    parts, label = connected_components(
        coo_matrix((np.ones(a.size), (a, b)), shape=(count, count)), directed=False
    )
    roots = np.zeros(parts, np.int64)
    roots[label[::-1]] = np.arange(count)[::-1]
    # An extra node, joined to a root of every component, turns the forest into a tree.
    top = np.full(parts, count)
    graph = coo_matrix(
        (np.r_[odd + 1, np.ones(parts, int)], (np.r_[a, top], np.r_[b, roots])),
        shape=(count + 1, count + 1),
    ).tocsr()
    graph = graph + graph.T
    _, parent = breadth_first_order(graph, count, directed=False)
    parent = np.where(parent < 0, count, parent)
    flips = np.asarray(graph[np.arange(count + 1), parent]).ravel() == 2
    while (parent != count).any():
        flips ^= flips[parent]
        parent = parent[parent]
    return flips[:count], label


def orient(faces: Ints, vertex_count: int) -> tuple[Ints, int, int]:
    """Make the faces' orientation consistent.

    Returns
    -------
    faces : ndarray
        The faces, some of them reversed.
    flipped : int
        Number of reversed faces; in each component these are the minority.
    components : int
        Number of edge-connected components.

    Raises
    ------
    MeshError
        An edge has three faces or more, or the surface is not orientable.
    """
    origin, dest, face, _ = _half_edge_table(faces)
    key = edge_keys(origin, dest, vertex_count)
    order = np.argsort(key, kind="stable")
    k = key[order]
    same = k[1:] == k[:-1]
    triple = same[1:] & same[:-1]
    if triple.any():
        at = order[1:-1][triple][0]
        at_faces = face[key == key[at]]
        raise MeshError(
            f"edge {origin[at]}-{dest[at]} belongs to {at_faces.size} faces "
            f"({', '.join(map(str, at_faces[:6]))}): a surface has at most two at an edge; "
            "delete the extra faces"
        )
    h, g = order[:-1][same], order[1:][same]
    odd = origin[h] == origin[g]
    flip, label = _tree_parity(len(faces), face[h], face[g], odd)
    wrong = (flip[face[h]] ^ flip[face[g]]) != odd
    if wrong.any():
        at = h[wrong][0]
        raise MeshError(
            f"the surface is one-sided (a Moebius strip): no orientation fits at edge "
            f"{origin[at]}-{dest[at]}; cut it open first"
        )
    components = int(label.max()) + 1 if len(faces) else 0
    most = np.bincount(label, weights=flip, minlength=components)
    total = np.bincount(label, minlength=components)
    flip ^= (most > total / 2)[label]
    if flip.any():
        faces = faces.copy()
        faces[flip] = reverse(faces[flip])
    return faces, int(flip.sum()), components


def reverse(faces: Ints) -> Ints:
    """Reverse the orientation of faces; the first corner stays first."""
    out = faces.copy()
    if faces.shape[1] == 3:
        out[:, 1:] = faces[:, :0:-1]
        return out
    tri = faces[:, 3] < 0
    out[~tri, 1:] = faces[~tri, :0:-1]
    out[tri, 1], out[tri, 2] = faces[tri, 2], faces[tri, 1]
    return out


def recognise_grid(he: HalfEdges, faces: Ints) -> Ints | None:
    """Find the vertex ids (H, W) of a quad mesh that is a grid; None if it is not.

    The grid has at least 3 x 3 vertices, in any numbering. Corner (0, 0) is the grid corner
    with the smallest id. The first axis follows the half-edge of the face that starts there, so
    a grid that was written row by row is found row by row.
    """
    if faces.shape[1] != 4 or (faces[:, 3] < 0).any():
        return None
    corner = np.flatnonzero(he.face_count == 1)
    if corner.size != 4 or (he.face_count == 0).any():
        return None
    h = int(np.flatnonzero(he.origin == corner.min())[0])
    column = [h]
    while (across := he.twin[he.next[column[-1]]]) >= 0 and len(column) <= len(faces):
        column.append(int(he.next[across]))
    rows = [np.array(column)]
    while True:
        across = he.twin[he.next[he.next[rows[-1]]]]
        if (across < 0).all():
            break
        if (across < 0).any() or len(rows) * len(column) > len(faces):
            return None
        rows.append(across)
    table = np.stack(rows, axis=1)
    if table.size != len(faces) or np.unique(he.face[table]).size != len(faces):
        return None
    height, width = table.shape[0] + 1, table.shape[1] + 1
    if min(height, width) < 3:
        return None
    ids = np.empty((height, width), np.int64)
    ids[:-1, :-1] = he.origin[table]
    ids[-1, :-1] = he.dest[table[-1]]
    ids[:-1, -1] = he.origin[he.prev[table[:, -1]]]
    ids[-1, -1] = he.dest[he.next[table[-1, -1]]]
    if np.unique(ids).size != he.vertex_count:
        return None
    return ids


def check_vertices(he: HalfEdges) -> None:
    """Refuse non-manifold vertices, where fans of faces meet that share no edge there.

    Raises
    ------
    MeshError
        There is such a vertex; the message names the first one.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = he.origin.size
    turn = he.twin[he.prev]
    inner = np.flatnonzero(turn >= 0)
    links = coo_matrix((np.ones(inner.size), (inner, turn[inner])), shape=(count, count))
    fans, label = connected_components(links, directed=False)
    if fans == np.count_nonzero(he.face_count):
        return
    _, one = np.unique(label, return_index=True)
    per_vertex = np.bincount(he.origin[one], minlength=he.vertex_count)
    bad = np.flatnonzero(per_vertex > 1)
    raise MeshError(
        f"vertex {bad[0]} joins {per_vertex[bad[0]]} parts of the surface that share no edge there "
        f"({bad.size} such vertices): give each part its own copy of the vertex"
    )


def are_quads(faces: Ints) -> NDArray[np.bool_]:
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
    return np.c_[faces[:, :3], np.where(last < 0, first, last) if last.size else first]


def triangulate(faces: Ints, turned: NDArray[np.bool_]) -> Ints:
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


def quad_splits(faces: Ints, he: HalfEdges) -> NDArray[np.bool_]:
    """Choose consistent diagonals: mask of the quads split along 1-3 instead of 0-2.

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
    inner = np.flatnonzero((he.twin > np.arange(he.twin.size)) & quad[he.face])
    inner = inner[quad[he.face[he.twin[inner]]]]
    local = _place_in_face(he, quad)
    # For each of the two faces: is the origin of this half-edge on its diagonal 0-2?
    here = local[inner] % 2 == 0
    there = local[he.twin[inner]] % 2 == 1
    # Consistent: the diagonals of two neighbours do not meet at an end of the shared edge.
    turn, _ = _tree_parity(len(faces), he.face[inner], he.face[he.twin[inner]], here == there)
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


def _place_in_face(he: HalfEdges, quad: NDArray[np.bool_]) -> Ints:
    """Return the index within its face, 0 to 3, of the corner where each half-edge starts."""
    first = np.concatenate([[0], np.cumsum(np.where(quad, 4, 3))[:-1]])
    return np.arange(he.face.size) - first[he.face]


def _clashing_splits(quads: Ints, turn: NDArray[np.bool_], he: HalfEdges) -> NDArray[np.bool_]:
    """Mark the quads whose diagonal is also an edge or the diagonal of another quad."""
    ends = np.where(turn[:, None], quads[:, [1, 3]], quads[:, [0, 2]])
    split = edge_keys(ends[:, 0], ends[:, 1], he.vertex_count)
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


#: Interior vertices (n,) and their rings (n, k), one entry per length of rings.
Stars = list[tuple[Ints, Ints]]


def grid_stars(ids: Ints, ring: Sequence[tuple[int, int]]) -> Stars:
    """List the stars of a grid's interior vertices (H, W), with rings as index offsets (i, j)."""
    h, w = ids.shape
    if min(h, w) < 3:
        return []
    around = [ids[1 + i : h - 1 + i, 1 + j : w - 1 + j].ravel() for i, j in ring]
    return [(ids[1:-1, 1:-1].ravel(), np.stack(around, axis=1))]


def vertex_stars(faces: Ints, he: HalfEdges, turned: NDArray[np.bool_]) -> tuple[Stars, Stars]:
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
    interior = np.flatnonzero(~he.boundary_vertex & (he.face_count > 0))
    quad = are_quads(faces)
    through = (_place_in_face(he, quad) % 2 == 0) != turned[he.face]
    start = np.zeros(he.vertex_count, np.int64)
    start[he.origin] = np.arange(he.origin.size)
    found: tuple[list, list] = ([], [])
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
        four = quad[he.face[spokes]]
        count = four.sum(axis=1, keepdims=True)
        odd = count % 2 == 1
        even_turn = np.cumsum(four, axis=1) % 2 == 1
        agrees = ((through[spokes] == even_turn) & four).sum(axis=1, keepdims=True)
        own = even_turn == (2 * agrees >= count)
        for stars, split in zip(found, (own, ~own), strict=True):
            stars += _rings(he, centre, spokes, four & (split | odd))
    return _merged(found[0]), _merged(found[1])


def _rings(he: HalfEdges, centre: Ints, spokes: Ints, through: NDArray[np.bool_]) -> Stars:
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


def polyline_triples(he: HalfEdges, faces: Ints) -> Ints:
    """List consecutive triples (a, b, c) along the polylines of a quad mesh, (t, 3).

    Lines run straight through regular vertices (four faces inside, two on the boundary)
    and end at irregular ones.
    """
    return polyline_crosses(he, faces)[:, :3]


def polyline_crosses(he: HalfEdges, faces: Ints) -> Ints:
    """List :func:`polyline_triples` with the crossing line, (a, b, c, p, q), (t, 5).

    p and q are the neighbours of b on both sides of the polyline; on the boundary q is b.
    """
    if faces.shape[1] == 3:
        return np.empty((0, 5), np.int64)
    quad = (faces[:, 3] >= 0)[he.face]
    edge = he.boundary_vertex
    regular = np.where(edge, he.face_count == 2, he.face_count == 4)
    side = he.twin[he.next]
    ok = quad & (side >= 0) & regular[he.dest]
    ok &= np.where(side >= 0, quad[side], False)
    ahead = he.next[side[ok]]
    left, right = he.dest[he.next[ok]], he.origin[he.prev[he.twin[ok]]]
    right = np.where(he.twin[ok] >= 0, right, he.dest[ok])
    crosses = np.stack([he.origin[ok], he.dest[ok], he.dest[ahead], left, right], axis=1)
    swap = crosses[:, 0] > crosses[:, 2]
    crosses[swap] = crosses[swap][:, [2, 1, 0, 3, 4]]
    _, once = np.unique(crosses[:, :3], axis=0, return_index=True)
    return crosses[once]


def hinges(he: HalfEdges) -> Ints:
    """List the four vertices (a, b, left, right) around every interior edge of a triangulation."""
    h = np.flatnonzero(he.twin > np.arange(he.twin.size))
    return np.stack(
        [he.origin[h], he.dest[h], he.dest[he.next[h]], he.dest[he.next[he.twin[h]]]], axis=1
    )


def edges(he: HalfEdges) -> Ints:
    """List each undirected edge once, (e, 2)."""
    once = _once(he)
    return np.stack([he.origin[once], he.dest[once]], axis=1)


def rim(he: HalfEdges) -> NDArray[np.bool_]:
    """Mark the boundary edges among :func:`edges`, (e,)."""
    return he.twin[_once(he)] < 0


def _once(he: HalfEdges) -> NDArray[np.bool_]:
    return (he.twin < 0) | (he.twin > np.arange(he.twin.size))


def boundary_loops(he: HalfEdges) -> list[Ints]:
    """List the vertex ids of the boundary loops, anticlockwise round the surface, longest first."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components, depth_first_order

    rim = np.flatnonzero(he.twin < 0)
    if rim.size == 0:
        return []
    # The next boundary edge is found by walking around the end vertex from face to face, so
    # that a vertex where two fans meet is passed once per fan.
    ahead = he.next[rim]
    while (he.twin[ahead] >= 0).any():
        ahead = np.where(he.twin[ahead] >= 0, he.next[he.twin[ahead]], ahead)
    n, after = rim.size, np.searchsorted(rim, ahead)
    links = coo_matrix((np.ones(n), (np.arange(n), after)), shape=(n, n))
    _, label = connected_components(links, directed=False)
    order = np.lexsort((he.origin[rim], label))
    starts = order[np.unique(label[order], return_index=True)[1]]
    # An extra node, joined to a start of every loop, makes one depth-first walk visit all.
    links = coo_matrix(
        (
            np.ones(n + starts.size),
            (np.r_[np.arange(n), np.full(starts.size, n)], np.r_[after, starts]),
        ),
        shape=(n + 1, n + 1),
    )
    walk = depth_first_order(links.tocsr(), n)[0][1:]
    cuts = np.flatnonzero(np.diff(label[walk])) + 1
    loops = np.split(he.origin[rim[walk]], cuts)
    return sorted(loops, key=len, reverse=True)
