"""The exact unrolling of planar faces: each is moved rigidly into the plane."""

from __future__ import annotations

import numpy as np

from gso.geometry.vectors import cross, unit
from gso.mesh.topology import edge_graph
from gso.ruled.strip_layout import Strips
from gso.typing import Array, Ints


class Unrolled:
    """Rigid motions of the faces of planar strips into the plane, part by part.

    Faces that share a ruling stay joined; creases between strips side by side are cut.

    Parameters
    ----------
    strips : Strips
        The layout.
    vertices : ndarray, (n, 3)
        Positions, with planar faces.
    up : ndarray, (f, 3)
        The side of each face that is on top in the plane.

    Attributes
    ----------
    normals : ndarray, (f, 3)
        Unit normals of the faces on that side.
    part : ndarray of int, (f,)
        Number of the part of each face.
    """

    def __init__(self, strips: Strips, vertices: Array, up: Array):
        corner = vertices[strips.corners]
        # The diagonals of a triangle are two of its sides.
        normal = unit(cross(corner[:, 3] - corner[:, 0], corner[:, 1] - corner[:, 2]))
        turned = np.einsum("fd,fd->f", normal, up) < 0
        self.normals = np.where(turned[:, None], -normal, normal)
        self._origin = corner.mean(axis=1)
        along = unit(corner[:, 3] - corner[:, 0])
        along = unit(along - np.einsum("fd,fd->f", along, self.normals)[:, None] * self.normals)
        self._axes = np.stack([along, cross(self.normals, along)], axis=1)
        self._place(strips, vertices)

    def _place(self, strips: Strips, vertices: Array) -> None:
        """Turn and shift each face so that it continues the one before."""
        count = len(strips.corners)
        follow, ends, self.part = _order(strips, count)
        self._turn = np.ones(count, complex)
        self._shift = np.zeros(count, complex)
        for (face, before), (a, b) in zip(follow, ends, strict=True):
            p, q = self._local(before, vertices[a]), self._local(before, vertices[b])
            p, q = (self._turn[before] * z + self._shift[before] for z in (p, q))
            own = self._local(face, vertices[b]) - self._local(face, vertices[a])
            turn = (q - p) / own
            self._turn[face] = turn / abs(turn)
            self._shift[face] = p - self._turn[face] * self._local(face, vertices[a])

    def _local(self, face: int, point: Array) -> complex:
        x, y = self._axes[face] @ (point - self._origin[face])
        return complex(x, y)

    def flat(self, faces: Ints, points: Array) -> Array:
        """Return the places (k, 2) in the plane of points (k, 3) on given faces (k,)."""
        local = np.einsum("kid,kd->ki", self._axes[faces], points - self._origin[faces])
        z = self._turn[faces] * (local @ np.array([1.0, 1j])) + self._shift[faces]
        return np.stack([z.real, z.imag], axis=1)


def _order(strips: Strips, count: int) -> tuple[list[tuple[int, int]], Ints, Ints]:
    """Return (face, face before), the rulings that they share, and the part of each face."""
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    one, two, rulings = strips.hinges
    graph = edge_graph(count, one, two, np.arange(1.0, len(one) + 1))
    graph = graph + graph.T
    number, part = connected_components(graph, directed=False)
    follow: list[tuple[int, int]] = []
    ends = []
    for k in range(number):
        order, before = breadth_first_order(graph, int((part == k).argmax()), directed=False)
        for face in order[1:].tolist():
            follow.append((face, int(before[face])))
            ends.append(rulings[int(graph[face, before[face]]) - 1])
    return follow, np.array(ends).reshape(-1, 2), part.astype(np.int64)
