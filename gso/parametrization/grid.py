"""The rectangle from which a grid's flattening starts."""

from __future__ import annotations

import numpy as np

from gso.typing import Array


def rectangle(grid: Array) -> Array:
    """Compute Flatten-init (Wang et al. 2024): a regular rectangle with the mean side lengths.

    Parameters
    ----------
    grid : ndarray, (H, W, 3)

    Returns
    -------
    ndarray, (H, W, 2)
        Rows run along x, columns along y; vertex (0, 0) is at the origin. No cell is
        inverted.

    Examples
    --------
    >>> u, v = np.meshgrid(np.arange(3.0), np.arange(4.0), indexing="ij")
    >>> rectangle(np.stack([u, 2 * v, 0 * u], axis=-1))[-1, -1]
    array([2., 6.])
    """
    along = [np.linalg.norm(np.diff(grid, axis=k), axis=-1).sum(axis=k).mean() for k in (0, 1)]
    sides = (np.linspace(0.0, length, n) for length, n in zip(along, grid.shape[:2], strict=True))
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
