"""The sum of the quadratic terms: ``|A x - b|^2 / 2`` with constant A and b."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso.solver.elements import Elements
from gso.typing import Array, Ints
from gso.unknowns import Variables

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

#: Elements per block: only the Jacobians of one block are held as dense arrays.
_BLOCK = 65536


class Quadratic:
    """Value and derivatives of the quadratic terms.

    Parameters
    ----------
    elements : sequence of Elements
    variables : Variables

    Attributes
    ----------
    a, b : csr_matrix (m, n), ndarray (m,)
    """

    def __init__(self, elements: Sequence[Elements], variables: Variables):
        from scipy.sparse import csr_matrix

        n = variables.size
        start = variables.points(np.zeros(n))
        parts: list[tuple[Array, Ints, Ints, Array]] = []
        self._slices: list[tuple[str, slice]] = []
        base = 0
        for element in elements:
            own = list(_blocks(element, start, n))
            stop = base + sum(len(rhs) for *_, rhs in own)
            self._slices.append((element.item.term.name, slice(base, stop)))
            parts, base = parts + own, stop
        data, columns, sizes, rhs = (
            np.concatenate([part[k] for part in parts]) if parts else np.zeros(0, kind)
            for k, kind in enumerate((float, np.int32, np.int32, float))
        )
        self.a = csr_matrix((data, columns, np.r_[0, np.cumsum(sizes)]), shape=(base, n))
        self.b = rhs
        self._at = self.a.T

    @cached_property
    def matrix(self) -> csc_matrix:
        """Lower triangle of ``A^T A``, CSC with sorted rows."""
        from scipy.sparse import csc_matrix

        # The product is symmetric: its rows are its columns.
        whole = self._at.tocsr() @ self.a
        whole.sort_indices()
        column = np.repeat(np.arange(whole.shape[0], dtype=np.int32), np.diff(whole.indptr))
        lower = whole.indices >= column
        start = np.r_[0, np.cumsum(np.bincount(column[lower], minlength=whole.shape[0]))]
        data, rows = whole.data[lower], whole.indices[lower]
        return csc_matrix((data, rows, start), shape=whole.shape)

    def _residual(self, x: Array) -> Array:
        residual: Array = self.a @ x - self.b
        return residual

    def energy(self, x: Array) -> float:
        """Return the value at unknowns x."""
        r = self._residual(x)
        return 0.5 * float(r @ r)

    def energy_and_gradient(self, x: Array) -> tuple[float, Array]:
        """Return value and gradient at unknowns x."""
        r = self._residual(x)
        return 0.5 * float(r @ r), self._at @ r

    def by_term(self, x: Array) -> dict[str, float]:
        """Return the value by the name of the term."""
        r = self._residual(x)
        out: dict[str, float] = {}
        for name, part in self._slices:
            out[name] = out.get(name, 0.0) + 0.5 * float(r[part] @ r[part])
        return out


def _blocks(element: Elements, start: Array, n: int) -> Iterator[tuple[Array, Ints, Ints, Array]]:
    """Yield entries, their columns, their number by row, and right-hand sides of some elements."""
    root = np.sqrt(element.item.weight * element.weights)
    for first in range(0, len(root), _BLOCK):
        at = slice(first, first + _BLOCK)
        residual, slope = element.linearise(start, at)
        by_row = (slope * root[at]).transpose(0, 2, 1)
        columns = np.broadcast_to(element.columns[:, at].T, by_row.shape)
        # Drop derivatives that are zero in all elements of the block. Dropping single zeros would
        # make the sparsity pattern depend on the surface.
        keep = (slope != 0).any(axis=2)[:, None] & (columns < n)
        sizes = sum(keep[..., k].astype(np.int32) for k in range(keep.shape[2])).ravel()
        rhs = -(residual * root[at]).ravel()
        yield by_row[keep], columns[keep].astype(np.int32), sizes, rhs
