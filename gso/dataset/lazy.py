"""Lazy arrays: rows are read from many files when the array is indexed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from gso.typing import Ints

Rows = slice | Ints

#: Function that reads rows, given as a slice or as an array of increasing indices.
Read = Callable[[Rows], np.ndarray]


@dataclass(frozen=True)
class Part:
    """Rows of an array that are read together.

    Attributes
    ----------
    count : int
        Number of rows.
    read : callable
        Function that reads rows, given as a slice or as an array of increasing indices.
    """

    count: int
    read: Read


class LazyArray:
    """An array whose rows are divided into parts and read when the array is indexed.

    It supports the indexing of NumPy arrays: integers, slices, index arrays and masks, of
    which the first applies to the rows. Nothing is cached, so the array can be pickled and
    shared by threads and processes; ``array[:]`` reads all of it.

    Parameters
    ----------
    parts : sequence of Part
        The parts, in the order of their rows.
    shape : tuple of int
        Shape of one row.
    dtype : dtype
        Type of the elements.

    Examples
    --------
    >>> rows = np.arange(6.0).reshape(3, 2)
    >>> array = LazyArray([Part(3, rows.__getitem__)] * 2, (2,), rows.dtype)
    >>> array.shape, array[4].tolist(), array[[5, 0], 1].tolist()
    ((6, 2), [2.0, 3.0], [5.0, 1.0])
    """

    def __init__(self, parts: Sequence[Part], shape: tuple[int, ...], dtype: DTypeLike):
        self.parts = list(parts)
        self._ends = np.cumsum([0, *(part.count for part in self.parts)])
        self.shape = (int(self._ends[-1]), *shape)
        self.dtype = np.dtype(dtype)

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        return f"LazyArray({self.shape}, {self.dtype})"

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> np.ndarray:
        return self[:] if dtype is None else self[:].astype(dtype)

    def __getitem__(self, key: object) -> np.ndarray:
        first, *rest = key if isinstance(key, tuple) else (key,)
        # Indexing the row numbers gives NumPy's semantics and its errors.
        wanted = np.arange(len(self))[first]
        rows = self._rows(np.atleast_1d(wanted).ravel())
        out = rows.reshape((*wanted.shape, *self.shape[1:]))
        return out[(slice(None),) * wanted.ndim + tuple(rest)]

    def _rows(self, wanted: Ints) -> np.ndarray:
        out = np.empty((len(wanted), *self.shape[1:]), self.dtype)
        owner = np.searchsorted(self._ends, wanted, side="right") - 1
        for number in np.unique(owner):
            here = np.flatnonzero(owner == number)
            rows, back = np.unique(wanted[here] - self._ends[number], return_inverse=True)
            whole = len(rows) == rows[-1] - rows[0] + 1
            some: Rows = slice(int(rows[0]), int(rows[-1]) + 1) if whole else rows
            out[here] = self.parts[number].read(some)[back]
        return out
