"""Linear systems of strips: a symmetric matrix of vertex blocks, bordered by constraints.

The unknowns and the multipliers of the constraints are numbered so that the matrix is banded; it
is factored by LAPACK.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import get_lapack_funcs
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gso.ruled.strip_layout import Strips
from gso.typing import Array, Ints

#: Entry, relative to the largest, that keeps dependent constraints solvable.
_DEPENDENT = 1e-13


class System:
    """Banded storage for the matrices of one layout.

    Parameters
    ----------
    strips : Strips
        The layout: vertices of a face, and of a triple along or across, are coupled; each quad
        has one constraint.
    """

    def __init__(self, strips: Strips):
        self.strips = strips
        self.quads = strips.corners[strips.quads]
        self._n = n = strips.size
        self._order(n)
        number = self._start[:n, None] + np.arange(3)
        #: Numbers (n, 3) of the unknowns of the vertices, and (q,) of the multipliers.
        self.unknowns, self.multipliers = number, self._start[n:]
        self.size = 3 * n + len(self.quads)
        self.band = self._width()
        row, column = self.multipliers[:, None], number[self.quads].reshape(-1, 12)
        self._below, self._right = self._entries(row, column), self._entries(column, row)
        self._corner = self._entries(self.multipliers, self.multipliers)
        #: Places of the unknowns' diagonal entries, and the identity in band storage.
        self.diagonal = self._entries(number.ravel(), number.ravel())
        self.identity = np.zeros((3 * self.band + 1) * self.size)
        self.identity[self.diagonal] = 1.0

    def _order(self, n: int) -> None:
        """Number vertices and quads together by reverse Cuthill-McKee."""
        q = len(self.quads)
        cliques = [self.strips.corners, self.strips.along, self.strips.across]
        one, two, _ = self.strips.hinges
        corners = self.strips.corners
        cliques.append(np.concatenate([corners[one], corners[two]], axis=1))
        cliques.append(np.column_stack([self.quads, n + np.arange(q)]))
        pairs = np.concatenate(
            [
                np.stack(np.broadcast_arrays(c[:, :, None], c[:, None]), 3).reshape(-1, 2)
                for c in cliques
            ]
        )
        graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n + q, n + q)).tocsr()
        order = reverse_cuthill_mckee(graph, symmetric_mode=True)
        size = np.where(order < n, 3, 1)
        self._start: Ints = np.empty(n + q, np.int64)
        self._start[order] = np.cumsum(size) - size
        self._pairs = pairs

    def _width(self) -> int:
        first = self._start[self._pairs]
        size = np.where(self._pairs < self._n, 3, 1)
        low, high = first.min(axis=1), (first + size).max(axis=1) - 1
        return int((high - low).max())

    def _entries(self, rows: Ints, columns: Ints) -> Ints:
        """Return places in the flat band storage of entries by row and column."""
        row, column = np.broadcast_arrays(rows, columns)
        places: Ints = (2 * self.band + row - column) * self.size + column
        return places.reshape(-1)

    def blocks(self, corners: Ints) -> Ints:
        """Return the places of the blocks of groups (g, c) of vertices: (g * 3c * 3c,)."""
        ids = self.unknowns[corners].reshape(len(corners), 3 * corners.shape[1])
        return self._entries(ids[:, :, None], ids[:, None])

    def matrix(self, parts: list[tuple[Ints, Array]]) -> Array:
        """Return the band storage with the sum of blocks, as (places, values) each."""
        total = np.zeros((3 * self.band + 1) * self.size)
        for places, values in parts:
            total += np.bincount(places, values.ravel(), len(total))
        return total

    def constrained(self, matrix: Array, slopes: Array | None) -> Array:
        """Return the matrix (band storage) bordered by constraints with derivatives (q, 4, 3).

        Without derivatives the multipliers are decoupled.
        """
        out: Array = matrix.copy()
        if slopes is None:
            out[self._corner] = 1.0
            return out
        values = slopes.ravel()
        out[self._below] = out[self._right] = values
        out[self._corner] = -_DEPENDENT * max(float(np.abs(values).max(initial=0.0)), 1e-300)
        return out

    def solve(self, matrix: Array, right: Array) -> Array:
        """Solve for a right-hand side (size,)."""
        (gbsv,) = get_lapack_funcs(("gbsv",), (matrix, right))
        band = matrix.reshape(3 * self.band + 1, self.size)
        _, _, out, info = gbsv(self.band, self.band, band, right, overwrite_ab=False)
        return out if info == 0 else np.full(self.size, np.nan)
