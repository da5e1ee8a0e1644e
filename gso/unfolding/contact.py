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


def boxes(corners: Corners) -> Array:
    """Return the bounding boxes (n, 4) of triangles (n, 3): least x and y, largest x and y."""
    x, y = corners.real, corners.imag
    out = np.empty((len(corners), 4))
    out[:, 0], out[:, 1], out[:, 2], out[:, 3] = x.min(1), y.min(1), x.max(1), y.max(1)
    return out


def overlapping(one: Corners, other: Corners, own: Array, others: Array) -> Ints:
    """Find the pairs (p, 2) of triangles of two sets that overlap.

    A pair is separated if, along a side of one of them, the other reaches inwards by no more than
    1e-7 of the longest side of both.

    Parameters
    ----------
    one, other : ndarray of complex, (n, 3) and (m, 3)
        Corners, anticlockwise.
    own, others : ndarray, (n, 4) and (m, 4)
        Their bounding boxes.

    Examples
    --------
    >>> a = np.array([[0, 1, 1j]])
    >>> b = np.concatenate([a + 0.2, a[:, ::-1] * -1 + 1 + 1j, a + 1.0])[:, [0, 1, 2]]
    >>> b[1] = [1, 1 + 1j, 1j]
    >>> overlapping(a, b, boxes(a), boxes(b)).tolist()
    [[0, 0]]
    """
    near = np.flatnonzero(_cross(own, _around(others)))
    far = np.flatnonzero(_cross(others, _around(own[near]))) if len(near) else near
    if not len(near) or not len(far):
        return np.empty((0, 2), np.int64)
    i, j = _candidates(own[near], others[far])
    i, j = near[i], far[j]
    met = _meet(one[i], other[j])
    return np.stack([i[met], j[met]], axis=1)


def _around(own: Array) -> Array:
    return np.r_[own[:, :2].min(axis=0), own[:, 2:].max(axis=0)]


def _cross(own: Array, box: Array) -> Flags:
    """Mark the boxes that cross another one, or the boxes of the same places."""
    return np.asarray(
        (own[..., 0] < box[..., 2])
        & (own[..., 2] > box[..., 0])
        & (own[..., 1] < box[..., 3])
        & (own[..., 3] > box[..., 1])
    )


def _candidates(own: Array, others: Array) -> tuple[Ints, Ints]:
    """Return the pairs of boxes that cross each other."""
    if len(own) * len(others) <= _ALL:
        i, j = np.nonzero(_cross(own[:, None], others[None]))
        return i, j
    # Boxes in the order of their left sides: only those between two places can cross.
    order = np.argsort(others[:, 0], kind="stable")
    left = others[order, 0]
    wide = float((others[:, 2] - others[:, 0]).max())
    first = np.searchsorted(left, own[:, 0] - wide)
    count = np.searchsorted(left, own[:, 2]) - first
    i = np.repeat(np.arange(len(own)), count)
    j = order[np.arange(len(i)) - np.repeat(np.cumsum(count) - count - first, count)]
    met = _cross(own[i], others[j])
    return i[met], j[met]


def _meet(a: Corners, b: Corners) -> Flags:
    """Mark the pairs of triangles (p, 3) that overlap, by separating axes."""
    met = np.ones(len(a), bool)
    ways = [np.roll(x, -1, axis=1) - x for x in (a, b)]
    sizes = [abs(way) for way in ways]
    depth = DEPTH * np.maximum(sizes[0].max(axis=1), sizes[1].max(axis=1))
    for base, way, size, seen in zip((a, b), ways, sizes, (b, a), strict=True):
        # Triangles are convex: if a line separates them, one along a side of one of them does.
        inward = (way.conj()[:, :, None] * (seen[:, None, :] - base[:, :, None])).imag.max(axis=2)
        met &= (inward > depth[:, None] * size).all(axis=1)
    return met
