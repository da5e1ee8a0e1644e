"""PARDISO of Intel's MKL through pypardiso."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import numpy as np
from scipy.sparse import csr_matrix

from gso.linalg.base import Pattern, SingularError
from gso.typing import Array

PACKAGE = "pypardiso"


@cache
def available() -> bool:
    """Whether pypardiso is installed."""
    return find_spec("pypardiso") is not None


def cost(pattern: Pattern) -> float:
    """As measured on grids, with the load of the MKL."""
    density = pattern.nnz / max(pattern.size, 1)
    return float(2e-3 + 1.1e-9 * pattern.size**1.4 * density**1.3)


class Solver:
    """Analysis once, numeric factorisation per call."""

    name = "pardiso"

    def __init__(self, pattern: Pattern):
        from pypardiso import PyPardisoSolver

        # Lower columns of a symmetric matrix are its upper rows.
        self._matrix = csr_matrix(
            (np.ones(pattern.nnz), pattern.indices, pattern.indptr),
            shape=(pattern.size, pattern.size),
        )
        self._solver = PyPardisoSolver(mtype=2)
        self._analysed = False

    def _call(self, phase: int, rhs: Array) -> Array:
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._solver.set_phase(phase)
        try:
            return np.asarray(self._solver._call_pardiso(self._matrix, rhs))
        except PyPardisoError as error:
            raise SingularError(str(error)) from None

    def factor(self, values: Array) -> None:
        """Factor the matrix with these values of the lower triangle."""
        self._matrix.data[:] = values
        self._call(22 if self._analysed else 12, np.zeros((self._matrix.shape[0], 1)))
        self._analysed = True

    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        b = np.asfortranarray(rhs if rhs.ndim == 2 else rhs[:, None])
        return self._call(33, b).reshape(rhs.shape)

    def __del__(self) -> None:
        if hasattr(self, "_solver"):
            self._solver.free_memory(everything=True)
