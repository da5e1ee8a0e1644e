"""Shortest paths along edges, at a cost of each edge; on quads they follow edge rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gso.mesh.mesh import Mesh
from gso.mesh.topology import edge_graph
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Cost of a right-angled turn on a quad mesh, in mean edge lengths.
_TURN = 4.0


class Paths:
    """Edges of a mesh as a graph, for paths and distances.

    Parameters
    ----------
    mesh : Mesh
        On meshes without triangles, paths pay for turning.
    factor : ndarray, (e,), optional
        Factor on the cost of each edge of ``mesh.edges``; its length in space stays.
    """

    def __init__(self, mesh: Mesh, factor: Array | None = None):
        self.ends = mesh.edges
        self.length = mesh.edge_lengths
        self.cost = self.length if factor is None else self.length * factor
        self.count = len(mesh.vertices)
        self._plain = self._graph(self.length)
        self._turns = None if mesh.has_triangles else _Turns(mesh, self.ends, self.length)

    def _graph(self, weight: Array) -> csr_matrix:
        keep = np.isfinite(weight)
        a, b = self.ends[keep].T
        return edge_graph(self.count, a, b, weight[keep])

    def distance(self, sources: Ints, limit: float = np.inf) -> Array:
        """Return the distance along edges (n,) from the nearest of some vertices."""
        from scipy.sparse.csgraph import dijkstra

        return np.asarray(
            dijkstra(self._plain, directed=False, indices=sources, min_only=True, limit=limit)
        )

    def between(self, sources: Ints, limit: float) -> Array:
        """Return the distances (k, n) from every source up to a limit; infinite beyond."""
        from scipy.sparse.csgraph import dijkstra

        return np.asarray(dijkstra(self._plain, directed=False, indices=sources, limit=limit))

    def cheapest(
        self,
        target: int,
        reached: Flags,
        weight: Array,
        closed: Flags | None = None,
        limit: float = np.inf,
    ) -> Ints:
        """Return the vertices of the cheapest path from a vertex to marked ones.

        Parameters
        ----------
        target : int
            The vertex where the path begins.
        reached : ndarray of bool, (n,)
            Vertices where it may end.
        weight : ndarray, (e,)
            Factor on the cost of each edge.
        closed : ndarray of bool, (n,), optional
            Vertices that the path must avoid.
        limit : float
            Largest cost of the path, turns left out.

        Returns
        -------
        ndarray of int
            From the target on; the target alone where there is no path.
        """
        from scipy.sparse.csgraph import dijkstra

        cost = self.cost * weight
        if closed is not None:
            cost = np.where(closed[self.ends].any(axis=1), np.inf, cost)
        if self._turns is not None:
            return self._turns.cheapest(target, reached, cost)
        graph = self._graph(cost)
        away, before = dijkstra(
            graph, directed=False, indices=target, return_predecessors=True, limit=limit
        )
        return _traced(away, before, target, reached)


def _traced(away: Array, before: Ints, start: int, reached: Flags) -> Ints:
    """Follow predecessors from the nearest marked vertex back to the start."""
    goals = np.flatnonzero(reached & np.isfinite(away))
    if not goals.size:
        return np.array([start])
    path = [int(goals[away[goals].argmin()])]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    # The path ends at the first marked vertex that it meets.
    out = np.array(path[::-1])
    stop = np.flatnonzero(reached[out[1:]])
    return out[: stop[0] + 2] if stop.size else out


class _Turns:
    """Directed edges as nodes of a graph, so that paths pay for turning."""

    def __init__(self, mesh: Mesh, ends: Ints, length: Array):
        self.tail, self.head = np.r_[ends[:, 0], ends[:, 1]], np.r_[ends[:, 1], ends[:, 0]]
        self.edge = np.tile(np.arange(len(ends)), 2)
        way = mesh.vertices[self.head] - mesh.vertices[self.tail]
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        order = np.argsort(self.tail, kind="stable")
        first = np.searchsorted(self.tail[order], np.arange(len(mesh.vertices) + 1))
        number = (first[1:] - first[:-1])[self.head]
        before = np.repeat(np.arange(len(self.head)), number)
        offset = np.arange(len(before)) - np.repeat(np.cumsum(number) - number, number)
        after = order[first[self.head[before]] + offset]
        keep = self.tail[before] != self.head[after]
        self.before, self.after = before[keep], after[keep]
        cosine = np.einsum("ij,ij->i", way[self.before], way[self.after])
        self.turn = _TURN * float(length.mean()) * np.clip(1.0 - cosine - 0.1, 0.0, None)

    def cheapest(self, target: int, reached: Flags, cost: Array) -> Ints:
        """See :meth:`Paths.cheapest`; the costs (e,) include the factors."""
        from scipy.sparse.csgraph import dijkstra

        count, each = len(self.head), cost[self.edge]
        weight = each[self.after] + self.turn
        begin = np.flatnonzero((self.tail == target) & np.isfinite(each))
        keep = np.isfinite(weight)
        rows = np.r_[self.before[keep], np.full(len(begin), count)]
        columns = np.r_[self.after[keep], begin]
        values = np.r_[weight[keep], each[begin]]
        graph = edge_graph(count + 1, rows, columns, values)
        away, before = dijkstra(graph, indices=count, return_predecessors=True)
        path = _traced(away, before, count, np.append(reached[self.head], False))
        return np.asarray(np.r_[target, self.head[path[1:]]])
