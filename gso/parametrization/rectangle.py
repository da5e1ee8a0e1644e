"""The rectangle from which a grid's flattening starts."""

from __future__ import annotations

import numpy as np

from gso import geometry
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
    sides = geometry.side_lengths(tuple(np.moveaxis(grid, -1, 0)))
    return np.asarray(geometry.unit_rectangle(*grid.shape[:2]) * np.array(sides))
