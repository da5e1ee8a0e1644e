"""Overlapping bounding boxes: the broad phase of the intersection tests."""

from __future__ import annotations

import numpy as np

from gso.typing import Array, Ints

#: Ratio between consecutive size classes; each class has its own grid.
_RATIO = 2.0
#: Index of the smallest size class; all smaller boxes belong to it.
_LEVELS = 12


def overlapping(low: Array, high: Array) -> Ints:
    """Find the pairs of axis-parallel boxes that overlap or touch, (p, 2), each pair once.

    Boxes are hashed into uniform grids, one per size class: each box into the grids of its own
    class and of all larger ones. So a few large boxes among many small ones are not costly.

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
        # All boxes are points: any grid width is correct.
        largest = float(np.ptp(low, axis=0).max()) or 1.0
    ratio = largest / np.maximum(size, largest * _RATIO**-_LEVELS)
    level = np.floor(np.log(ratio) / np.log(_RATIO)).astype(np.int64)
    origin = low.min(axis=0)
    found = []
    for k in np.unique(level):
        # Boxes of this class, then the smaller ones that may overlap them.
        order = np.r_[np.flatnonzero(level == k), np.flatnonzero(level > k)]
        own = int(np.count_nonzero(level == k))
        found.append(_in_grid(low[order], high[order], own, origin, largest * _RATIO**-k, order))
    pairs = np.concatenate(found)
    return np.sort(pairs, axis=1)


def _in_grid(low: Array, high: Array, own: int, origin: Array, width: float, names: Ints) -> Ints:
    """Find the overlapping pairs with at least one box among the first `own`."""
    cells, box, span = _cells(low, high, origin, width)
    mine = box < own
    order = np.argsort(cells[mine], kind="stable")
    key, who = cells[mine][order], box[mine][order]
    # An entry of the first `own` boxes is paired with the later ones in its cell, an entry of a
    # smaller box with all of them.
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
    # A pair that shares several cells is kept in the lowest of them only.
    corner = np.floor((np.maximum(low[first], low[other]) - origin) / width).astype(np.int64)
    keep = _key(corner, span) == cell
    return np.stack([names[first[keep]], names[other[keep]]], axis=1)


def _cells(low: Array, high: Array, origin: Array, width: float) -> tuple[Ints, Ints, Ints]:
    """List the cells that boxes cover, the box of each, and the number of cells per axis."""
    begin = np.floor((low - origin) / width).astype(np.int64)
    end = np.floor((high - origin) / width).astype(np.int64)
    span = end.max(axis=0) + 1
    keys, boxes = [_key(begin, span)], [np.arange(len(low))]
    # No box is wider than a cell, so it covers at most two cells along each axis.
    further = end > begin
    for offset in np.ndindex(*(2,) * low.shape[1]):
        some = np.array(offset, bool)
        if some.any():
            reached = np.flatnonzero(further[:, some].all(axis=1))
            keys.append(_key(begin[reached] + np.array(offset), span))
            boxes.append(reached)
    return np.concatenate(keys), np.concatenate(boxes), span


def _key(cell: Ints, span: Ints) -> Ints:
    """Encode grid cells as integers."""
    key = cell[:, 0]
    for d in range(1, cell.shape[1]):
        key = key * span[d] + cell[:, d]
    return key
