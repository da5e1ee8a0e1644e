"""The largest distance of all points of a surface from another, with a bound on its error."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.typing import Array, Flags, Ints

_N = TypeVar("_N", bound=NDArray[Any])

#: Largest errors of the distance: relative to it, and to the diagonal.
ERROR, _SLACK = 5e-4, 1e-6
#: Times that triangles are halved at most, and triangles in one round.
_ROUNDS, _MOST = 16, 100_000
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
    Over two triangles with a common edge it is bounded by the corners' heights over both planes.
    Triangles whose bound exceeds the largest distance so far are halved, across their longest edge.

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
        Where triangles were halved sixteen times, or are too many, it is the largest distance at
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
        foot[vertices], distance[vertices] = near.nearest(surface.vertices[vertices])

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
        keep[keep] = _may_exceed_pair(enough, points[keep], other, which[keep])
        keep[keep] = _may_exceed(enough, points[keep], far[keep], corner, which[keep])
        points, far, which = points[keep], far[keep], which[keep]
        if not 0 < len(points) <= _MOST:
            break
        # The longest edge first: of long triangles other parts would stay long.
        turn = (side[keep].argmax(axis=1)[:, None] + np.arange(3)) % 3
        own = np.arange(len(points))[:, None]
        points, far, which = points[own, turn], far[own, turn], which[own, turn]
        middle = 0.5 * (points[:, 0] + points[:, 1])
        at, away = near.nearest(middle)
        largest = max(largest, float(away.max()))
        points, far, which = _halves(points, middle), _halves(far, away), _halves(which, at)
    return largest


def _halves(corners: _N, middle: _N) -> _N:
    """Return the values at the corners of both halves of triangles, (2 k, 3, ...)."""
    out: _N = np.concatenate([corners, corners])  # type: ignore[assignment]
    out[: len(middle), 1] = out[len(middle) :, 0] = middle
    return out


def _may_exceed(bound: float, points: Array, far: Array, corner: Array, which: Ints) -> Flags:
    """Return whether distances within triangles (k, 3, 3) may exceed a bound.

    `which` are the triangles nearest to the corners, numbers of those with corners `corner`, and
    `far` their distances. Within the bound from all corners, one of them is for all points.
    """
    left = np.arange(len(points))
    for k in range(3):
        over = far[left, k] > bound
        for other in ((k + 1) % 3, (k + 2) % 3):
            rest = left[~over]
            over[~over] = _from_triangle(points[rest, other], corner[which[rest, k]]) > bound
        left = left[over]
    out = np.zeros(len(points), bool)
    out[left] = True
    return out


def _may_exceed_pair(bound: float, points: Array, other: Mesh, which: Ints) -> Flags:
    """Return whether distances within triangles (k, 3, 3) may exceed a bound, by pairs.

    `which` are the triangles of `other` nearest to the corners. Where these are two with a common
    edge, a point between the planes through their other edges, and between the ends of the common
    one, is over one of them, or the common edge is nearest to it. Its distance is then at most the
    larger one of its heights over both planes, over the cosine of half the angle between these.
    """
    out = np.ones(len(points), bool)
    first, last = which.min(axis=1), which.max(axis=1)
    two = np.flatnonzero(((which == first[:, None]) | (which == last[:, None])).all(axis=1))
    tables = [other.triangles[x[two]] for x in (first, last)]
    same = tables[0][:, :, None] == tables[1][:, None, :]
    joined = same.any(axis=2).sum(axis=1) == 2
    two, same = two[joined], same[joined]
    if not len(two):
        return out
    own = np.arange(len(two))
    at, opposite = (same.any(axis=k).argmin(axis=1) for k in (2, 1))
    table, beyond = (table[joined] for table in tables)
    ids = [table[own, (at + k) % 3] for k in (1, 2, 0)]
    a, b, c, d = other.vertices[np.stack([*ids, beyond[own, opposite]])]
    edge, x = b - a, points[two]
    normals = [unit(cross(edge, c - a)), unit(cross(d - a, edge))]
    height = [np.abs(_dots(x - a[:, None], n)).max(axis=1) for n in normals]
    cosine = np.einsum("kd,kd->k", *normals)
    share = _dots(x - a[:, None], edge)
    inside = (share >= 0) & (share <= np.einsum("kd,kd->k", edge, edge)[:, None])
    for tip, end, inner in ((c, a, b), (c, b, a), (d, a, b), (d, b, a)):
        # The side of the edge from the tip to one end of the common edge on which the other end is.
        way, off = unit(end - tip), inner - tip
        inward = off - np.einsum("kd,kd->k", off, way)[:, None] * way
        inside &= _dots(x - tip[:, None], inward) >= 0
    most = np.maximum(*height) / np.sqrt(np.maximum(0.5 * (1.0 + cosine), 1e-300))
    out[two[(cosine > 0) & inside.all(axis=1) & (most <= bound)]] = False
    return out


def _dots(vectors: Array, others: Array) -> Array:
    """Return the products of vectors (k, 3, 3) with one other each (k, 3), (k, 3)."""
    return np.asarray(np.einsum("kcd,kd->kc", vectors, others))


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
