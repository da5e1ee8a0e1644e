"""Cuts through a piece that overlaps itself when it is laid flat, or is too large."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra, maximum_flow

from gso.mesh import Mesh
from gso.segmentation.sheets import Sheet, rectangle
from gso.typing import Array, Ints

#: Radius of the two parts that an overlap is cut between, relative to their distance.
_BALL = 0.3
#: Lengths are rounded to this share of the longest edge, for whole numbers in the flow.
_STEPS = 1000


def apart(sheet: Sheet) -> Ints:
    """Choose the edges (e, 2) of a shortest cut between two faces that overlap.

    Of all pairs that overlap, the one that is farthest apart on the surface.
    """
    mesh = sheet.mesh
    pairs = sheet.overlaps
    graph = _dual(mesh, _spans(mesh)[0])
    firsts = np.unique(pairs[:, 0])
    some = firsts[:: max(len(firsts) // 20, 1)]
    away = dijkstra(graph, directed=False, indices=some)
    row = np.searchsorted(some, pairs[:, 0])
    known = (row < len(some)) & (some[np.minimum(row, len(some) - 1)] == pairs[:, 0])
    pairs, row = pairs[known], row[known]
    apart = away[row, pairs[:, 1]]
    k = int(apart.argmax())
    from_one = away[row[k]]
    from_two = dijkstra(graph, directed=False, indices=int(pairs[k, 1]))
    reach = _BALL * float(apart[k])
    return between(mesh, from_one <= reach, from_two <= reach)


def halves(sheet: Sheet, longest: float) -> Ints:
    """Choose the edges (e, 2) of a shortest cut across the long side of a pattern.

    The parts are as few as a largest length allows, and about equal.
    """
    mesh = sheet.mesh
    angle, (length, _) = rectangle(sheet.flat)
    parts = max(int(np.ceil(length / longest)), 2)
    place = (parts // 2) / parts
    room = float(np.clip(0.5 * (longest / length - 1.0 / parts), 0.01, 0.1))
    along = sheet.flat @ np.array([np.cos(angle), np.sin(angle)])
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    middle = (along[corners].mean(axis=1) - along.min()) / length
    return between(
        mesh,
        middle < place - room,
        middle > place + room,
        1.0 + 0.1 * np.abs(middle - place) / room,
    )


def between(
    mesh: Mesh, one: NDArray[np.bool_], two: NDArray[np.bool_], price: Array | None = None
) -> Ints:
    """Return the shortest edges (e, 2) whose removal separates two sets of faces.

    The length of an edge is multiplied by the mean price (m,) of its faces.

    Source: minimum cut (Ford and Fulkerson 1956) of the dual graph.
    """
    length, k = _spans(mesh)[1:]
    he, count = mesh.half_edges, len(mesh.faces)
    if price is not None:
        length = length * 0.5 * (price[he.face[k]] + price[he.face[he.twin[k]]])
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


def _spans(mesh: Mesh) -> tuple[Array, Array, Ints]:
    """Return distances between neighbouring faces, lengths of their edges, and half-edges."""
    he = mesh.half_edges
    k = np.flatnonzero(he.twin > np.arange(he.twin.size))
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    centre = mesh.vertices[corners].mean(axis=1)
    distance = np.linalg.norm(centre[he.face[k]] - centre[he.face[he.twin[k]]], axis=1)
    length = np.linalg.norm(mesh.vertices[he.origin[k]] - mesh.vertices[he.dest[k]], axis=1)
    return distance, length, k


def _dual(mesh: Mesh, distance: Array) -> coo_matrix:
    he, k = mesh.half_edges, _spans(mesh)[2]
    f, g = he.face[k], he.face[he.twin[k]]
    shape = (len(mesh.faces), len(mesh.faces))
    return coo_matrix((np.maximum(distance, 1e-300), (f, g)), shape=shape).tocsr()
