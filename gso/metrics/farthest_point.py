"""The largest distance of all points of a surface from another, with a bound on its error."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gso.geometry.vectors import cross, lengths
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.typing import Array, Ints

_N = TypeVar("_N", bound=NDArray[Any])

#: Largest errors of the distance: relative to it, and to the diagonal.
ERROR, _SLACK = 5e-4, 1e-6
#: Times that triangles are halved at most, and triangles in one round.
_ROUNDS, _MOST = 8, 100_000
#: One vertex in so many, those that moved most, is asked for before all others.
_FIRST = 50


def farthest(
    surface: Mesh,
    other: Mesh,
    known: float = 0.0,
    vertices: tuple[Ints, Array] | None = None,
) -> float:
    """Return the largest distance of the points of a surface from another, in its unit.

    All points of the triangles count, not only the vertices. The distance from one triangle of
    `other` is convex, so it is largest at a corner: this bounds the distance within a triangle.
    Triangles whose bound exceeds the largest distance so far are halved along all edges.

    Parameters
    ----------
    surface, other : Mesh
    known : float
        A distance that is reached elsewhere; the result is at least that.
    vertices : (ndarray of int (n,), ndarray (n,)), optional
        Of each vertex of the surface, the triangle of `other` nearest to it and the distance, where
        they are known.

    Returns
    -------
    float
        At most 0.05 % and 1e-6 of the diagonal below the largest distance, and never above it.
        Where triangles were halved eight times, or are too many, it is the largest distance at
        their corners and middles.

    Examples
    --------
    >>> from gso.mesh import Mesh
    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> ridge = grid.copy(); ridge[1, :, 2] = 0.5
    >>> coarse = Mesh(grid[[0, 0, 2, 2], [0, 2, 2, 0]], [[0, 1, 2, 3]])
    >>> farthest(coarse, Mesh.from_grid(ridge)) > 0.4
    True
    """
    near = Nearest(other)
    corner, tri = other.vertices[other.triangles], surface.triangles
    distance, foot = np.zeros(len(surface.vertices)), np.zeros(len(surface.vertices), np.int64)
    largest, asked = known, surface.used.copy()
    if vertices is not None:
        foot, distance = vertices
        asked[:] = False

    def ask(vertices: Ints) -> None:
        foot[vertices], _, place = near.locate(surface.vertices[vertices])
        distance[vertices] = np.linalg.norm(place - surface.vertices[vertices], axis=1)

    if vertices is None and np.array_equal(tri, other.triangles):
        # A point is at most as far as that with the same shares of the same triangle.
        moved = np.linalg.norm(surface.vertices - other.vertices, axis=1)
        order = np.flatnonzero(asked)[np.argsort(-moved[asked])]
        ask(order[: 1 + len(order) // _FIRST])
        largest = max(largest, float(distance.max()))
        tri = tri[moved[tri].max(axis=1) > (1.0 + ERROR) * largest]
        asked = np.zeros(len(asked), bool)
        asked[tri] = True
    ask(np.flatnonzero(asked))
    largest = max(largest, float(distance.max()))
    points, far, which = surface.vertices[tri], distance[tri], foot[tri]
    slack = _SLACK * surface.diagonal
    for _ in range(_ROUNDS):
        side = np.linalg.norm(points - np.roll(points, -1, axis=1), axis=2)
        enough = (1.0 + ERROR) * largest + slack
        keep = far.max(axis=1) + side.max(axis=1) / np.sqrt(3.0) > enough
        # With one nearest triangle for all three corners, the bound is the largest distance there.
        keep &= (which != np.roll(which, 1, axis=1)).any(axis=1)
        points, far, which = points[keep], far[keep], which[keep]
        upper = _upper(points, corner, which)
        keep = upper > enough
        points, far, which = points[keep], far[keep], which[keep]
        if not 0 < len(points) <= _MOST:
            break
        middle = 0.5 * (points + np.roll(points, -1, axis=1))
        at, _, place = near.locate(middle.reshape(-1, 3))
        at, place = at.reshape(-1, 3), place.reshape(-1, 3, 3)
        away = np.linalg.norm(place - middle, axis=2)
        largest = max(largest, float(away.max()))
        points, far = _quarters(points, middle), _quarters(far, away)
        which = _quarters(which, at)
    return largest


def _quarters(corners: _N, middles: _N) -> _N:
    """Return the values at the corners of the four parts of triangles, (4 k, 3, ...)."""
    a, b, c = (corners[:, k] for k in range(3))
    p, q, r = (middles[:, k] for k in range(3))
    parts = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    out: _N = np.concatenate([np.stack(part, axis=1) for part in parts])  # type: ignore[assignment]
    return out


def _upper(points: Array, corner: Array, which: Ints) -> Array:
    """Return bounds (k,) on the distance within triangles (k, 3, 3).

    `which` are the triangles nearest to the corners, numbers of those with corners `corner`.
    """
    bound = np.full(len(points), np.inf)
    for k in range(3):
        target = corner[which[:, k]]
        away = np.stack([_from_triangle(points[:, i], target) for i in range(3)])
        bound = np.minimum(bound, away.max(axis=0))
    return bound


def _from_triangle(points: Array, triangles: Array) -> Array:
    """Return the distances (k,) of points (k, 3) from one triangle each (k, 3, 3)."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = cross(b - a, c - a)
    size = np.maximum(lengths(normal), 1e-300)
    inside = np.ones(len(points), bool)
    beside = np.full(len(points), np.inf)
    for one, two in ((a, b), (b, c), (c, a)):
        way, off = two - one, points - one
        inside &= np.einsum("kd,kd->k", cross(way, off), normal) >= 0
        long = np.maximum(np.einsum("kd,kd->k", way, way), 1e-300)
        share = np.clip(np.einsum("kd,kd->k", off, way) / long, 0.0, 1.0)
        beside = np.minimum(beside, lengths(off - share[:, None] * way))
    height = np.abs(np.einsum("kd,kd->k", points - a, normal)) / size
    return np.where(inside & (size > 1e-300), np.minimum(height, beside), beside)
