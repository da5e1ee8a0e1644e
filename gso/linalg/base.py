"""The pattern of a symmetric matrix, and what backends share."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gso.typing import Array, Ints

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


class SingularError(ArithmeticError):
    """The matrix is not positive definite to working precision."""


@dataclass(frozen=True)
class Pattern:
    """Lower triangle of a symmetric matrix, compressed by columns, rows sorted.

    Attributes
    ----------
    size : int
        Number of unknowns.
    indptr, indices : ndarray
        CSC arrays; the first entry of every column is its diagonal.
    """

    size: int
    indptr: Ints
    indices: Ints

    @property
    def nnz(self) -> int:
        """Entries of the lower triangle."""
        return len(self.indices)

    @cached_property
    def columns(self) -> Ints:
        """Column of every entry."""
        return np.repeat(np.arange(self.size), np.diff(self.indptr))

    @cached_property
    def bandwidth(self) -> int:
        """Largest distance of an entry from the diagonal, in the given order."""
        if not self.nnz:
            return 0
        # The last entry of a column is the farthest from the diagonal.
        last = self.indices[self.indptr[1:] - 1]
        return int((last - np.arange(self.size)).max())


class Solver(Protocol):
    """Factorisation of matrices of one pattern by a backend."""

    name: str

    def factor(self, values: Array) -> None:
        """Factor the matrix with these values of the lower triangle."""

    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side (n,) or several (n, k)."""


@lru_cache(maxsize=1)
def _controller() -> ThreadpoolController:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def blas_threads(count: int) -> AbstractContextManager[object]:
    """Limit the BLAS to so many threads; 0 leaves it alone.

    Two on a busy machine of two cores make factorisations slower than one.
    """
    return _controller().limit(limits=count, user_api="blas") if count else nullcontext()
