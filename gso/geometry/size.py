"""Sizes of point sets: the reference lengths of percentages and of unit balls."""

from __future__ import annotations

import numpy as np

from gso.geometry.vector import norm
from gso.typing import Array, B, Vec


def box_diagonal(points: Array) -> float:
    """Return the length of the diagonal of the bounding box of points (n, d)."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def ball(points: Array) -> tuple[Array, float]:
    """Return the centroid (d,) of points (n, d), and the largest distance from it."""
    centre = points.mean(axis=0)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))


def side_lengths(grid: Vec[B]) -> tuple[B, B]:
    """Return the mean lengths of a grid's polylines along both directions.

    Parameters
    ----------
    grid : tuple
        Components, each (..., H, W); arrays or tensors.

    Returns
    -------
    tuple of 2
        Each of shape (...): along the first and along the second direction.

    Examples
    --------
    >>> x, y = np.mgrid[:3, :4]
    >>> side_lengths((x, 2 * y))
    (np.float64(2.0), np.float64(6.0))
    """
    along = norm(tuple(c[..., 1:, :] - c[..., :-1, :] for c in grid)).sum(-2)
    across = norm(tuple(c[..., 1:] - c[..., :-1] for c in grid)).sum(-1)
    return along.mean(-1), across.mean(-1)


def unit_rectangle(height: int, width: int) -> Array:
    """Return a regular grid of the unit square, (height, width, 2): rows along x.

    Multiplied by :func:`side_lengths` it is Flatten-init (Wang et al. 2024).
    """
    sides = (np.linspace(0.0, 1.0, n) for n in (height, width))
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
