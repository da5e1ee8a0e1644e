"""Edges to cut so that every piece is a disk: rings are opened, handles are cut.

The shortest edges are chosen by a tree and a cotree (Erickson and Whittlesey 2005, Greedy optimal
homotopy and homology generators): a tree of shortest paths from the boundary, a tree of faces
across the remaining edges, longest first; the edges in neither, with their paths to the
boundary, cut the surface to a disk.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree

from gso.mesh import Mesh
from gso.mesh.topology import edge_graph
from gso.typing import Array, Ints


def opening(mesh: Mesh, factor: Array | None = None) -> Ints:
    """Choose the edges (e, 2) to cut so that every component of a mesh becomes a disk.

    A sphere is cut along two edges.

    Parameters
    ----------
    mesh : Mesh
        The surface, of any genus, with any number of boundary loops.
    factor : ndarray, (e,), optional
        Factor on the length of each edge of ``mesh.edges``.

    Examples
    --------
    >>> angle, z = np.meshgrid(np.arange(8) * np.pi / 4, np.arange(3.0))
    >>> ring = np.stack([np.cos(angle), np.sin(angle), z], axis=-1).reshape(-1, 3)
    >>> k = np.arange(16)
    >>> on = k // 8 * 8 + (k + 1) % 8
    >>> tube = Mesh(ring, np.stack([k, on, on + 8, k + 8], axis=1))
    >>> opening(tube).tolist()
    [[7, 15], [15, 23]]
    """
    n, ends, he = len(mesh.vertices), mesh.edges, mesh.half_edges
    length = mesh.edge_lengths
    length = np.maximum(length if factor is None else length * factor, 1e-300)
    sources = _sources(mesh)
    # The boundary of each component counts as one vertex.
    root, label = n + mesh.components[sources], mesh.components
    count = n + int(label.max()) + 1
    a = np.r_[ends[:, 0], root]
    b = np.r_[ends[:, 1], sources]
    away, before, _ = dijkstra(
        edge_graph(count, a, b, np.r_[length, np.zeros(len(root))]),
        directed=False,
        indices=np.unique(root),
        min_only=True,
        return_predecessors=True,
    )
    before = np.where((before >= 0) & (before < n), before, -1)
    child = np.flatnonzero(before[:n] >= 0)
    in_tree = np.zeros(len(ends), bool)
    in_tree[mesh.edge_numbers(child, before[child])] = True
    k = he.interior
    edge = mesh.edge_numbers(he.origin[k], he.dest[k])
    k, edge = k[~in_tree[edge]], edge[~in_tree[edge]]
    longest = away[ends[edge]].sum(axis=1) + length[edge]
    # A spanning tree of most length; of parallel edges between two faces only one can be in it.
    size = 1.0 + float(longest.max(initial=0.0))
    f, g = np.sort(np.stack([he.face[k], he.face[he.twin[k]]]), axis=0)
    rank = np.lexsort((-longest, g, f))
    f, g, longest, edge = f[rank], g[rank], longest[rank], edge[rank]
    first = np.r_[True, (f[1:] != f[:-1]) | (g[1:] != g[:-1])] if f.size else np.zeros(0, bool)
    faces = len(mesh.faces)
    price = edge_graph(faces, f[first], g[first], size - longest[first])
    tree = minimum_spanning_tree(price).tocoo()
    pair = np.sort(np.stack([tree.row, tree.col]), axis=0)
    used = np.isin(f * faces + g, pair[0] * faces + pair[1]) & first
    out = [np.empty((0, 2), np.int64), _slits(mesh, ends[edge[~used]], length)]
    for rest in ends[edge[~used]].tolist():
        out.append(np.array([rest]))
        for vertex in rest:
            line = [vertex]
            while before[line[-1]] >= 0:
                line.append(int(before[line[-1]]))
            out.append(np.array([line[:-1], line[1:]], np.int64).T)
    return np.unique(np.sort(np.concatenate(out), axis=1), axis=0)


def _slits(mesh: Mesh, cut: Ints, length: Array) -> Ints:
    """Choose two edges (2 c, 2) at one vertex of every closed component without handles."""
    label, ends = mesh.components, mesh.edges
    known = np.r_[label[mesh.half_edges.boundary_vertex], label[cut[:, 0]]]
    out = [np.empty((0, 2), np.int64)]
    for own in np.setdiff1d(label[mesh.used], known):
        k = np.flatnonzero(label[ends[:, 0]] == own)
        vertex = ends[k[length[k].argmin()], 0]
        at = k[(ends[k] == vertex).any(axis=1)]
        out.append(ends[at[np.argsort(length[at], kind="stable")[:2]]])
    return np.concatenate(out)


def _sources(mesh: Mesh) -> Ints:
    """Return the boundary vertices, and one vertex of each closed component."""
    on = mesh.half_edges.boundary_vertex.copy()
    label, used = mesh.components, mesh.used
    open_ones = np.unique(label[on])
    for own in np.setdiff1d(label[used], open_ones):
        on[int(np.flatnonzero((label == own) & used)[0])] = True
    return np.flatnonzero(on & used)
