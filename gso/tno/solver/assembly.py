"""The sparsity pattern of the Gauss-Newton matrix, and the places of elements in it."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gso.linalg.base import Pattern
from gso.typing import Array, Ints


def _repeated(columns: Ints) -> Ints:
    """Find pairs a < b of an element that are the same unknown, as ordered by :func:`products`.

    Such a pair contributes to the diagonal of the matrix twice.
    """
    a, b = np.triu_indices(columns.shape[0])
    apart = np.flatnonzero(a != b)
    same = columns[a[apart]] == columns[b[apart]]
    which, element = np.nonzero(same)
    return apart[which] * columns.shape[1] + element


@dataclass
class Places:
    """Where the matrices of one term's elements are in the whole matrix.

    Attributes
    ----------
    scatter : ndarray of int, (pairs * e,)
        The place of each entry, ordered as by :func:`products`.
    repeated : ndarray of int
        Which of these count twice.
    count : int
        Number of elements.
    """

    scatter: Ints
    repeated: Ints
    count: int

    @property
    def doubled(self) -> bool:
        """Whether any entry counts twice."""
        return bool(len(self.repeated))

    @cached_property
    def by_element(self) -> Ints:
        """The places (e, pairs), element by element."""
        return np.ascontiguousarray(self.scatter.reshape(-1, self.count).T)


@dataclass
class Assembly:
    """The pattern of the matrix, and the places in it of elements, constants, and diagonal."""

    pattern: Pattern
    places: list[Places]
    quadratic: Ints
    diagonal: Ints


_assemblies: OrderedDict[bytes, Assembly] = OrderedDict()


_ASSEMBLIES_KEPT = 24


_LARGEST_KEPT = 4_000_000


def assemble(n: int, columns: list[Ints], quadratic) -> Assembly:
    """Return the pattern of element matrices, a constant matrix and a diagonal; cached."""
    pairs = sum(c.shape[0] * (c.shape[0] + 1) // 2 * c.shape[1] for c in columns)
    digest = hashlib.blake2b(str(n).encode())
    for c in (*columns, quadratic.indptr, quadratic.indices):
        digest.update(str(c.shape).encode())
        digest.update(np.ascontiguousarray(c).data)
    key = digest.digest()
    if key in _assemblies:
        _assemblies.move_to_end(key)
        return _assemblies[key]
    assembly = _analysed(n, columns, quadratic)
    if pairs <= _LARGEST_KEPT:
        _assemblies[key] = assembly
        while len(_assemblies) > _ASSEMBLIES_KEPT:
            _assemblies.popitem(last=False)
    return assembly


def _analysed(n: int, columns: list[Ints], quadratic: Any) -> Assembly:
    """Compute the position in the matrix of every product of two unknowns of an element."""
    # Half as wide, which takes half of the time and memory on large meshes.
    kind = np.int32 if n < _NARROW else np.int64
    lows, highs = [], []
    for own in columns:
        c = own.astype(kind)
        a, b = np.triu_indices(c.shape[0])
        low, high = np.minimum(c[a], c[b]).ravel(), np.maximum(c[a], c[b]).ravel()
        # Padding (index n) is written to an entry past the end.
        low[high == n] = n
        lows.append(low)
        highs.append(high)
    every = np.arange(n, dtype=kind)
    lows += [np.repeat(every, np.diff(quadratic.indptr)), every]
    highs += [quadratic.indices.astype(kind), every]
    splits = np.cumsum([len(x) for x in lows])[:-1]
    place, column, row = _places(np.concatenate(lows), np.concatenate(highs), n)
    keep = column < n
    indptr = np.searchsorted(column[keep], np.arange(n + 1))
    *scatter, fixed, diagonal = np.split(place, splits)
    pattern = Pattern(n, indptr, row[keep])
    places = [
        Places(own, _repeated(c), c.shape[1]) for own, c in zip(scatter, columns, strict=True)
    ]
    return Assembly(pattern, places, fixed, diagonal)


#: Largest table, columns times diagonals, for which :func:`_places` does not sort, and number of
#: unknowns up to which their indices have 32 bits.
_LARGEST_TABLE, _NARROW = 200_000_000, 2**31 - 2


def _places(column: Ints, row: Ints, n: int) -> tuple[Ints, Ints, Ints]:
    """Rank every (column, row) among the distinct pairs, sorted by column then row; return both.

    Matrices with few diagonals (grids) are marked in a table; the pairs of others are sorted.
    """
    distance = row - column
    used = np.bincount(distance) > 0
    count = int(used.sum())
    if (n + 1) * count > _LARGEST_TABLE:
        every, place = np.unique(column * np.int64(n + 1) + row, return_inverse=True)
        return place, every // (n + 1), every % (n + 1)
    slot = (np.cumsum(used) - 1).astype(column.dtype)
    at = column * count + slot[distance]
    mark = np.zeros((n + 1) * count, bool)
    mark[at] = True
    found = np.flatnonzero(mark)
    rank = np.cumsum(mark, dtype=np.int32)
    columns, which = np.divmod(found, count)
    return rank[at].astype(np.int64) - 1, columns, columns + np.flatnonzero(used)[which]


def products(slope: Array, weight: Array) -> Array:
    """Sum weight * J_a * J_b over the residuals, for all pairs a <= b, (pairs, e)."""
    r, q, count = slope.shape
    out = np.empty((q * (q + 1) // 2, count))
    weighted = slope * weight[:, None, :]
    start = 0
    for a in range(q):
        part = out[start : start + q - a]
        np.multiply(weighted[0, a], slope[0, a:], out=part)
        for k in range(1, r):
            part += weighted[k, a] * slope[k, a:]
        start += q - a
    return out
