"""Polylines, hinges and boundary loops."""

from __future__ import annotations

import numpy as np

from gso.mesh.topology.graph import component_labels
from gso.mesh.topology.half_edges import HalfEdges
from gso.typing import Ints


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
    # Sorting by two keys is several times faster than np.unique of rows.
    order = np.lexsort([crosses[:, 2], crosses[:, 0] * len(he.face_count) + crosses[:, 1]])
    crosses = crosses[order]
    new = np.ones(len(crosses), bool)
    new[1:] = (crosses[1:, :3] != crosses[:-1, :3]).any(axis=1)
    return crosses[new]


def hinges(he: HalfEdges) -> Ints:
    """List the four vertices (a, b, left, right) around every interior edge of a triangulation."""
    h = np.flatnonzero(he.twin > np.arange(he.twin.size))
    return np.stack(
        [he.origin[h], he.dest[h], he.dest[he.next[h]], he.dest[he.next[he.twin[h]]]], axis=1
    )


def boundary_loops(he: HalfEdges) -> list[Ints]:
    """List the vertex ids of the boundary loops, anticlockwise round the surface, longest first."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import depth_first_order

    rim = np.flatnonzero(he.twin < 0)
    if rim.size == 0:
        return []
    # The next boundary edge is found by walking around the end vertex from face to face, so
    # that a vertex where two fans meet is passed once per fan.
    ahead = he.next[rim]
    while (he.twin[ahead] >= 0).any():
        ahead = np.where(he.twin[ahead] >= 0, he.next[he.twin[ahead]], ahead)
    n, after = rim.size, np.searchsorted(rim, ahead)
    label = component_labels(n, np.arange(n), after)
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
