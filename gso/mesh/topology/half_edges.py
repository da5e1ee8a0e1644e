"""Half-edges, edges, and consistent orientation of faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.errors import NonManifoldError
from gso.mesh.topology.graph import edge_graph, label_components
from gso.short_repr import short_repr
from gso.typing import Flags, Ints


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

    __repr__ = short_repr

    @cached_property
    def boundary_vertex(self) -> Flags:
        """Mask over vertices: boundary vertices."""
        mask = np.zeros(self.vertex_count, bool)
        open_edges = self.twin < 0
        mask[self.origin[open_edges]] = True
        mask[self.dest[open_edges]] = True
        return mask

    @cached_property
    def interior(self) -> Ints:
        """One half-edge of each interior edge, ascending."""
        return np.flatnonzero(self.twin > np.arange(self.twin.size))

    def on(self, edges: Ints) -> Flags:
        """Mark the half-edges (h,) that lie on some edges (e, 2), in either direction."""
        own = edge_keys(self.origin, self.dest, self.vertex_count)
        return np.isin(own, pair_keys(edges, self.vertex_count))

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
    return np.asarray(np.minimum(origin, dest) * np.int64(vertex_count) + np.maximum(origin, dest))


def pair_keys(edges: Ints, vertex_count: int) -> Ints:
    """Encode undirected edges (e, 2) as integers, as :func:`edge_keys` does."""
    return edge_keys(edges[:, 0], edges[:, 1], vertex_count)


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


def tree_parity(count: int, a: Ints, b: Ints, odd: Flags) -> tuple[Flags, Ints]:
    """Propagate a parity along a spanning forest; edges a-b with `odd` change it.

    Returns the parity and the component label of each node. Pointer jumping takes
    log2(depth) vectorised passes.
    """
    from scipy.sparse.csgraph import breadth_first_order

    _, once = np.unique(edge_keys(a, b, count), return_index=True)
    a, b, odd = a[once], b[once], odd[once]
    label = label_components(count, a, b)
    parts = int(label.max(initial=-1)) + 1
    roots = np.zeros(parts, np.int64)
    roots[label[::-1]] = np.arange(count)[::-1]
    # An extra node, joined to a root of every component, turns the forest into a tree.
    tail, weight = np.r_[a, np.full(parts, count)], np.r_[odd + 1.0, np.ones(parts)]
    graph = edge_graph(count + 1, tail, np.r_[b, roots], weight)
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
    NonManifoldError
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
        raise NonManifoldError(
            f"edge {origin[at]}-{dest[at]} belongs to {at_faces.size} faces "
            f"({', '.join(map(str, at_faces[:6]))}): a surface has at most two at an edge; "
            "delete the extra faces"
        )
    h, g = order[:-1][same], order[1:][same]
    odd = origin[h] == origin[g]
    flip, label = tree_parity(len(faces), face[h], face[g], odd)
    wrong = (flip[face[h]] ^ flip[face[g]]) != odd
    if wrong.any():
        at = h[wrong][0]
        raise NonManifoldError(
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
    out: Ints = faces.copy()
    if faces.shape[1] == 3:
        out[:, 1:] = faces[:, :0:-1]
        return out
    tri = faces[:, 3] < 0
    out[~tri, 1:] = faces[~tri, :0:-1]
    out[tri, 1], out[tri, 2] = faces[tri, 2], faces[tri, 1]
    return out


def check_vertices(he: HalfEdges) -> None:
    """Refuse non-manifold vertices, where fans of faces meet that share no edge there.

    Raises
    ------
    NonManifoldError
        There is such a vertex; the message names the first one.
    """
    count = he.origin.size
    turn = he.twin[he.prev]
    inner = np.flatnonzero(turn >= 0)
    _, one = np.unique(label_components(count, inner, turn[inner]), return_index=True)
    if one.size == np.count_nonzero(he.face_count):
        return
    per_vertex = np.bincount(he.origin[one], minlength=he.vertex_count)
    bad = np.flatnonzero(per_vertex > 1)
    raise NonManifoldError(
        f"vertex {bad[0]} joins {per_vertex[bad[0]]} parts of the surface that share no edge there "
        f"({bad.size} such vertices): give each part its own copy of the vertex"
    )


def edges(he: HalfEdges) -> Ints:
    """List each undirected edge once, (e, 2)."""
    once = _once(he)
    return np.stack([he.origin[once], he.dest[once]], axis=1)


def boundary_edges(he: HalfEdges) -> Flags:
    """Mark the boundary edges among :func:`edges`, (e,)."""
    return he.twin[_once(he)] < 0


def _once(he: HalfEdges) -> Flags:
    return (he.twin < 0) | (he.twin > np.arange(he.twin.size))
