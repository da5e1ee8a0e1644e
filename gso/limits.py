"""How far a step may go: bounds that no iterate crosses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.terms import Limit
from gso.variables import Layout

Array = NDArray[np.float64]

#: Share of the way to a bound that a step may go.
SAFETY = 0.9


def ball(points: Array, radius: float, layout: Layout) -> Limit:
    """Keep every vertex of the block "surface" within `radius` of its reference point.

    A step goes at most :data:`SAFETY` of the way to the bound.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Reference points.
    radius : float
        Largest displacement.
    layout : Layout
        The coordinates.
    """
    start, count, dim = layout.where("surface")
    part = slice(start, start + count * dim)

    def limit(coordinates: Array, direction: Array) -> float:
        u = coordinates[part].reshape(count, dim) - points
        d = direction[part].reshape(count, dim)
        a = (d * d).sum(axis=1)
        b = (u * d).sum(axis=1)
        c = (u * u).sum(axis=1) - radius**2
        moving = a > 0
        if not moving.any():
            return 1.0
        a, b, c = a[moving], b[moving], np.minimum(c[moving], 0.0)
        root = (-b + np.sqrt(b * b - a * c)) / a
        return float(min(1.0, SAFETY * root.min()))

    return limit
