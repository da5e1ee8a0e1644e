"""Vertices of clipped faces: corners of the strips, points of their edges, and inner points."""

from __future__ import annotations

import numpy as np

from gso.ruled.strip_layout import Strips
from gso.typing import Array, Ints

#: Barycentric coordinates below this are on the opposite edge; nodes on an edge that are closer
#: to each other than this share of its length are one.
_EDGE = 1e-7
#: Corners of the triangles of a face; of one that is divided along its other diagonal.
_HALVES = {False: ((0, 1, 3), (0, 3, 2)), True: ((0, 1, 2), (1, 3, 2))}


class Nodes:
    """Vertices of clipped faces: corners of the strips, points of their edges, inner points."""

    def __init__(self, strips: Strips, vertices: Array, place: Array):
        self.strips, self.vertices, self.place = strips, vertices, place
        self.points: list[Array] = []
        self._places: list[Array] = []
        self.inner: list[bool] = []
        self._known: dict[tuple[int, int], list[tuple[float, int]]] = {}
        self._corner: dict[int, int] = {}
        self._other = strips.other_diagonal(vertices)

    def ring(self, face: int, ring: Array) -> list[int]:
        """Return the nodes of a ring (k, 2) of a piece of a face."""
        c = self.strips.corners[face]
        best = np.full(len(ring), -np.inf)
        shares = np.zeros((len(ring), 3))
        ids = np.zeros((len(ring), 3), np.int64)
        for three in _HALVES[bool(self._other[face])]:
            corner = c[list(three)]
            if len(set(corner.tolist())) < 3:
                continue
            found = _barycentric(ring, self.place[corner])
            better = found.min(axis=1) > best
            best[better] = found[better].min(axis=1)
            shares[better], ids[better] = found[better], corner
        out: list[int] = []
        for xy, share, corner in zip(ring, shares, ids, strict=True):
            node = self._node(face, share, corner)
            if node == len(self._places):
                self._places.append(xy)
            if not out or (node != out[-1] and node != out[0]):
                out.append(node)
        return out

    def _node(self, face: int, share: Array, corner: Ints) -> int:
        share = np.where(np.abs(share) < _EDGE, 0.0, share)
        held = np.flatnonzero(share)
        if held.size == 1:
            vertex = int(corner[held[0]])
            if vertex not in self._corner:
                self._corner[vertex] = self._new(self.vertices[vertex], inner=False)
            return self._corner[vertex]
        if held.size == 2 and not self._is_diagonal(face, corner[held]):
            (a, x), (b, y) = sorted(zip(corner[held].tolist(), share[held].tolist(), strict=True))
            at = y / (x + y)
            known = self._known.setdefault((a, b), [])
            for other, node in known:
                if abs(other - at) < _EDGE:
                    return node
            point = (1.0 - at) * self.vertices[a] + at * self.vertices[b]
            known.append((at, self._new(point, inner=False)))
            return known[-1][1]
        share = share / share.sum()
        return self._new(share @ self.vertices[corner], inner=True)

    def parameters(self, ring: Ints) -> Array:
        """Return the parameters (k, 2) of nodes."""
        return np.array(self._places)[ring]

    def _is_diagonal(self, face: int, pair: Ints) -> bool:
        c = self.strips.corners[face]
        quad = c[0] != c[2] and c[1] != c[3]
        ends = c[[1, 2]] if self._other[face] else c[[0, 3]]
        return bool(quad and set(pair.tolist()) == set(ends.tolist()))

    def _new(self, point: Array, *, inner: bool) -> int:
        self.points.append(point)
        self.inner.append(inner)
        return len(self.points) - 1


def _barycentric(points: Array, triangle: Array) -> Array:
    a, b, c = triangle
    u, v, w = b - a, c - a, points - a
    det = u[0] * v[1] - u[1] * v[0]
    second = (w[:, 0] * v[1] - w[:, 1] * v[0]) / det
    third = (u[0] * w[:, 1] - u[1] * w[:, 0]) / det
    return np.stack([1.0 - second - third, second, third], axis=1)
