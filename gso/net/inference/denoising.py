"""Conversion of noisy grids of any size to the size of the nets, and back.

Interpolation would correlate the noise of neighbours. Large grids are therefore averaged and
small ones are extended beyond their border, so that the net's input again has noise that
varies from vertex to vertex.
"""

from __future__ import annotations

import numpy as np

from gso.hierarchy import resample
from gso.net.catalogue import SIZE
from gso.smoothing import estimate_sigma, smooth_grid
from gso.spline.fit import interpolated
from gso.typing import Array

#: Smallest side that is extended to the size of the nets.
SMALLEST = 16
#: Sides between SIZE and this number of vertices are extended to it: with fewer than two
#: vertices per coefficient the least-squares spline would fit the noise.
_MANY = 2 * SIZE


def seen(grid: Array) -> Array:
    """Convert a grid (H, W, 3) to the net's input (SIZE, SIZE, 3).

    Shorter sides are first extended to SIZE or 2 SIZE vertices, by point reflection at the
    border vertices. A grid larger than SIZE x SIZE is then replaced by its least-squares
    spline with SIZE x SIZE coefficients.
    """
    pads = [_margins(n) for n in grid.shape[:2]]
    grid = np.pad(grid, [*pads, (0, 0)], mode="reflect", reflect_type="odd")
    if grid.shape[:2] == (SIZE, SIZE):
        return grid
    return interpolated(grid, (SIZE, SIZE)).sample(SIZE, SIZE)


def back(done: Array, height: int, width: int) -> Array:
    """Convert a net's result for :func:`seen` to the grid's own vertices (height, width, 3)."""
    (top, below), (left, right) = _margins(height), _margins(width)
    whole = resample(done, top + height + below, left + width + right)
    return whole[top : top + height, left : left + width]


def share(height: int, width: int) -> float:
    """Return the factor by which :func:`seen` scales the standard deviation of the noise."""
    return float(np.sqrt(np.prod([SIZE / (n + sum(_margins(n))) for n in (height, width)])))


def sigma(grid: Array, seen: Array) -> float:
    """Estimate the standard deviation of the noise in `seen`, the net's input for a grid."""
    height, width = grid.shape[:2]
    found = share(height, width) * estimate_sigma(grid)
    if max(height, width) <= SIZE:
        return found
    # Averaging also keeps noise that neighbours share, which differences do not measure.
    return max(found, smooth_grid(seen).sigma)


def _margins(count: int) -> tuple[int, int]:
    """Return the numbers of vertices added before and after a side."""
    more = max((SIZE if count <= SIZE else _MANY) - count, 0)
    return more // 2, more - more // 2
