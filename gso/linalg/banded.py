"""LAPACK's banded Cholesky: pure SciPy, the fastest of it on grids of moderate width."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from gso.linalg.base import Pattern, SingularError
from gso.typing import Array

PACKAGE = "scipy"


def available() -> bool:
    """SciPy is always there."""
    return True


def cost(pattern: Pattern) -> float:
    """Size times bandwidth squared, at the speed seen; worthless when memory explodes."""
    band = pattern.bandwidth
    entries = pattern.size * (band + 1)
    if entries > 3e8:
        return np.inf
    # Bands beyond the processor's cache are slower.
    slower = 1.3 if entries > 1e6 else 1.0
    return 2e-4 + slower * pattern.size * (band + 16.0) ** 2 / 3.6e10


class Solver:
    """Banded Cholesky factorisation in the given order of unknowns."""

    name = "banded"

    def __init__(self, pattern: Pattern):
        self._shape = (pattern.bandwidth + 1, pattern.size)
        # Fortran order: column j of the band holds the lower column j of the matrix.
        self._at = pattern.columns * self._shape[0] + (pattern.indices - pattern.columns)
        self._factor = None

    def factor(self, values: Array) -> None:
        """Factor the matrix with these values of the lower triangle."""
        band = np.zeros(self._shape[0] * self._shape[1])
        band[self._at] = values
        self._factor, info = dpbtrf(band.reshape(self._shape, order="F"), lower=1, overwrite_ab=1)
        if info != 0:
            raise SingularError(f"leading minor {info} is not positive")

    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""
        return np.asarray(dpbtrs(self._factor, rhs, lower=1)[0])
