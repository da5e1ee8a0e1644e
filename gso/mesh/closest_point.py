"""Closest-point queries on a triangulated surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh.mesh import Mesh
from gso.typing import Array, Ints


class Feet(NamedTuple):
    """Closest points of a surface to given points.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Closest points.
    normals : ndarray, (k, 3)
        Unit normals of the surface there, interpolated from its vertices.
    distances : ndarray, (k,)
        Distances to the given points.
    """

    points: Array
    normals: Array
    distances: Array


class Nearest:
    """Closest points of a triangulated surface, by a bounding-box tree that is built once.

    Parameters
    ----------
    mesh : Mesh
        The surface, triangulated by :attr:`gso.Mesh.triangles`.
    normals : ndarray, (n, 3), optional
        Unit normals at its vertices, for :meth:`feet`; zero when not given.
    """

    def __init__(self, mesh: Mesh, normals: Array | None = None):
        self._build(mesh.vertices, mesh.triangles)
        self._normals = np.zeros_like(self._vertices) if normals is None else normals

    @classmethod
    def of(cls, vertices: Array, triangles: Ints) -> Nearest:
        """Make the tree of triangles (t, 3) of points (n, 3), which need not be a valid mesh."""
        out = cls.__new__(cls)
        out._build(vertices, triangles)
        out._normals = np.zeros_like(out._vertices)
        return out

    def _build(self, vertices: Array, triangles: Ints) -> None:
        import igl

        self._vertices = np.ascontiguousarray(vertices, np.float64)
        self._triangles = np.ascontiguousarray(triangles, np.int64)
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._triangles)

    def locate(self, points: Array) -> tuple[Ints, Array, Array]:
        """Find the closest points to points (k, 3) on the triangles.

        Returns
        -------
        triangles : ndarray of int, (k,)
        shares : ndarray, (k, 3)
            Barycentric coordinates.
        feet : ndarray, (k, 3)
        """
        _, triangle, foot = self._query(points)
        a, b, c = (self._vertices[self._triangles[triangle, k]] for k in range(3))
        # Solvers ask for points of steps that they then reject, which may not be finite.
        with np.errstate(invalid="ignore", divide="ignore"):
            u, v, w = b - a, c - a, foot - a
            uu, uv, vv, uw, vw = (
                np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w))
            )
            second, third = np.array([vv * uw - uv * vw, uu * vw - uv * uw]) / (uu * vv - uv * uv)
            first = 1 - second - third
        shares = np.nan_to_num(np.clip(np.stack([first, second, third], axis=1), 0, 1))
        # Triangles without area count as their first corner.
        shares[shares.sum(axis=1) == 0] = [1.0, 0.0, 0.0]
        return triangle, shares / shares.sum(axis=1, keepdims=True), foot

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Return the triangle nearest to every point (k, 3), and its distance, both (k,)."""
        squared, triangle, _ = self._query(points)
        return triangle, np.sqrt(squared)

    def distances(self, points: Array) -> Array:
        """Return the distance of every point (k, 3) from the surface, (k,)."""
        return self.nearest(points)[1]

    def feet(self, points: Array) -> Feet:
        """Find the closest points to points (k, 3), and the surface's normals there."""
        squared, triangle, foot = self._query(points)
        corner = self._triangles[triangle]
        a, b, c = (self._vertices[corner[:, k]] for k in range(3))
        opposite = [np.cross(c - b, foot - b), np.cross(a - c, foot - c), np.cross(b - a, foot - a)]
        face = geometry.area_vectors(self._vertices, corner)
        # Barycentric coordinates up to a factor, signed by the triangle's own normal.
        share = np.stack([np.einsum("kd,kd->k", x, face) for x in opposite])
        share = np.maximum(share, 0.0)
        normals = np.einsum("jk,jkd->kd", share, self._normals[corner.T])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        first = self._normals[corner[:, 0]]
        straight = length > 1e-12 * length.max(initial=0.0)
        normals = np.divide(normals, length, out=first.copy(), where=straight)
        return Feet(foot, normals, np.sqrt(squared))

    def _query(self, points: Array) -> tuple[Array, Ints, Array]:
        queries = np.ascontiguousarray(points, np.float64)
        squared, triangle, foot = self._tree.squared_distance(
            self._vertices, self._triangles, queries
        )
        return np.maximum(squared, 0.0), np.asarray(triangle).ravel(), np.asarray(foot)
