"""Triangles of surfaces as people bring them: polygons, concave ones, and what is not manifold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso.errors import MeshError
from gso.geometry import area_vectors
from gso.geometry.ears import ears, in_plane
from gso.geometry.vectors import unit
from gso.mesh import Mesh
from gso.typing import Array, Ints
from gso.unfolding.manifold_division import divided

#: Distance of the corners of a face from its plane, relative to its size, that a note names.
_BENT = 1e-4


@dataclass(frozen=True, eq=False)
class PlanarFaces:
    """A manifold surface of triangles made of polygons.

    Attributes
    ----------
    mesh : Mesh
        The triangles.
    face : ndarray of int, (t,)
        The polygon of each triangle.
    vertex : ndarray of int, (n,)
        For each vertex, that of the surface as it was given.
    """

    mesh: Mesh
    face: Ints
    vertex: Ints

    @property
    def edges(self) -> Ints:
        """Half-edges (e, 2) of the polygons: not the diagonals along which they are divided."""
        he = self.mesh.half_edges
        own = (he.twin < 0) | (self.face[he.face] != self.face[he.face[he.twin]])
        return np.stack([he.origin[own], he.dest[own]], axis=1)

    @classmethod
    def of(
        cls, points: Array, polygons: Sequence[Sequence[int]], notes: tuple[str, ...] = ()
    ) -> PlanarFaces:
        """Divide polygons, given by their corners, into triangles inside them.

        Where an edge has more than two faces, or parts of the surface share a vertex only, the
        surface is divided, and a note says so.

        Raises
        ------
        MeshError
            A face has fewer than three corners, points outside the vertices, or crosses itself;
            or is inside a body; or :class:`gso.Mesh` rejects the triangles.
        """
        triangles, face = _triangles(points, polygons)
        bent = _bent(points, triangles, face)
        if len(bent):
            notes += (
                f"{len(bent)} faces are not flat and are folded along a diagonal (the first is "
                f"face {bent[0]})",
            )
        vertex = np.arange(len(points))
        _check_once(polygons)
        split = divided(points, triangles, face)
        if split is not None:
            triangles, vertex, note = split
            notes += (note,)
        mesh = Mesh(points[vertex], triangles, notes=notes, touching=split is not None)
        return cls(mesh, face, vertex)


def _check_once(polygons: Sequence[Sequence[int]]) -> None:
    """Refuse polygons with the same corners."""
    first: dict[tuple[int, ...], int] = {}
    for k, polygon in enumerate(polygons):
        before = first.setdefault(tuple(sorted(polygon)), k)
        if before != k:
            raise MeshError(f"face {k} has the corners of face {before}; delete one of them")


def _triangles(points: Array, polygons: Sequence[Sequence[int]]) -> tuple[Ints, Ints]:
    size = np.array([len(polygon) for polygon in polygons], np.int64)
    corners = np.array([c for polygon in polygons for c in polygon], np.int64)
    first = np.cumsum(size) - size
    bad = np.flatnonzero(size < 3)
    if len(bad):
        raise MeshError(f"face {bad[0]} has {size[bad[0]]} corners; a face needs three or more")
    owner = np.repeat(np.arange(len(size)), size)
    outside = (corners < 0) | (corners >= len(points))
    if outside.any():
        raise MeshError(
            f"face {owner[outside][0]} points outside the {len(points)} vertices; correct it"
        )
    tri = np.flatnonzero(size == 3)
    quad = np.flatnonzero(size == 4)
    table = [corners[first[tri][:, None] + np.arange(3)], *_halves(points, first[quad], corners)]
    face = [tri, quad, quad]
    for k in np.flatnonzero(size > 4).tolist():
        own = corners[first[k] : first[k] + size[k]]
        try:
            table.append(own[ears(in_plane(points[own]))])
        except ValueError as error:
            raise MeshError(f"face {k} cannot be divided into triangles: {error}") from None
        face.append(np.full(size[k] - 2, k))
    every = np.concatenate(face)
    order = np.argsort(every, kind="stable")
    return np.concatenate(table)[order], every[order]


def _halves(points: Array, first: Ints, corners: Ints) -> tuple[Ints, Ints]:
    """Divide quads along the shorter diagonal that lies inside."""
    quad = corners[first[:, None] + np.arange(4)]
    p = points[quad]
    area = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    turn = np.cross(np.roll(p, -1, axis=1) - p, np.roll(p, -2, axis=1) - p)
    # Of the triangles on both sides of diagonal 1-3 one is inverted where corner 0 or 2 is
    # concave, else those of diagonal 0-2 may be.
    concave = np.einsum("qkd,qd->qk", turn, area) <= 0
    length = np.linalg.norm(p[:, 2:] - p[:, :2], axis=2)
    # turn[k] belongs to corner k + 1.
    at_even = concave[:, 1] | concave[:, 3]
    at_odd = concave[:, 0] | concave[:, 2]
    shorter = length[:, 1] < (1.0 - 1e-9) * length[:, 0]
    odd = np.where(at_even == at_odd, shorter, at_odd)
    quad = np.where(odd[:, None], np.roll(quad, -1, axis=1), quad)
    return quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]


def _bent(points: Array, triangles: Ints, face: Ints) -> Ints:
    """Return the polygons whose triangles lie in different planes."""
    p = points[triangles]
    normal = area_vectors(points, triangles)
    count = int(face.max(initial=-1)) + 1
    total = np.stack([np.bincount(face, normal[:, d], count) for d in range(3)], axis=1)
    mean = unit(np.asarray(total, float))
    _, first = np.unique(face, return_index=True)
    start = np.zeros((count, 3))
    start[face[first]] = p[first, 0]
    away = np.abs(np.einsum("tkd,td->tk", p - start[face][:, None], mean[face])).max(axis=1)
    size = np.linalg.norm(p - start[face][:, None], axis=2).max(axis=1)
    return np.unique(face[away > _BENT * size])
