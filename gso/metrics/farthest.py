"""The largest distance between corresponding grids, exactly, by few closest-point queries."""

from __future__ import annotations

import numpy as np

from gso.mesh.closest_point import Nearest
from gso.mesh.topology import grid_faces
from gso.typing import Array, Ints

#: Spacing of the points that are tried first.
_STRIDE = 8
#: Side of the blocks of cells that have a bounding box.
_BLOCK = 8
#: Steps of a point towards its closest one.
_STEPS = 2
#: Largest number of queries before one for all points that are left.
_QUERIES = 24
#: Relative size of rounding errors of distances.
_ROUND = 1e-12


def farthest(points: Array, grid: Array, known: float = 0.0) -> float:
    """Return the largest distance of points (H, W, 3) from the triangulated surface of a grid.

    The points should be near the vertices of the grid (H, W, 3), in the same order. The distance
    of a point to any place on the surface is a bound on its distance from it. So closest points
    are only asked for where that bound is above the largest distance that is known.

    Parameters
    ----------
    points, grid : ndarray, (H, W, 3)
    known : float
        A distance that is returned if no point is farther.

    Examples
    --------
    >>> sheet = np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))])
    >>> farthest(sheet + [0.0, 0.0, 0.5], sheet)
    0.5
    """
    search = _Search(points.reshape(-1, 3), grid, known)
    first = np.zeros(grid.shape[:2], bool)
    first[::_STRIDE, ::_STRIDE] = True
    # A few points give a distance that is almost the largest.
    search.run(np.flatnonzero(first))
    search.run(np.arange(first.size))
    return search.known


class _Search:
    """Bounds on the distances of points (n, 3) from a grid, and the largest distance known."""

    def __init__(self, points: Array, grid: Array, known: float):
        self.points, self.vertices = points, grid.reshape(-1, 3)
        self.rows, self.columns = grid.shape[:2]
        self.bound = _length(points - self.vertices)
        self.known, self.queries = known, 0
        self.cells = grid_faces(self.rows, self.columns).reshape(self.rows - 1, -1, 4)
        self.low, self.high = _boxes(grid, np.minimum), _boxes(grid, np.maximum)

    def run(self, ids: Ints) -> None:
        """Raise the largest distance known to that of some points."""
        ids = self._above(ids)
        at = ids
        for _ in range(_STEPS):
            at = self._step(ids, at)
            kept = self.bound[ids] > self.known
            ids, at = ids[kept], at[kept]
        while len(ids := self._above(ids)):
            self.queries += 1
            some = ids if self.queries > _QUERIES else ids[[self.bound[ids].argmax()]]
            self.bound[some] = self._distances(some)
            self.known = max(self.known, float(self.bound[some].max()))

    def _above(self, ids: Ints) -> Ints:
        return ids[self.bound[ids] > self.known * (1.0 + _ROUND)]

    def _step(self, ids: Ints, at: Ints) -> Ints:
        """Bound distances by the feet on the tangent planes at some vertices; return the next."""
        last = np.array([self.rows, self.columns])[:, None] - 1
        here = np.stack(np.divmod(at, self.columns))
        i, j = np.clip(here, 1, last - 1)
        own = i * self.columns + j
        x = self.vertices
        along = 0.5 * (x[own + self.columns] - x[own - self.columns])
        across = 0.5 * (x[own + 1] - x[own - 1])
        away = self.points[ids] - x[own]
        aa, ab, bb, ra, rb = (
            np.einsum("kd,kd->k", p, q)
            for p, q in (
                (along, along),
                (along, across),
                (across, across),
                (away, along),
                (away, across),
            )
        )
        scale = np.maximum(aa * bb - ab * ab, 1e-12 * aa * bb + 1e-300)
        foot = np.stack([i + (ra * bb - rb * ab) / scale, j + (rb * aa - ra * ab) / scale])
        foot = np.clip(foot, 0, last)
        cell = np.minimum(foot.astype(np.int64), last - 1)
        s, t = foot - cell
        # Each cell is split along its diagonal from (0, 0) to (1, 1).
        first = cell[0] * self.columns + cell[1]
        corner = first + np.where(s > t, self.columns, 1)
        low, high = np.minimum(s, t)[:, None], np.maximum(s, t)[:, None]
        a, b, c = x[first], x[corner], x[first + self.columns + 1]
        place = a + high * (b - a) + low * (c - b)
        self.bound[ids] = np.minimum(self.bound[ids], _length(self.points[ids] - place))
        row, column = np.rint(foot).astype(np.int64)
        return np.asarray(row * self.columns + column)

    def _distances(self, ids: Ints) -> Array:
        """Return the exact distances of some points."""
        p, most = self.points[ids], self.bound[ids].max()
        gap = np.maximum(self.low - p.max(axis=0), p.min(axis=0) - self.high).clip(0.0)
        near = np.argwhere(_length(gap) <= most * (1.0 + _ROUND))
        cells = np.concatenate(
            [self.cells[i : i + _BLOCK, j : j + _BLOCK].reshape(-1, 4) for i, j in near * _BLOCK]
        )
        triangles = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
        return Nearest.of(self.vertices, triangles).distances(p)


def _boxes(grid: Array, extreme: np.ufunc) -> Array:
    """Return the smallest or largest coordinates of blocks of cells, with their last vertices."""
    for axis in (0, 1):
        last = grid.shape[axis] - 1
        starts = np.arange(0, last, _BLOCK)
        ends = grid.take(np.minimum(starts + _BLOCK, last), axis=axis)
        grid = extreme(extreme.reduceat(grid, starts, axis=axis), ends)
    return grid


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("...d,...d->...", vectors, vectors)))
