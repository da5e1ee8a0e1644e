"""SuperLU in symmetric mode: pure SciPy, for any pattern."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from gso.linalg.base import Pattern, SingularError
from gso.linalg.spd import spd
from gso.typing import Array, Solve

PACKAGE = "scipy"


def available() -> bool:
    """SciPy is always there."""
    return True


def cost(pattern: Pattern) -> float:
    """As measured on grids: grows with the entries a column has and a bit over linearly."""
    density = pattern.nnz / max(pattern.size, 1)
    return float(4e-8 * pattern.size**1.25 * density)


class Solver:
    """LU factors of the full matrix under a symmetric minimum-degree order."""

    name = "superlu"

    def __init__(self, pattern: Pattern):
        n, nnz = pattern.size, pattern.nnz
        i, j = pattern.indices, pattern.columns
        off = i != j
        entry = np.r_[np.arange(nnz), np.flatnonzero(off)] + 1
        full = csc_matrix((entry, (np.r_[i, j[off]], np.r_[j, i[off]])), shape=(n, n))
        full.sort_indices()
        self._entry = full.data - 1
        self._matrix = csc_matrix((full.data.astype(float), full.indices, full.indptr), (n, n))
        self._solve: Solve

    def factor(self, values: Array) -> None:
        """Factor the matrix with these values of the lower triangle."""
        self._matrix.data[:] = values[self._entry]
        try:
            self._solve = spd(self._matrix)
        except RuntimeError as error:
            raise SingularError(str(error)) from None

    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        return self._solve(rhs)
