"""CHOLMOD through cvxopt: supernodal Cholesky under a fill-reducing order."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import numpy as np

from gso.linalg.base import Pattern, SingularError
from gso.typing import Array

PACKAGE = "cvxopt"


@cache
def available() -> bool:
    """Whether cvxopt is installed."""
    return find_spec("cvxopt") is not None


def cost(pattern: Pattern) -> float:
    """As measured on grids, with a share of the analysis."""
    density = pattern.nnz / max(pattern.size, 1)
    return float(2e-4 + 4e-9 * pattern.nnz + 7.6e-10 * pattern.size**1.4 * density**1.3)


class Solver:
    """Symbolic analysis once, numeric factorisation per call."""

    name = "cholmod"

    def __init__(self, pattern: Pattern):
        from cvxopt import cholmod, matrix, spmatrix

        self._matrix = spmatrix(
            1.0,
            matrix(pattern.indices.astype(np.int64)),
            matrix(np.repeat(np.arange(pattern.size), np.diff(pattern.indptr))),
            (pattern.size, pattern.size),
        )
        self._symbolic = cholmod.symbolic(self._matrix)

    def factor(self, values: Array) -> None:
        """Factor the matrix with these values of the lower triangle."""
        from cvxopt import cholmod, matrix

        self._matrix.V = matrix(values)
        try:
            cholmod.numeric(self._matrix, self._symbolic)
        except ArithmeticError as error:
            raise SingularError(str(error)) from None

    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        from cvxopt import cholmod, matrix

        b = matrix(np.asfortranarray(rhs if rhs.ndim == 2 else rhs[:, None]))
        cholmod.solve(self._symbolic, b)
        return np.array(b).reshape(rhs.shape)
