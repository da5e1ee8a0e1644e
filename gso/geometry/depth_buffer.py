"""What is seen of triangles in an orthographic picture: a depth buffer."""

from __future__ import annotations

import numpy as np

from gso.typing import Array, Flags, Ints

#: Triangles that are drawn at a time.
_BLOCK = 256


def nearest_triangles(corners: Array, shape: tuple[int, int]) -> tuple[Ints, Array]:
    """Find the triangle that is nearest to the viewer in each pixel.

    Parameters
    ----------
    corners : ndarray, (m, 3, 3)
        Corners of triangles: column and row of the picture, in pixels, and depth, which grows
        towards the viewer. The centre of the pixel in row i and column j is (j + 0.5, i + 0.5).
    shape : (int, int)
        Number of rows and columns.

    Returns
    -------
    triangle : ndarray of int, (rows, columns)
        -1 where there is none.
    depth : ndarray, (rows, columns)
        Minus infinity where there is none.

    Examples
    --------
    >>> near = np.array([[0.0, 0, 2], [2, 0, 2], [0, 2, 2]])
    >>> far = np.array([[0.0, 0, 1], [4, 0, 1], [0, 4, 1]])
    >>> nearest_triangles(np.stack([far, near]), (2, 3))[0].tolist()
    [[1, 1, 0], [1, 0, 0]]
    """
    rows, columns = shape
    triangle = np.full(rows * columns, -1)
    nearest = np.full(rows * columns, -np.inf)
    for start in range(0, len(corners), _BLOCK):
        owner, pixel, depth = _fragments(corners[start : start + _BLOCK], shape)
        np.maximum.at(nearest, pixel, depth)
        seen = depth == nearest[pixel]
        triangle[pixel[seen]] = start + owner[seen]
    return triangle.reshape(shape), nearest.reshape(shape)


def _fragments(corners: Array, shape: tuple[int, int]) -> tuple[Ints, Ints, Array]:
    """Return the pixels that triangles cover: the triangle, the pixel and the depth of each."""
    rows, columns = shape
    owner, row, left, right, start, slope = _spans(corners, rows)
    span, column = _covered(left, right, columns)
    depth = start[span] + slope[span] * (column + 0.5 - left[span])
    return owner[span], row[span] * columns + column, depth


def _spans(corners: Array, rows: int) -> tuple[Ints, Ints, Array, Array, Array, Array]:
    """Return the parts of rows that triangles cover.

    These are, for each: its triangle and row, its left and right end, the depth at its left end,
    and how that grows with the column.
    """
    low, high = corners[..., 1].min(axis=1), corners[..., 1].max(axis=1)
    owner, row = _covered(low, high, rows)
    left, right = np.full(len(owner), np.inf), np.full(len(owner), -np.inf)
    start, end = np.zeros(len(owner)), np.zeros(len(owner))
    for k in range(3):
        a, b = corners[owner, k], corners[owner, (k + 1) % 3]
        rise = b[:, 1] - a[:, 1]
        share = (row + 0.5 - a[:, 1]) / np.where(rise == 0.0, 1.0, rise)
        crossed = (rise != 0.0) & (share >= 0.0) & (share <= 1.0)
        x, z = (a[:, i] + share * (b[:, i] - a[:, i]) for i in (0, 2))
        for side, at, is_more in ((left, start, x < left), (right, end, x > right)):
            taken = crossed & is_more
            side[taken], at[taken] = x[taken], z[taken]
    slope = (end - start) / np.where(right > left, right - left, 1.0)
    known = np.flatnonzero(right >= left)
    return owner[known], row[known], left[known], right[known], start[known], slope[known]


def _covered(low: Array, high: Array, most: int) -> tuple[Ints, Ints]:
    """Return the pixels, of `most` in line, whose centres lie in intervals (k,).

    These are the interval and the pixel of each.
    """
    first = np.clip(np.ceil(low - 0.5), 0, most).astype(np.int64)
    count = np.clip(np.floor(high - 0.5).astype(np.int64) + 1, first, most) - first
    interval = np.repeat(np.arange(len(low)), count)
    return interval, np.arange(len(interval)) - np.repeat(np.cumsum(count) - count - first, count)


def in_front(points: Array, depth: Array, near: float) -> Flags:
    """Tell which points (n, 3) are in front of what a depth buffer has, or at most `near` behind.

    Points are compared with the farthest of the pixels around them, so that those on outlines
    are seen.
    """
    rows, columns = depth.shape
    farthest = np.full(len(points), np.inf)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            column = np.clip(points[:, 0].astype(np.int64) + j, 0, columns - 1)
            row = np.clip(points[:, 1].astype(np.int64) + i, 0, rows - 1)
            np.minimum(farthest, depth[row, column], out=farthest)
    return np.asarray(points[:, 2] >= farthest - near)


def roomiest_pixels(owner: Ints, step: int = 1) -> dict[int, Array]:
    """Return for each region the pixel (column, row) that is the farthest from other regions.

    Parameters
    ----------
    owner : ndarray of int, (rows, columns)
        Number of the region of each pixel; -1 for none.
    step : int
        Only every step-th pixel of each row and column is looked at, but in narrow regions.

    Examples
    --------
    >>> roomiest_pixels(np.array([[-1, -1, -1], [4, 4, 4], [4, 4, 4], [4, 4, 4]]))
    {4: array([1.5, 2.5])}
    """
    found = _roomiest(owner[::step, ::step])
    places = {k: step * (at - 0.5) + 0.5 for k, (at, room) in found.items() if room or step == 1}
    if step > 1 and len(places) < np.count_nonzero(np.bincount(owner[owner >= 0])):
        places = {k: at for k, (at, _) in _roomiest(owner).items()} | places
    return places


def _roomiest(owner: Ints) -> dict[int, tuple[Array, float]]:
    """Return the pixel with most room in each region, and its distance from other regions."""
    from scipy.ndimage import distance_transform_edt

    outer = np.pad(owner, 1, constant_values=-2)
    inside = np.ones(owner.shape, bool)
    for other in (outer[2:, 1:-1], outer[:-2, 1:-1], outer[1:-1, 2:], outer[1:-1, :-2]):
        inside &= owner == other
    room = distance_transform_edt(inside)
    row, column = np.nonzero(owner >= 0)
    number, far = owner[row, column], room[row, column]
    most = np.zeros(owner.max(initial=-1) + 1)
    np.maximum.at(most, number, far)
    roomy = np.flatnonzero(far == most[number])
    known, first = np.unique(number[roomy], return_index=True)
    best = roomy[first]
    return {
        int(k): (np.array([j, i]) + 0.5, float(most[k]))
        for k, j, i in zip(known, column[best], row[best], strict=True)
    }
