"""Which vertices of a coarser mesh stand for vertices of the design."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.mesh import Mesh
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Transfer:
    """A coarser copy of a design, with the vertex of the design that each of its vertices is.

    Attributes
    ----------
    fine, coarse : Mesh
        The design and its copy, in one frame.
    near : ndarray of int, (m,)
        Vertex of the design at each vertex of the copy, or the nearest one on resampled grids;
        each at most once.
    """

    fine: Mesh
    coarse: Mesh
    near: Ints

    @cached_property
    def _place(self) -> Ints:
        place = np.full(len(self.fine.vertices), -1)
        place[self.near] = np.arange(len(self.near))
        return place

    def place(self, ids: Ints) -> Ints:
        """Return the vertices of the copy at vertices of the design, of any shape; -1 if none."""
        return self._place[ids]

    @cached_property
    def shift(self) -> Array:
        """Difference (m, 3) of each vertex of the copy from its vertex of the design."""
        return self.coarse.vertices - self.fine.vertices[self.near]


def nearest_on_grid(fine: Mesh, coarse: Mesh, wanted: Ints) -> Ints:
    """Return the vertex (m,) of a grid that is nearest to each vertex of a resampled one.

    Where one of the vertices `wanted` is next to a vertex of the coarse grid, the nearest of
    these is returned: constraints on few vertices are not lost.

    >>> x, y = np.mgrid[:9.0, :9.0]
    >>> fine, coarse = (Mesh.from_grid(np.dstack([x, y, 0 * x])[::k, ::k]) for k in (1, 2))
    >>> nearest_on_grid(fine, coarse, np.array([0, 1, 13]))[[0, 1, 2, 6, 7]]
    array([ 0,  2, 13, 20, 22])
    """
    index, small = fine.grid_index, coarse.grid_index
    if index is None or small is None:
        raise ValueError("both meshes must be grids")
    # Parameters of the coarse vertices among the rows and columns of the fine grid.
    at = [np.arange(k) * (n - 1) / (k - 1) for k, n in zip(small.shape, index.shape, strict=True)]
    rows, columns = (np.rint(t).astype(np.int64) for t in at)
    near = np.empty(small.size, np.int64)
    near[small] = index[np.ix_(rows, columns)]
    if not len(wanted):
        return near
    row, column = np.empty(index.size, np.int64), np.empty(index.size, np.int64)
    row[index], column[index] = np.indices(index.shape)
    i, j = row[wanted], column[wanted]
    closest = [
        np.rint(x * (k - 1) / (n - 1)).astype(np.int64)
        for x, k, n in zip((i, j), small.shape, index.shape, strict=True)
    ]
    away = np.hypot(at[0][closest[0]] - i, at[1][closest[1]] - j)
    target = small[closest[0], closest[1]]
    order = np.lexsort([wanted, away, target])
    first = order[np.r_[True, target[order][1:] != target[order][:-1]]]
    near[target[first]] = wanted[first]
    return near
