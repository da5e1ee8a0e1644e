"""Closed polygons in the plane."""

from __future__ import annotations

import numpy as np

from gso.geometry.polygon import arc_lengths, points_at
from gso.typing import Array, Ints

#: Turning angles of sharp corners, and the largest for which offsets are lengthened.
_SHARP, _MITRE = 0.5, 2.0


def resampled(loop: Array, count: int) -> tuple[Array, Array]:
    """Return points along a closed polygon (k, 2), and outward offsets of distance one.

    The points are at equal distances, but the nearest ones are moved to the sharp corners. There
    the offset is longer, so that the offset polygon has corners too.
    """
    closed = np.vstack([loop, loop[:1]])
    along = arc_lengths(closed)
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    turn = turning(loop)
    for k in np.argsort(turn):
        if turn[k] > _SHARP:
            gap = np.abs(at - along[k])
            at[np.minimum(gap, along[-1] - gap).argmin()] = along[k]
    at = np.sort(at)
    points = points_at(at, along, closed)
    way = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    normals = np.stack([way[:, 1], -way[:, 0]], axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    mitre = 1.0 / np.cos(0.5 * np.clip(turning(points), 0.0, _MITRE))
    return points, normals * mitre[:, None]


def corners(loop: Array) -> Ints:
    """Return the numbers of the sharp corners of a polygon (n, 2)."""
    return np.flatnonzero(turning(loop) > _SHARP)


def turning(loop: Array) -> Array:
    """Return the angles (n,) by which a closed polygon (n, 2) turns left at its corners."""
    way = np.roll(loop, -1, axis=0) - loop
    back = np.roll(way, 1, axis=0)
    cross = back[:, 0] * way[:, 1] - back[:, 1] * way[:, 0]
    turns: Array = np.arctan2(cross, (back * way).sum(axis=1))
    return turns


def on(loop: Array, at: Array) -> Array:
    """Interpolate a closed polygon (n, 2) at numbers of its points, modulo n."""
    n = len(loop)
    return points_at(at, np.arange(n, dtype=float), loop, period=n)
