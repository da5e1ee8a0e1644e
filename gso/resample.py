"""Grids at another resolution, by cubic interpolation."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gso.mesh import Mesh

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def _matrix(source: int, target: int) -> Array:
    """Not-a-knot cubic spline interpolation from `source` to `target` samples."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(np.linspace(0, 1, source), np.eye(source), k=min(3, source - 1))
    return spline(np.linspace(0, 1, target))


def resample(values: Array, height: int, width: int) -> Array:
    """Values (H, W, d) on a grid, interpolated to (height, width, d).

    >>> resample(np.arange(16.0).reshape(4, 4, 1), 7, 4).shape
    (7, 4, 1)
    """
    h, w = values.shape[:2]
    return np.einsum("ia,jb,abk->ijk", _matrix(h, height), _matrix(w, width), values, optimize=True)


def coarser(mesh: Mesh, largest: int) -> list[Mesh]:
    """Copies of a grid of half the resolution, a quarter ..., coarsest first.

    Sides longer than `largest` are halved until none is; empty for a grid that small.
    """
    shape = mesh.grid_shape
    grid = mesh.grid
    levels: list[Mesh] = []
    while shape is not None and grid is not None and max(shape) > largest:
        shape = (_half(shape[0], largest), _half(shape[1], largest))
        levels.append(Mesh.from_grid(resample(grid, *shape)))
    return levels[::-1]


def _half(side: int, largest: int) -> int:
    return side if side <= largest // 2 else (side + 1) // 2
