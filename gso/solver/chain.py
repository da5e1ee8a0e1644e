"""The chain rule: from derivatives by an element's coordinates to those by its unknowns."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso.typing import Array, Ints
from gso.unknowns import Variables

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_NO_INTS = np.empty(0, np.int64)
_ALL = slice(None)


class Same:
    """Every coordinate is a single unknown, or fixed."""

    #: How the compiled loops apply it, see :func:`gso.solver.loops.add_elements`.
    kind = 0

    @property
    def parts(self) -> tuple[Ints, Ints, Array]:
        """Begin of the parts of each coordinate, place of each part's unknown, and its factor."""
        return _NO_INTS, _NO_INTS, np.empty(0)

    def pull(self, slope: Array, at: slice = _ALL) -> Array:
        """Return the Jacobian by unknowns (r, q, e) of some elements from that by coordinates."""
        return slope


class ByPoint(Same):
    """Every point moves with one unknown, as along a normal.

    Parameters
    ----------
    share : ndarray, (n,)
        Derivative of each coordinate by its unknown; 0 where it is fixed.
    gather : ndarray of int, (points * dim, e)
        The coordinates of each element.
    dim : int
    """

    kind = 1

    def __init__(self, share: Array, gather: Ints, dim: int):
        self._share, self._gather, self._dim = share, gather, dim

    @property
    def parts(self) -> tuple[Ints, Ints, Array]:
        return _NO_INTS, _NO_INTS, self._share

    def pull(self, slope: Array, at: slice = _ALL) -> Array:
        gather = self._gather[:, at]
        product = slope * self._share.take(gather)
        by_point = product.reshape(len(slope), -1, self._dim, gather.shape[1])
        out: Array = by_point[:, :, 0].copy()
        for d in range(1, self._dim):
            out += by_point[:, :, d]
        return out


class Sums(Same):
    """Coordinates are sums of several unknowns.

    Parameters
    ----------
    pull : sparse matrix, (q * e, k * e)
        Map from derivatives by coordinates to those by unknowns.
    count : int
        Number of elements e.
    """

    kind = 2

    def __init__(self, pull: csr_matrix, count: int):
        self._matrix, self._count = pull, count

    @cached_property
    def parts(self) -> tuple[Ints, Ints, Array]:
        by_coordinate, count = self._matrix.tocsc(), self._count
        size = np.diff(by_coordinate.indptr).reshape(-1, count).T
        begin = np.r_[0, np.cumsum(size)]
        order = np.repeat(by_coordinate.indptr[:-1].reshape(-1, count).T.ravel(), size.ravel())
        order = order + np.arange(begin[-1]) - np.repeat(begin[:-1], size.ravel())
        unknown = by_coordinate.indices[order] // count
        return begin, unknown.astype(np.int64), by_coordinate.data[order]

    def pull(self, slope: Array, at: slice = _ALL) -> Array:
        pull, count = self._matrix, slope.shape[2]
        if count < self._count:
            part = np.arange(self._count)[at]
            rows, columns = (
                (np.arange(size // self._count)[:, None] * self._count + part).ravel()
                for size in pull.shape
            )
            pull = pull[rows][:, columns]
        return np.stack([(pull @ s.ravel()).reshape(-1, count) for s in slope])


def chain_rule(gather: Ints, shape: tuple[int, ...], variables: Variables) -> tuple[Same, Ints]:
    """Return the chain rule of elements, and their unknowns (q, e), padded with `variables.size`.

    Parameters
    ----------
    gather : ndarray of int, (k, e)
        The coordinates of each element.
    shape : tuple of int
        The number of coordinates of each of its points.
    variables : Variables
        The unknowns.
    """
    if variables.basis is None:
        return Same(), gather
    if variables.single is not None:
        unknown, share = variables.single
        if (variables.basis.data == 1.0).all():
            return Same(), unknown[gather]
        columns = by_point(gather, shape, unknown, variables.size)
        if columns is not None:
            return ByPoint(share, gather, shape[0]), columns
    return _sums(gather, variables)


def by_point(gather: Ints, shape: tuple[int, ...], unknown: Ints, size: int) -> Ints | None:
    """Return the unknowns (q, e) of elements whose points move with one unknown each.

    None where points move otherwise, or where two points of an element share their unknown.

    Parameters
    ----------
    gather, shape
        As for :func:`chain_rule`.
    unknown : ndarray of int, (n,)
        Unknown of each coordinate, `size` if it is fixed.
    size : int
        Number of unknowns.
    """
    (k, count), dim = gather.shape, shape[0]
    if any(d != dim for d in shape):
        return None
    own = unknown.take(gather).reshape(k // dim, dim, count)
    columns = own[:, 0]
    for d in range(1, dim):
        columns = np.minimum(columns, own[:, d])
    fixed = own == size
    if not ((own == columns[:, None]) | fixed).all():
        return None
    for a in range(1, len(columns)):
        same = columns[:a] == columns[a]
        if same.any() and (same & ~fixed[:a].all(axis=1)).any():
            return None
    return columns


def _sums(gather: Ints, variables: Variables) -> tuple[Same, Ints]:
    from scipy.sparse import csr_matrix

    k, count = gather.shape
    part = variables.basis[gather.T.ravel()].tocoo()  # type: ignore[index]
    element = part.row // k
    key, at = np.unique(element * np.int64(variables.size) + part.col, return_inverse=True)
    owner, column = key // variables.size, key % variables.size
    start = np.searchsorted(owner, np.arange(count + 1))
    place = np.arange(len(key)) - start[owner]
    q = int(np.diff(start).max()) if len(key) else 1
    columns = np.full((q, count), variables.size)
    columns[place, owner] = column
    pull = csr_matrix(
        (part.data, (place[at] * count + element, (part.row % k) * count + element)),
        shape=(q * count, k * count),
    )
    return Sums(pull, count), columns
