"""Factorisation of single sparse symmetric positive definite matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scipy.sparse import sparray, spmatrix

    from gso.typing import Solve


def spd(matrix: sparray | spmatrix) -> Solve:
    """Factor a sparse symmetric positive definite matrix (n, n), and return its solver.

    The solver takes a right-hand side (n,) or several (n, k). Matrices that are factored again
    and again with the same pattern have their own solvers, see :func:`gso.linalg.choose`.

    >>> import numpy as np
    >>> from scipy.sparse import diags
    >>> spd(diags([2.0, 4.0]))(np.array([2.0, 2.0]))
    array([1. , 0.5])
    """
    from scipy.sparse.linalg import splu

    factor = splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    solve: Solve = factor.solve
    return solve
