"""Resampling of grids at other resolutions by cubic interpolation."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.typing import Array

#: Smallest number of vertices along a side of a coarser grid.
SMALLEST = 20


@lru_cache(maxsize=64)
def _matrix(source: int, target: int) -> Array:
    """Return the not-a-knot cubic spline interpolation matrix of `source` to `target` samples.

    It is that of ``scipy.interpolate.make_interp_spline``, which takes a fifth of a second to load.
    """
    x = np.linspace(0, source - 1, target)
    if source < 4:
        powers = np.vander(np.arange(source, dtype=float))
        return np.vander(x, source) @ np.linalg.inv(powers)
    # Second derivatives (bends) at the samples, from those of the values.
    rule, second = np.zeros((source, source)), np.zeros((source, source))
    inner = np.arange(1, source - 1)
    for step, bend, value in ((-1, 1.0, 6.0), (0, 4.0, -12.0), (1, 1.0, 6.0)):
        rule[inner, inner + step], second[inner, inner + step] = bend, value
    rule[0, :3] = rule[-1, -3:] = 1.0, -2.0, 1.0
    bends = np.linalg.solve(rule, second)
    below = np.minimum(x.astype(int), source - 2)
    t = (x - below)[:, None]
    own, unit = 1.0 - t, np.eye(source)
    matrix: Array = (
        own * unit[below]
        + t * unit[below + 1]
        + (own**3 - own) / 6.0 * bends[below]
        + (t**3 - t) / 6.0 * bends[below + 1]
    )
    return matrix


def resample(values: Array, height: int, width: int) -> Array:
    """Interpolate values (H, W, d) on a grid to (height, width, d).

    >>> resample(np.arange(16.0).reshape(4, 4, 1), 7, 4).shape
    (7, 4, 1)
    """
    h, w = values.shape[:2]
    along = (_matrix(h, height) @ values.reshape(h, -1)).reshape(height, w, -1)
    return np.asarray(np.matmul(_matrix(w, width), along))


def prolong_displacement(coarse: Mesh, fine: Mesh, points: Array) -> Array:
    """Move a finer grid by the interpolated displacement of a coarse one to points (m, 3)."""
    shift = (points - coarse.vertices)[coarse.grid_index]
    return fine.vertices + resample(shift, *fine.grid_shape).reshape(-1, 3)  # type: ignore[misc]


def coarser(mesh: Mesh, largest: int) -> list[Mesh]:
    """Resample a grid at a half, a quarter ... of its resolution, coarsest first.

    Sides are halved until the longer one has at most `largest` vertices: at least once, and
    never below :data:`SMALLEST`. The list is empty if no side is longer than `SMALLEST`. It
    ends early where a coarser grid would have faces without area.
    """
    shape, grid = mesh.grid_shape, mesh.grid
    levels: list[Mesh] = []
    while shape is not None and grid is not None:
        halved = tuple(max((side + 1) // 2, min(side, SMALLEST)) for side in shape)
        if halved == shape or (levels and max(shape) <= largest):
            break
        shape = (halved[0], halved[1])
        try:
            levels.append(Mesh.from_grid(resample(grid, *shape), weld=False))
        except MeshError:
            # A pattern finer than the coarse grid can leave it without area.
            break
    return levels[::-1]


def resample_like(levels: list[Mesh], mesh: Mesh) -> list[Mesh]:
    """Resample another surface with the same grid at the resolutions of coarser levels.

    >>> fine = Mesh.from_grid(np.dstack([*np.mgrid[:39.0, :39.0], np.zeros((39, 39))]))
    >>> [m.grid_shape for m in resample_like(coarser(fine, 32), fine)]
    [(20, 20)]
    """
    grid: Any = mesh.grid
    shapes: list[Any] = [level.grid_shape for level in levels]
    return [
        level.replaced(resample(grid, *shape).reshape(-1, 3))
        for level, shape in zip(levels, shapes, strict=True)
    ]
