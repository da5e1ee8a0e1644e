"""Shortest cuts that separate two parts of a mesh."""

from __future__ import annotations

import numpy as np

from gso.mesh.mesh import Mesh
from gso.typing import Array, Flags, Ints

#: Lengths are rounded to this share of the longest edge, for whole numbers in the flow.
_STEPS = 1000


def between(
    mesh: Mesh,
    one: Flags,
    two: Flags,
    price: Array | None = None,
    factor: Array | None = None,
) -> Ints:
    """Return the shortest edges (e, 2) whose removal separates two sets of faces.

    The length of an edge is multiplied by the mean price (n,) of its ends, and by the factor (e,)
    of each edge of ``mesh.edges``.

    Source: minimum cut (Ford and Fulkerson 1956) of the dual graph.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    length, k = spans(mesh)[1:]
    he, count = mesh.half_edges, len(mesh.faces)
    if not (one.any() and two.any() and len(k)):
        return np.empty((0, 2), np.int64)
    if price is not None:
        length = length * 0.5 * (price[he.origin[k]] + price[he.dest[k]])
    if factor is not None:
        length = length * factor[mesh.edge_numbers(he.origin[k], he.dest[k])]
    capacity = np.maximum(np.round(_STEPS * length / max(float(length.max()), 1e-300)), 1.0)
    f, g = he.face[k], he.face[he.twin[k]]
    much = np.int64(capacity.sum() + 1)
    source, sink = count, count + 1
    ends = np.flatnonzero(one), np.flatnonzero(two & ~one)
    rows = np.r_[f, g, np.full(len(ends[0]), source), ends[1]]
    columns = np.r_[g, f, ends[0], np.full(len(ends[1]), sink)]
    full = np.full(len(ends[0]) + len(ends[1]), much)
    values = np.r_[capacity, capacity, full].astype(np.int32 if much < 2**31 else np.int64)
    graph = coo_matrix((values, (rows, columns)), shape=(count + 2, count + 2)).tocsr()
    left = graph - maximum_flow(graph, source, sink).flow
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    side = np.zeros(count + 2, bool)
    side[breadth_first_order(left, source, return_predecessors=False)] = True
    cut = side[f] != side[g]
    return np.stack([he.origin[k[cut]], he.dest[k[cut]]], axis=1)


def centres(mesh: Mesh) -> Array:
    """Return the mean of each face's corners, (m, 3); beside quads a triangle has its first twice.

    >>> centres(Mesh(np.eye(3), [[0, 1, 2]])).round(2).tolist()
    [[0.33, 0.33, 0.33]]
    """
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    return np.asarray(mesh.vertices[corners].mean(axis=1))


def spans(mesh: Mesh) -> tuple[Array, Array, Ints]:
    """Return distances between neighbouring faces, lengths of their edges, and half-edges."""
    he = mesh.half_edges
    k = he.interior
    centre = centres(mesh)
    distance = np.linalg.norm(centre[he.face[k]] - centre[he.face[he.twin[k]]], axis=1)
    length = np.linalg.norm(mesh.vertices[he.origin[k]] - mesh.vertices[he.dest[k]], axis=1)
    return distance, length, k
