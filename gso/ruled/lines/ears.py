"""Triangles of nearly planar polygons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.geometry.vectors import cross, unit
from gso.typing import Array, Ints


def ears(rings: Sequence[Ints], points: Array) -> Ints:
    """Divide polygons into triangles (t, 3), polygon by polygon, by cutting off ears.

    Parameters
    ----------
    rings : sequence of ndarray of int
        Corners in order; a polygon with n corners has n - 2 triangles.
    points : ndarray, (n, 3)

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [0.4, 0.4, 0], [0, 2, 0]])
    >>> ears([np.arange(4)], corners).tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    found = [np.empty((0, 3), np.int64)]
    for ring in rings:
        if len(ring) == 3:
            found.append(ring[None])
            continue
        found.append(_divided(ring, points[ring]))
    return np.concatenate(found)


def _divided(ring: Ints, corner: Array) -> Ints:
    normal = unit(0.5 * cross(corner, np.roll(corner, -1, axis=0)).sum(axis=0))
    left = list(range(len(ring)))
    out = []
    while len(left) > 3:
        n = len(left)
        ids = np.array([[left[k - 1], left[k], left[(k + 1) % n]] for k in range(n)])
        a, b, c = corner[ids].transpose(1, 0, 2)
        areas = cross(b - a, c - b) @ normal
        sides = ((a - b) ** 2).sum(1) + ((b - c) ** 2).sum(1) + ((c - a) ** 2).sum(1)
        quality = areas / np.maximum(sides, 1e-300)
        for k in range(n):
            if areas[k] <= 0:
                continue
            others = corner[[i for i in left if i not in ids[k]]]
            inside = np.ones(len(others), bool)
            for p, q in ((a[k], b[k]), (b[k], c[k]), (c[k], a[k])):
                inside &= cross(np.broadcast_to(q - p, others.shape), others - p) @ normal > 0
            if inside.any():
                quality[k] = -1.0
        k = int(quality.argmax())
        out.append(ids[k])
        left.pop(k)
    out.append(np.array(left))
    return np.asarray(ring[np.array(out)])
