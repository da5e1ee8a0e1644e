"""Noisy grids of any size at the size of the nets, and back.

Noise has no spline between its samples: a grid with many vertices is averaged, and one with few is
continued beyond its border, so that what a net sees is noise from vertex to vertex again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.fit import interpolated
from gso.net.base import SIZE
from gso.resample import resample

Array = NDArray[np.float64]

#: Smallest side that is worth continuing so far.
SMALLEST = 16
#: Vertices along a side from which on it is averaged; with fewer to each coefficient the
#: least-squares spline would follow the noise.
_MANY = 2 * SIZE


def seen(grid: Array) -> Array:
    """A grid (H, W, 3) as (SIZE, SIZE, 3).

    Sides are first continued to SIZE or twice as many vertices, by reflection at the vertices of
    the border; what has more becomes its least-squares spline with SIZE x SIZE coefficients.
    """
    pads = [_margins(n) for n in grid.shape[:2]]
    grid = np.pad(grid, [*pads, (0, 0)], mode="reflect", reflect_type="odd")
    if grid.shape[:2] == (SIZE, SIZE):
        return grid
    return interpolated(grid, (SIZE, SIZE)).sample(SIZE, SIZE)


def back(done: Array, height: int, width: int) -> Array:
    """What became of :func:`seen`, on the grid's own (height, width, 3) vertices."""
    (top, below), (left, right) = _margins(height), _margins(width)
    whole = resample(done, top + height + below, left + width + right)
    return whole[top : top + height, left : left + width]


def share(height: int, width: int) -> float:
    """Share of the noise's standard deviation that :func:`seen` leaves."""
    return float(np.sqrt(np.prod([SIZE / (n + sum(_margins(n))) for n in (height, width)])))


def sigma(grid: Array, seen: Array) -> float:
    """Standard deviation of the noise of what a net sees of a grid, estimated from both."""
    from gso.smoothing import estimate_sigma, smooth_grid

    height, width = grid.shape[:2]
    found = share(height, width) * estimate_sigma(grid)
    if max(height, width) <= SIZE:
        return found
    # Averages have what neighbours have in common, too, which their differences do not show.
    return max(found, smooth_grid(seen).sigma)


def _margins(count: int) -> tuple[int, int]:
    """Vertices that are added before and behind a side."""
    more = max((SIZE if count <= SIZE else _MANY) - count, 0)
    return more // 2, more - more // 2
