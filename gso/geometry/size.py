"""How large a set of points is: the lengths that percentages and unit balls refer to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def box_diagonal(points: Array) -> float:
    """Length of the diagonal of the bounding box of points (n, d)."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def ball(points: Array) -> tuple[Array, float]:
    """Centroid (d,) of points (n, d), and the largest distance of one from it."""
    centre = points.mean(axis=0)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))
