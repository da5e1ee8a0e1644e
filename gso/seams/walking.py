"""Straight walks over a triangle mesh, from vertex to vertex through the triangles between."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gso.mesh import Mesh, vertex_normals
from gso.typing import Array, Ints

#: A walk passes through a vertex when it crosses an edge this close to it, relative to its length.
_SNAP = 0.1


@dataclass
class Walk:
    """A walk, as vertices and points on edges.

    Attributes
    ----------
    edges : list of (int, int)
        Edges that it crosses.
    shares : list of float
        Where, between both ends.
    stops : list of int
        What it passes: vertices, or ``-1 - k`` for the k-th crossed edge.
    faces : set of int
        Triangles that it divides.
    """

    stops: list[int]
    edges: list[tuple[int, int]] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    faces: set[int] = field(default_factory=set)

    @property
    def vertices(self) -> list[int]:
        """The vertices that it passes."""
        return [stop for stop in self.stops if stop >= 0]


class Walker:
    """Walks over a triangle mesh.

    Parameters
    ----------
    mesh : Mesh
    """

    def __init__(self, mesh: Mesh):
        self._he, self._v = mesh.half_edges, mesh.vertices
        self._normals = vertex_normals(mesh)
        self._order = np.argsort(self._he.origin, kind="stable")
        self._first = np.searchsorted(
            self._he.origin[self._order], np.arange(len(mesh.vertices) + 1)
        )
        self._most = len(mesh.faces)

    def walk(self, start: int, goal: int) -> Walk | None:
        """Walk from one vertex to another in the plane that contains the surface's normals there.

        At each vertex that it passes the walk takes aim again. None where it leaves the surface
        or goes astray.
        """
        found, here = Walk([start]), start
        for _ in range(self._most):
            if here == goal:
                return found
            out = self._order[self._first[here] : self._first[here + 1]]
            if goal in self._he.dest[out]:
                found.stops.append(goal)
                return found
            ahead = self._v[goal] - self._v[here]
            side = np.cross(ahead, self._normals[here] + self._normals[goal])
            after = self._through(side, ahead, here, out, found)
            if after is None or after in found.stops:
                return None
            found.stops.append(after)
            here = after
        return None

    def _through(self, side: Array, ahead: Array, here: int, out: Ints, found: Walk) -> int | None:
        """Walk through triangles until the next vertex."""
        he, v = self._he, self._v
        opposite = he.next[out]
        a, b = he.origin[opposite], he.dest[opposite]
        high, low = (v[a] - v[here]) @ side, (v[b] - v[here]) @ side
        crossed = (high >= 0) != (low >= 0)
        share = np.where(crossed, high / np.where(crossed, high - low, 1.0), 0.0)
        point = v[a] + share[:, None] * (v[b] - v[a]) - v[here]
        along = point @ ahead
        good = crossed & (along > 0)
        if not good.any():
            return None
        k = int(opposite[np.where(good, along / np.linalg.norm(point, axis=1), -1).argmax()])

        def height(vertex: int) -> float:
            return float((v[vertex] - v[here]) @ side)

        for _ in range(self._most):
            one, two = int(he.origin[k]), int(he.dest[k])
            place = height(one) / (height(one) - height(two))
            if place <= _SNAP or place >= 1.0 - _SNAP:
                found.faces.add(int(he.face[k]))
                return one if place <= _SNAP else two
            found.faces.update((int(he.face[k]), int(he.face[he.twin[k]])))
            found.stops.append(-1 - len(found.edges))
            found.edges.append((one, two))
            found.shares.append(place)
            k = int(he.twin[k])
            if k < 0:
                return None
            third = int(he.dest[he.next[k]])
            # The other side of the next triangle that the plane crosses.
            other = (height(third) >= 0) != (height(int(he.dest[k])) >= 0)
            k = int(he.next[k] if other else he.prev[k])
        return None
