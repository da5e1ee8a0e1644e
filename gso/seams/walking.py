"""Straight walks over a triangle mesh, from vertex to vertex through the triangles between."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.typing import Array, Ints

#: A walk passes through a vertex when it crosses an edge this close to it, relative to its length.
_SNAP = 0.1


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
    """

    def __init__(self, start: int):
        self.edges: list[tuple[int, int]] = []
        self.shares: list[float] = []
        self.stops = [start]

    def cross(self, a: int, b: int, share: float) -> None:
        """Add a point on an edge."""
        self.stops.append(-1 - len(self.edges))
        self.edges.append((a, b))
        self.shares.append(share)


def walk(mesh: Mesh, start: int, goal: int) -> Walk | None:
    """Walk from one vertex to another in the plane that contains the surface's normals there.

    At each vertex that it passes the walk takes aim again. None where it leaves the surface or
    goes astray.
    """
    he, v = mesh.half_edges, mesh.vertices
    normals = vertex_normals(mesh)
    found, here = Walk(start), start
    for _ in range(4 * len(mesh.faces)):
        if here == goal:
            return found
        out = _outgoing(mesh, here)
        ahead = v[goal] - v[here]
        if goal in he.dest[out]:
            found.stops.append(goal)
            return found
        side = np.cross(ahead, normals[here] + normals[goal])
        height = (v - v[here]) @ side
        after = _through(mesh, height, ahead, here, out, found)
        if after is None:
            return None
        found.stops.append(after)
        here = after
    return None


def _outgoing(mesh: Mesh, vertex: int) -> Ints:
    """Return the half-edges of all faces at a vertex that leave it."""
    return np.flatnonzero(mesh.half_edges.origin == vertex)


def _through(
    mesh: Mesh, height: Array, ahead: Array, here: int, out: Ints, found: Walk
) -> int | None:
    """Walk through triangles until the next vertex."""
    he, v = mesh.half_edges, mesh.vertices
    opposite = he.next[out]
    a, b = he.origin[opposite], he.dest[opposite]
    high, low = height[a], height[b]
    crossed = (high >= 0) != (low >= 0)
    share = np.where(crossed, high / np.where(crossed, high - low, 1.0), 0.0)
    point = v[a] + share[:, None] * (v[b] - v[a]) - v[here]
    good = crossed & (point @ ahead > 0)
    if not good.any():
        return None
    k = int(opposite[np.where(good, point @ ahead / np.linalg.norm(point, axis=1), -1).argmax()])
    for _ in range(len(mesh.faces)):
        one, two = int(he.origin[k]), int(he.dest[k])
        place = float(height[one] / (height[one] - height[two]))
        if place <= _SNAP or place >= 1.0 - _SNAP:
            return one if place <= _SNAP else two
        found.cross(one, two, place)
        k = int(he.twin[k])
        if k < 0:
            return None
        third = int(he.dest[he.next[k]])
        # The other side of the next triangle that the plane crosses.
        k = int(he.next[k] if (height[third] >= 0) != (height[he.dest[k]] >= 0) else he.prev[k])
    return None
