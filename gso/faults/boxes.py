"""Which boxes overlap: the broad phase of every search for crossings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Sizes are rounded to powers of this number, and each has a grid of its own.
_RATIO = 2.0
#: Most sizes that are told apart; smaller boxes count as the smallest.
_LEVELS = 12


def overlapping(low: Array, high: Array) -> Ints:
    """Pairs of axis-parallel boxes that overlap or touch, (p, 2), each pair once.

    Boxes are hashed into uniform grids, one per size, a box into the grids of its own size
    and of the larger ones. So a few large boxes among many small ones do no harm.

    Parameters
    ----------
    low, high : ndarray, (n, d)
        Corners of the boxes.

    Returns
    -------
    ndarray of int, (p, 2)
        Indices; the first of a pair is the smaller one.

    Examples
    --------
    >>> low = np.array([[0.0, 0.0], [0.5, 0.5], [3.0, 0.0]])
    >>> overlapping(low, low + 1.0)
    array([[0, 1]])
    """
    if len(low) < 2:
        return np.empty((0, 2), np.int64)
    size = (high - low).max(axis=1)
    largest = float(size.max())
    if largest <= 0:
        # Points: a grid of any width does.
        largest = float(np.ptp(low, axis=0).max()) or 1.0
    ratio = largest / np.maximum(size, largest * _RATIO**-_LEVELS)
    level = np.floor(np.log(ratio) / np.log(_RATIO)).astype(np.int64)
    origin = low.min(axis=0)
    found = []
    for k in np.unique(level):
        # Those of this size, then the smaller ones that may overlap them.
        order = np.r_[np.flatnonzero(level == k), np.flatnonzero(level > k)]
        own = int(np.count_nonzero(level == k))
        found.append(_in_grid(low[order], high[order], own, origin, largest * _RATIO**-k, order))
    pairs = np.concatenate(found)
    return np.sort(pairs, axis=1)


def _in_grid(low: Array, high: Array, own: int, origin: Array, width: float, names: Ints) -> Ints:
    """Overlapping pairs of which one box at least is among the first `own`."""
    cells, box, span = _cells(low, high, origin, width)
    mine = box < own
    order = np.argsort(cells[mine], kind="stable")
    key, who = cells[mine][order], box[mine][order]
    # An entry of those is paired with the ones behind it in its cell, another with all there.
    far, far_box = cells[~mine], box[~mine]
    begin = np.r_[np.arange(1, len(key) + 1), np.searchsorted(key, far, "left")]
    count = np.searchsorted(key, np.r_[key, far], "right") - begin
    at = np.arange(count.sum()) + np.repeat(begin - np.cumsum(count) + count, count)
    first, other = who[at], np.repeat(np.r_[who, far_box], count)
    cell = key[at]
    for d in range(low.shape[1]):
        near, end = np.ascontiguousarray(low[:, d]), np.ascontiguousarray(high[:, d])
        met = (near[first] <= end[other]) & (near[other] <= end[first])
        first, other, cell = first[met], other[met], cell[met]
    # A pair that shares several cells counts in the lowest of them.
    corner = np.floor((np.maximum(low[first], low[other]) - origin) / width).astype(np.int64)
    keep = _key(corner, span) == cell
    return np.stack([names[first[keep]], names[other[keep]]], axis=1)


def _cells(low: Array, high: Array, origin: Array, width: float) -> tuple[Ints, Ints, Ints]:
    """Cells that boxes lie in, the box of each, and the number of cells along the axes."""
    begin = np.floor((low - origin) / width).astype(np.int64)
    end = np.floor((high - origin) / width).astype(np.int64)
    span = end.max(axis=0) + 1
    keys, boxes = [_key(begin, span)], [np.arange(len(low))]
    # No box is wider than a cell, so it reaches one cell further along each axis, if at all.
    further = end > begin
    for offset in np.ndindex(*(2,) * low.shape[1]):
        some = np.array(offset, bool)
        if some.any():
            reached = np.flatnonzero(further[:, some].all(axis=1))
            keys.append(_key(begin[reached] + np.array(offset), span))
            boxes.append(reached)
    return np.concatenate(keys), np.concatenate(boxes), span


def _key(cell: Ints, span: Ints) -> Ints:
    """One number per cell."""
    key = cell[:, 0]
    for d in range(1, cell.shape[1]):
        key = key * span[d] + cell[:, d]
    return key
