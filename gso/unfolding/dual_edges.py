"""The edges between flat patches of a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry import area_vectors
from gso.geometry.vectors import fold_angles, unit
from gso.mesh.topology import edge_keys
from gso.typing import Array, Ints


@dataclass(frozen=True, eq=False)
class DualEdges:
    """Interior edges of triangles, which are the edges of the graph of their patches.

    Half-edge 3 t + k of triangle t begins at its corner k.

    Attributes
    ----------
    halves : ndarray of int, (e, 2)
        The half-edges of both sides.
    ends : ndarray of int, (e, 2)
        Vertices, in the direction of the first half-edge.
    angles : ndarray, (e,)
        Angles between the triangles in radians, positive for mountain folds.
    """

    halves: Ints
    ends: Ints
    angles: Array

    def __len__(self) -> int:
        return len(self.halves)

    def taken(self, which: Ints) -> DualEdges:
        """Return some of the edges."""
        return DualEdges(self.halves[which], self.ends[which], self.angles[which])

    @property
    def triangles(self) -> Ints:
        """The triangles of both sides, (e, 2)."""
        return self.halves // 3

    def corners(self) -> tuple[Ints, Ints]:
        """Return the places, 3 t + k, of both ends (e, 2) in the triangles of either side."""
        h = self.halves
        ahead = h - h % 3 + (h + 1) % 3
        one = np.stack([h[:, 0], ahead[:, 0]], axis=1)
        other = np.stack([ahead[:, 1], h[:, 1]], axis=1)
        return one, other


def dual_edges(triangles: Ints, points: Array) -> DualEdges:
    """Return the interior edges of consistently oriented triangles (t, 3), and their angles."""
    origin = triangles.ravel()
    dest = np.roll(triangles, -1, axis=1).ravel()
    key = edge_keys(origin, dest, len(points))
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order][1:] == key[order][:-1])
    halves = np.stack([order[pair], order[pair + 1]], axis=1)
    ends = np.stack([origin[halves[:, 0]], dest[halves[:, 0]]], axis=1)
    one, other = unit(area_vectors(points, triangles))[halves // 3].transpose(1, 0, 2)
    way = points[ends[:, 1]] - points[ends[:, 0]]
    return DualEdges(halves, ends, fold_angles(one, other, way))
