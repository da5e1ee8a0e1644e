"""The distinct entries of a matrix that element matrices add to, and the rank of each product."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gso.errors import MeshError
from gso.typing import Flags, Ints

Int32 = NDArray[np.int32]

#: Largest table, columns times diagonals, for which no entries are sorted: at all, and over the
#: number of entries.
_LARGEST_TABLE, _CELLS = 100_000_000, 2
#: Elements per block: the pairs of a block stay in the processor's cache.
_BLOCK = 8192


class Pairs:
    """Lower and higher unknown of each entry of a group of element matrices.

    Parameters
    ----------
    columns : ndarray of int, (q, e)
        The unknowns of the elements; `size` where there is none.
    size : int
        Number of unknowns n. Entries with a missing unknown are (n, n).
    pairs : (ndarray, ndarray) of int, (m,), optional
        Which unknowns of an element each entry is of; all pairs a <= b when not given.
    """

    def __init__(self, columns: Ints, size: int, pairs: tuple[Ints, Ints] | None = None):
        self._columns, self._size = columns, size
        self._pairs = np.triu_indices(len(columns)) if pairs is None else pairs
        self.shape = columns.shape[1], len(self._pairs[0])

    def blocks(self) -> Iterator[tuple[slice, Int32, Int32]]:
        """Yield some elements, and the lower and higher unknowns (m, b) of their entries."""
        n = self._size
        for start in range(0, self.shape[0], _BLOCK):
            at = slice(start, start + _BLOCK)
            own = self._columns[:, at]
            one, two = (own[k] for k in self._pairs)
            high = np.maximum(one, two).astype(np.int32)
            low = np.minimum(one, two).astype(np.int32)
            low[high == n] = n
            yield at, low, high


def rank(groups: list[Pairs], size: int) -> tuple[list[Int32], Ints, Ints]:
    """Rank the entries of groups among the distinct ones, sorted by lower, then higher unknown.

    Parameters
    ----------
    groups : list of Pairs
    size : int
        Number of unknowns n.

    Returns
    -------
    places : list of ndarray of int, (e, m)
        The rank of each entry; for entries with a missing unknown the number of distinct ones.
    low, high : ndarray of int
        The distinct entries without missing unknowns.
    """
    used = np.zeros(size + 1, bool)
    for group in groups:
        for _, low, high in group.blocks():
            used[high - low] = True
    total = sum(e * m for e, m in (group.shape for group in groups))
    if size * int(used.sum()) > min(_LARGEST_TABLE, _CELLS * total):
        return _by_sorting(groups, size)
    return _by_table(groups, size, used)


def _by_table(groups: list[Pairs], size: int, used: Flags) -> tuple[list[Int32], Ints, Ints]:
    """Mark the entries in a table of all columns and all diagonals that are used."""
    count, slot = int(used.sum()), (np.cumsum(used) - 1).astype(np.int32)
    mark = np.zeros((size + 1) * count, bool)
    for group in groups:
        for _, low, high in group.blocks():
            mark[low * np.int32(count) + slot[high - low]] = True
    found = np.flatnonzero(mark[: size * count])
    rank = np.cumsum(mark, dtype=np.int32)
    rank -= 1
    rank[size * count :] = len(found)
    places: list[Int32] = [np.empty(group.shape, np.int32) for group in groups]
    for own, group in zip(places, groups, strict=True):
        for at, low, high in group.blocks():
            own[at] = rank[low * np.int32(count) + slot[high - low]].T
    column, which = np.divmod(found, count)
    return places, column, column + np.flatnonzero(used)[which]


def _by_sorting(groups: list[Pairs], size: int) -> tuple[list[Int32], Ints, Ints]:
    """Sort the entries by counting: first by the higher unknown, then by the lower one."""
    total = sum(e * m for e, m in (group.shape for group in groups))
    if total >= 2**31:
        raise MeshError(
            f"the matrices of the elements have {total:.2g} entries, more than 2e9: the mesh is "
            "too large; decimate it, or cut it into pieces"
        )
    low, high = np.empty(total, np.int32), np.empty(total, np.int32)
    start = 0
    places: list[Int32] = []
    rank = np.empty(total, np.int32)
    for group in groups:
        e, m = group.shape
        stop = start + e * m
        lows, highs = low[start:stop].reshape(e, m), high[start:stop].reshape(e, m)
        for at, one, two in group.blocks():
            lows[at], highs[at] = one.T, two.T
        places.append(rank[start:stop].reshape(e, m))
        start = stop
    order = _order(high, size + 1)
    order = order[_order(low[order], size + 1)]
    low, high = low[order], high[order]
    new = np.ones(total, bool)
    new[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    rank[order] = np.cumsum(new, dtype=np.int32) - 1
    new &= low < size
    return places, low[new].astype(np.int64), high[new].astype(np.int64)


def _order(keys: Int32, count: int) -> Int32:
    """Return the stable order of whole numbers below `count`, by counting."""
    from scipy.sparse import csr_matrix

    every = np.arange(len(keys), dtype=np.int32)
    order: Int32 = csr_matrix((np.ones(len(keys), bool), (keys, every)), (count, len(keys))).indices
    return order
