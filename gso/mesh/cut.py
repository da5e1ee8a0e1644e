"""Cutting a mesh open along edges, and choosing the edges to cut.

Each vertex of the cut mesh corresponds to a fan of the original: a run of consecutive face
corners around a vertex with no cut edge between them. The first fan keeps the index of the
vertex; the others get new indices after the last one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError
from gso.mesh.mesh import Mesh
from gso.mesh.topology import edge_graph, edge_keys, label_components, pair_keys
from gso.short_repr import short_repr
from gso.typing import Ints

#: Relative difference below which two path lengths count as equal.
_EVEN = 1e-9


@dataclass(frozen=True)
class Cut:
    """A mesh that was cut open along edges.

    Attributes
    ----------
    mesh : Mesh
        The cut mesh: p vertices; the faces keep their order and their first corners.
    vertex : ndarray of int, (p,)
        Index in the original mesh of each vertex; the first n are 0 ... n - 1.
    seams : ndarray of int, (s, 2, 2)
        The two copies of each cut edge, as vertices of the cut mesh. The first ends of both
        copies were one vertex, and so were the second ends.
    """

    mesh: Mesh
    vertex: Ints
    seams: Ints

    __repr__ = short_repr


def cut(mesh: Mesh, edges: ArrayLike) -> Cut:
    """Cut a mesh open along edges.

    The cut edges and the boundary divide the faces around a vertex into fans; each fan gets
    its own copy of the vertex. So there is one copy at the end of a cut line inside the
    surface, two along a line, three where three lines meet.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    edges : array_like of int, (e, 2)
        Edges of its faces, in any order and direction. Boundary edges are ignored.

    Returns
    -------
    Cut

    Raises
    ------
    MeshError
        A pair of vertices is no edge of a face.

    Examples
    --------
    >>> y, x = np.mgrid[:3.0, :3.0]
    >>> sheet = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    >>> slit = cut(sheet, [[4, 5]])
    >>> slit.vertex
    array([0, 1, 2, 3, 4, 5, 6, 7, 8, 5])
    >>> slit.seams.tolist()
    [[[4, 5], [4, 9]]]
    """
    he, n = mesh.half_edges, len(mesh.vertices)
    wanted = np.asarray(edges, dtype=np.int64).reshape(-1, 2)
    keys, own = pair_keys(wanted, n), edge_keys(he.origin, he.dest, n)
    inside = ((wanted >= 0) & (wanted < n)).all(axis=1)
    missing = np.flatnonzero(~(inside & np.isin(keys, own)))
    if missing.size:
        a, b = wanted[missing[0]]
        raise MeshError(
            f"{a}-{b} is no edge of a face ({missing.size} such pairs); cuts run along edges"
        )
    divided = np.isin(own, keys)
    after = he.twin[he.prev]
    joined = np.flatnonzero((after >= 0) & ~divided[he.prev])
    corners = len(own)
    fan = label_components(corners, joined, after[joined])
    _, first = np.unique(fan, return_index=True)
    owner = he.origin[first]
    order = np.lexsort((first, owner))
    again = np.r_[False, owner[order][1:] == owner[order][:-1]]
    number = owner.copy()
    number[order[again]] = n + np.arange(int(again.sum()))
    corner = number[fan]
    faces = mesh.faces.copy()
    faces[faces >= 0] = corner
    vertex = np.r_[np.arange(n), owner[order[again]]]
    h = np.flatnonzero(divided & (he.twin > np.arange(corners)))
    t = he.twin[h]
    sides = [[corner[h], corner[he.next[h]]], [corner[he.next[t]], corner[t]]]
    seams = np.moveaxis(np.array(sides, np.int64).reshape(2, 2, -1), -1, 0)
    seams = seams[(seams[:, 0] != seams[:, 1]).any(axis=1)]
    return Cut(Mesh(mesh.vertices[vertex], faces), vertex, seams)


def joining(mesh: Mesh, loops: Sequence[Ints]) -> Ints:
    """Find a tree of shortest edge paths (e, 2) that joins boundary loops of one component.

    The tree starts at the first loop. In each step the nearest remaining loop is joined to it
    by a shortest path along edges. Paths avoid boundary loops that are not given, where
    possible. A surface of genus zero whose loops are all given becomes a disk when it is cut
    along the tree.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    loops : sequence of ndarray of int
        Vertices of the boundary loops.

    Examples
    --------
    >>> angle, z = np.meshgrid(np.arange(8) * np.pi / 4, np.arange(3.0))
    >>> ring = np.stack([np.cos(angle), np.sin(angle), z], axis=-1).reshape(-1, 3)
    >>> k = np.arange(16)
    >>> on = k // 8 * 8 + (k + 1) % 8
    >>> tube = Mesh(ring, np.stack([k, on, on + 8, k + 8], axis=1))
    >>> joining(tube, tube.boundary_loops).tolist()
    [[0, 8], [8, 16]]
    """
    from scipy.sparse.csgraph import dijkstra

    n, (a, b), length = len(mesh.vertices), mesh.edges.T, mesh.edge_lengths
    others = mesh.half_edges.boundary_vertex.copy()
    others[np.concatenate(loops)] = False
    # Penalty on edges that touch other loops: any path that avoids them is shorter.
    length[others[mesh.edges].any(axis=1)] += length.sum()
    graph = edge_graph(n, a, b, length)
    reached, left = np.unique(loops[0]), list(loops[1:])
    lines = [np.empty((0, 2), np.int64)]
    while left:
        away, before, _ = dijkstra(
            graph, directed=False, indices=reached, min_only=True, return_predecessors=True
        )
        nearest = int(np.argmin([away[loop].min() for loop in left]))
        loop = left.pop(nearest)
        ties = loop[away[loop] <= (1.0 + _EVEN) * away[loop].min()]
        line = [int(ties.min())]
        while before[line[-1]] >= 0:
            line.append(int(before[line[-1]]))
        lines.append(np.stack([line[1:], line[:-1]], axis=1)[::-1])
        reached = np.unique(np.r_[reached, loop, line])
    return np.concatenate(lines)
