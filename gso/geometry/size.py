"""Sizes of point sets: the reference lengths of percentages and of unit balls."""

from __future__ import annotations

import numpy as np

from gso.typing import Array


def box_diagonal(points: Array) -> float:
    """Return the length of the diagonal of the bounding box of points (n, d)."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def ball(points: Array) -> tuple[Array, float]:
    """Return the centroid (d,) of points (n, d), and the largest distance from it."""
    centre = points.mean(axis=0)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))
