"""The sparsity pattern of the Gauss-Newton matrix, and the places of elements in it."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gso.linalg.base import Pattern
from gso.solver.ranking import Pairs, rank
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix


def _find_repeated(columns: Ints) -> Ints:
    """Find pairs a < b of an element that are the same unknown, as ordered by :func:`products`.

    Such a pair contributes to the diagonal of the matrix twice.
    """
    q, count = columns.shape
    found, start = [np.empty(0, np.int64)], 0
    for a in range(q):
        which, element = np.nonzero(columns[a + 1 :] == columns[a])
        found.append((start + 1 + which) * count + element)
        start += q - a
    return np.concatenate(found)


@dataclass
class Places:
    """Where the matrices of one term's elements are in the whole matrix.

    Attributes
    ----------
    by_element : ndarray of int, (e, pairs)
        The place of each entry, by pairs a <= b of unknowns in the order of :func:`products`.
    repeated : ndarray of int
        Which entries of :attr:`scatter` count twice.
    """

    by_element: NDArray[np.int32]
    repeated: Ints

    @property
    def doubled(self) -> bool:
        """Whether any entry counts twice."""
        return bool(len(self.repeated))

    @cached_property
    def scatter(self) -> Ints:
        """The place of each entry, (pairs * e,), ordered as by :func:`products`."""
        return np.ravel(self.by_element.T.astype(np.int64))


@dataclass
class Assembly:
    """The pattern of the matrix, and the places in it of elements, constants, and diagonal."""

    pattern: Pattern
    places: list[Places]
    quadratic: Ints
    diagonal: Ints


#: Assemblies that were used last, and their numbers of element matrices' entries.
_assemblies: OrderedDict[bytes, tuple[Assembly, int]] = OrderedDict()
#: Most entries that are kept, in sum.
_KEPT = 12_000_000


def assemble(n: int, columns: list[Ints], quadratic: csc_matrix) -> Assembly:
    """Return the pattern of element matrices, a constant matrix and a diagonal; cached."""
    pairs = sum(c.shape[0] * (c.shape[0] + 1) // 2 * c.shape[1] for c in columns)
    digest = hashlib.blake2b(str(n).encode())
    for c in (*columns, quadratic.indptr, quadratic.indices):
        digest.update(str(c.shape).encode())
        digest.update(np.ascontiguousarray(c).data)
    key = digest.digest()
    if key in _assemblies:
        _assemblies.move_to_end(key)
        return _assemblies[key][0]
    assembly = _analyse(n, columns, quadratic)
    if pairs <= _KEPT:
        _assemblies[key] = assembly, pairs
        while sum(size for _, size in _assemblies.values()) > _KEPT:
            _assemblies.popitem(last=False)
    return assembly


def _analyse(n: int, columns: list[Ints], quadratic: csc_matrix) -> Assembly:
    """Compute the position in the matrix of every product of two unknowns of an element."""
    every = np.arange(n)
    entries = np.stack([np.repeat(every, np.diff(quadratic.indptr)), quadratic.indices])
    constant = Pairs(entries, n, (np.array([0]), np.array([1])))
    groups = [*(Pairs(own, n) for own in columns), constant, Pairs(every[None], n)]
    (*own, fixed, diagonal), column, row = rank(groups, n)
    pattern = Pattern(n, np.searchsorted(column, np.arange(n + 1)), row)
    places = [Places(at, _find_repeated(c)) for at, c in zip(own, columns, strict=True)]
    return Assembly(pattern, places, *(x[:, 0].astype(np.int64) for x in (fixed, diagonal)))


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
