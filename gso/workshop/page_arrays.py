"""Arrays of a page as one block of bytes, and where each of them is in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gso.typing import Array, Json

#: Level of a quantised number that is not finite, and the largest of the others.
_MISSING, _LEVELS = 65535, 65534


class Arrays:
    """Arrays, one after another.

    Numbers of coordinates and values have 16 bits, between the least and the largest of their
    column; indices have 16 or 32. ``web/src/data.js`` reads them.

    Examples
    --------
    >>> arrays = Arrays()
    >>> arrays.quantised([[0.0, 5.0], [1.0, 5.0]])
    {'at': 0, 'count': 2, 'columns': 2, 'low': [0.0, 5.0], 'step': [1.52592548e-05, 0.0]}
    >>> arrays.indices([[0, 1], [1, 2]])
    {'at': 8, 'count': 2, 'columns': 2, 'bits': 16}
    >>> len(arrays.content())
    16
    """

    def __init__(self) -> None:
        self._bytes = bytearray()

    def quantised(self, values: ArrayLike) -> Json:
        """Add numbers (n,) or (n, d); those that are not finite are marked as missing."""
        table = np.asarray(values, float)
        table = table.reshape(len(table), -1)
        finite = np.isfinite(table)
        low = np.min(table, axis=0, initial=np.inf, where=finite)
        high = np.max(table, axis=0, initial=-np.inf, where=finite)
        low = np.where(np.isfinite(low), low, 0.0)
        step = np.where(np.isfinite(high), high - low, 0.0) / _LEVELS
        share = np.where(finite, table - low, 0.0) / np.where(step > 0, step, 1.0)
        levels = np.where(finite, np.clip(np.round(share), 0, _LEVELS), _MISSING)
        return self._add(levels.astype("<u2")) | {"low": _rounded(low), "step": _rounded(step)}

    def indices(self, values: ArrayLike) -> Json:
        """Add indices (n, d), which are not negative."""
        table = np.asarray(values, np.int64)
        bits = 16 if table.max(initial=0) <= _LEVELS else 32
        return self._add(table.astype(f"<u{bits // 8}")) | {"bits": bits}

    def content(self) -> bytes:
        """Return all of them, one after another."""
        return bytes(self._bytes)

    def _add(self, table: np.ndarray) -> Json:
        at = len(self._bytes)
        self._bytes += table.tobytes()
        # Typed arrays begin at multiples of their size.
        self._bytes += b"\x00" * (-len(self._bytes) % 4)
        columns = table.shape[1] if table.ndim > 1 else 1
        return {"at": at, "count": len(table), "columns": columns}


def _rounded(values: Array) -> list[float]:
    return [float(f"{x:.9g}") for x in values]
