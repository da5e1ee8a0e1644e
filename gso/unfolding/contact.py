"""Overlaps of flat triangles, whose corners are complex numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.typing import Array, Flags, Ints

Corners = NDArray[np.complex128]

#: Depth of an overlap, relative to the longer triangle, up to which triangles only touch.
DEPTH = 1e-7
#: Number of pairs of boxes up to which all are compared.
_ALL = 30_000
#: Number of pairs that are looked at first where any overlap will do.
_SOME = 64
_AFTER = [1, 2, 0]


def boxes(corners: Corners) -> Array:
    """Return the bounding boxes (4, n) of triangles (n, 3): least x and y, largest x and y."""
    out = np.empty((4, len(corners)))
    for row, values in ((0, corners.real), (1, corners.imag)):
        a, b, c = values.T
        np.minimum(np.minimum(a, b), c, out=out[row])
        np.maximum(np.maximum(a, b), c, out=out[row + 2])
    return out


def crossing(own: Array, box: Array) -> Flags:
    """Mark the boxes (4, ...) that cross another one, or others."""
    return np.asarray((own[0] < box[2]) & (own[2] > box[0]) & (own[1] < box[3]) & (own[3] > box[1]))


def around(own: Array) -> Array:
    """Return the bounding box (4,) of boxes (4, n)."""
    return np.concatenate([own[:2].min(axis=1), own[2:].max(axis=1)])


def overlapping(
    one: Corners, other: Corners, own: Array, others: Array, every: bool = True
) -> Ints:
    """Find the pairs (p, 2) of triangles of two sets that overlap.

    A pair is separated if, along a side of one of them, the other reaches inwards by no more than
    1e-7 of the longest side of both.

    Parameters
    ----------
    one, other : ndarray of complex, (n, 3) and (m, 3)
        Corners, anticlockwise.
    own, others : ndarray, (4, n) and (4, m)
        Their bounding boxes.
    every : bool
        Whether all pairs are wanted; else some are found, if there are any.

    Examples
    --------
    >>> a = np.array([[0, 1, 1j]])
    >>> b = np.array([[0.2, 1.2, 0.2 + 1j], [1, 1 + 1j, 1j], [1, 2, 1 + 1j]])
    >>> overlapping(a, b, boxes(a), boxes(b)).tolist()
    [[0, 0]]
    """
    i, j = _candidates(own, others)
    found = []
    begin, end = 0, len(i) if every else _SOME
    while begin < len(i):
        p, q = _met(one, other, i[begin:end], j[begin:end])
        found.append(np.stack([p, q], axis=1))
        if len(p) and not every:
            break
        begin, end = end, 8 * end
    return np.concatenate(found) if found else np.empty((0, 2), np.int64)


def _met(one: Corners, other: Corners, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Return the pairs that no side separates."""
    for first in (True, False):
        a, b = one[i], other[j]
        apart = _separated(a, b) if first else _separated(b, a)
        i, j = i[~apart], j[~apart]
        if not len(i):
            break
    return i, j


def _candidates(own: Array, others: Array) -> tuple[Ints, Ints]:
    """Return the pairs of boxes that cross each other."""
    if own.shape[1] * others.shape[1] <= _ALL:
        i, j = np.nonzero(crossing(own[:, :, None], others[:, None]))
        return i, j
    # Boxes in the order of their left sides: only those between two places can cross.
    order = np.argsort(others[0], kind="stable")
    left = others[0, order]
    wide = float((others[2] - others[0]).max())
    first = np.searchsorted(left, own[0] - wide)
    count = np.searchsorted(left, own[2]) - first
    i = np.repeat(np.arange(own.shape[1]), count)
    j = order[np.arange(len(i)) - np.repeat(np.cumsum(count) - count - first, count)]
    met = crossing(own[:, i], others[:, j])
    return i[met], j[met]


def _separated(a: Corners, b: Corners) -> Flags:
    """Mark the pairs of triangles (p, 3) with a line along a side of the first between them."""
    way = a[:, _AFTER] - a
    size = np.abs(way)
    longest = np.maximum(np.maximum(size[:, 0], size[:, 1]), size[:, 2])
    across = np.abs(b[:, 0] - b[:, 1]) + np.abs(b[:, 1] - b[:, 2])
    depth = DEPTH * np.maximum(longest, across)
    inward = (way.conj()[:, :, None] * (b[:, None, :] - a[:, :, None])).imag
    reach = np.maximum(np.maximum(inward[..., 0], inward[..., 1]), inward[..., 2])
    apart = reach <= depth[:, None] * size
    return np.asarray(apart[:, 0] | apart[:, 1] | apart[:, 2])
