"""Lines and closed polygons in arrays of points; the first point of a polygon is not repeated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.geometry.vectors import cross
from gso.typing import Array, Ints

#: Area of a corner of a quad, relative to the quad's, below which it is in a line.
_STRAIGHT = 1e-7


def signed_area(polygon: Array) -> float:
    """Return the area of a closed polygon (k, 2), positive if it is anticlockwise.

    >>> signed_area(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]))
    2.0
    """
    x, y = polygon.T
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def area_vector(polygon: Array) -> Array:
    """Return the doubled area vector (3,) of a closed polygon (k, 3).

    It points to where the polygon is anticlockwise.

    >>> area_vector(np.array([[0.0, 0, 5], [2, 0, 5], [2, 1, 5], [0, 1, 5]])).tolist()
    [0.0, 0.0, 4.0]
    """
    away = polygon - polygon.mean(axis=0)
    return np.asarray(cross(away, np.roll(away, -1, axis=0)).sum(axis=0))


def anticlockwise(polygon: Array) -> Array:
    """Return a closed polygon (k, 2), reversed if it is clockwise.

    >>> anticlockwise(np.array([[0.0, 0], [0, 1], [2, 1]])).tolist()
    [[2.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
    """
    return polygon if signed_area(polygon) > 0 else polygon[::-1]


def mean_width(loops: Sequence[Array]) -> float:
    """Return twice the area of a region over its perimeter: the width, for a long strip.

    Parameters
    ----------
    loops : sequence of ndarray, (k, 2)
        Its boundary loops; the one with the largest area is the outer one.

    Examples
    --------
    >>> round(mean_width([np.array([[0.0, 0], [98, 0], [98, 2], [0, 2]])]), 2)
    1.96
    >>> square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    >>> mean_width([2.0 * square, 3.0 * square]), mean_width([3.0 * square, 2.0 * square])
    (1.0, 1.0)
    """
    areas = [abs(signed_area(loop)) for loop in loops]
    return 2.0 * (2.0 * max(areas) - sum(areas)) / sum(perimeter(loop) for loop in loops)


def perimeter(polygon: Array) -> float:
    """Return the length of a closed polygon (k, d).

    >>> perimeter(np.array([[0.0, 0], [3, 0], [3, 4]]))
    12.0
    """
    return float(np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1).sum())


def arc_lengths(line: Array) -> Array:
    """Return the length of an open line (k, d) from its start to each of its points, (k,).

    >>> arc_lengths(np.array([[0.0, 0], [3, 4], [3, 5]])).tolist()
    [0.0, 5.0, 6.0]
    """
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    return np.asarray(np.r_[0.0, np.cumsum(steps)])


def points_at(at: Array | float, along: Array, line: Array, period: float | None = None) -> Array:
    """Interpolate a line (k, d), whose points are at places `along` (k,), at other places.

    Places count modulo `period`, if it is given.

    >>> points_at(2.5, np.array([0.0, 5, 6]), np.array([[0.0, 0], [3, 4], [3, 5]])).tolist()
    [1.5, 2.0]
    """
    return np.stack([np.interp(at, along, x, period=period) for x in line.T], axis=-1)


def densified(line: Array, step: float) -> Array:
    """Insert points (n, d) into a line (k, d), so that no two are farther apart than a step.

    >>> densified(np.array([[0.0, 0], [1, 0], [1, 0.2]]), 0.5).tolist()
    [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.2]]
    """
    if len(line) < 2:
        return line
    size = np.linalg.norm(np.diff(line, axis=0), axis=1)
    count = np.maximum(np.ceil(size / step), 1).astype(np.int64)
    first = np.repeat(np.arange(len(size)), count)
    share = (np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)) / count[first]
    inner = line[first] + share[:, None] * (line[first + 1] - line[first])
    return np.concatenate([inner, line[-1:]])


def rectangle(
    flat: Array, sheet: tuple[float, float] | None = None
) -> tuple[float, tuple[float, float]]:
    """Return the smallest rectangle about points (n, 2): its angle, its length and its width.

    One side of it lies on the convex hull. With a sheet, it is the smallest of those that are no
    longer and no wider, if there are any.

    >>> angle, size = rectangle(np.array([[0.0, 0], [3, 3], [2, 4], [-1, 1]]))
    >>> round(float(np.degrees(angle))), [round(x, 6) for x in size]
    (45, [4.242641, 1.414214])
    """
    from scipy.spatial import ConvexHull

    hull = flat[ConvexHull(flat).vertices]
    side = np.roll(hull, -1, axis=0) - hull
    angle = np.arctan2(side[:, 1], side[:, 0])
    turn = np.exp(-1j * angle)[:, None] * (hull @ np.array([1.0, 1j]))[None]
    wide, high = np.ptp(turn.real, axis=1), np.ptp(turn.imag, axis=1)
    size = wide * high
    if sheet is not None:
        long, short = np.maximum(wide, high), np.minimum(wide, high)
        fits = (long <= max(sheet)) & (short <= min(sheet))
        size = np.where(fits, size, np.inf) if fits.any() else size
    k = int(size.argmin())
    if wide[k] >= high[k]:
        return float(angle[k]), (float(wide[k]), float(high[k]))
    return float(angle[k] + 0.5 * np.pi), (float(high[k]), float(wide[k]))


def reflex_corners(quads: Array) -> Ints:
    """Return the corner at which each quad (m, 4, 3) is not convex, (m,); -1 for convex ones.

    Such a corner turns inwards, or not at all, seen along the normal of the quad. The diagonal
    that divides the quad inside it starts there. A quad that crosses itself has no such corner.

    >>> arrow = np.array([[4.0, 0, 0], [1, 1, 0], [0, 4, 0], [0, 0, 0]])
    >>> reflex_corners(np.array([arrow, np.roll(arrow, 1, axis=0)]))
    array([1, 2])
    """
    with np.errstate(all="ignore"):
        p = quads - quads.mean(axis=1, keepdims=True)
        before = p - np.roll(p, 1, axis=1)
        normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
        turn = np.einsum("mkd,md->mk", np.cross(before, np.roll(before, -1, axis=1)), normal)
        inwards = turn <= _STRAIGHT * (normal**2).sum(axis=1, keepdims=True)
    return np.where(inwards.sum(axis=1) == 1, inwards.argmax(axis=1), -1)
