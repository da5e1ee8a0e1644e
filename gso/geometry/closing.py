"""Closed loops unrolled into the plane: what they lack to close there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso.typing import Array, Ints

#: Share of the trace that is added to second moments, so that loops along a line have an inverse.
_RIDGE = 0.01


class Closing(NamedTuple):
    """What loops around holes lack to close in the plane: the holonomy of a flat surface.

    Attributes
    ----------
    defect : ndarray, (l,)
        The missing angle, radians: 2 pi and the sum of the turning angles.
    gap : ndarray, (l,)
        Distance between both ends of the unrolled loop, with the defect shared among its vertices.
    turn : ndarray, (r,)
        Turning angles next to the present ones that close the loops.
    """

    defect: Array
    gap: Array
    turn: Array


def closing(turn: Array, length: Array, number: Ints) -> Closing:
    """Unroll loops into the plane.

    The lengths stay. The angles change least in the sum of squares: by an equal share of the
    defect, and by a linear function of the unrolled position that moves the ends together. A turn
    by d at a vertex p moves the end of the loop by d (end - p), turned by a right angle.

    Parameters
    ----------
    turn : ndarray, (r,)
        Turning angle at every vertex of the loops, one loop after the other, radians.
    length : ndarray, (r,)
        Length of the edge from it to the next.
    number : ndarray of int, (r,)
        The loop that it is in, ascending from zero.

    Examples
    --------
    A square with clockwise corners closes. With a side that is longer it has a gap.

    >>> right = np.full(4, -0.5 * np.pi)
    >>> closing(right, np.ones(4), np.zeros(4, int)).gap.round(9)
    array([0.])
    >>> closing(right, np.array([1.5, 1.0, 1.0, 1.0]), np.zeros(4, int)).gap.round(9)
    array([0.5])
    """
    size = np.bincount(number)
    defect = 2.0 * np.pi + np.bincount(number, turn).astype(float)
    turn = turn - (defect / size)[number]
    # Every loop turns by a full turn, so the headings of one need not begin anew after another.
    heading = np.cumsum(turn)
    x, y = length * np.cos(heading), length * np.sin(heading)
    ends = np.bincount(number, x), np.bincount(number, y)
    x, y = (_about_centre(np.cumsum(step) - step, number, size) for step in (x, y))
    xx, yy, xy = (np.bincount(number, product) for product in (x * x, y * y, x * y))
    ridge = _RIDGE * (xx + yy)
    xx, yy = xx + ridge, yy + ridge
    wanted = ends[1], -ends[0]
    det = np.maximum(xx * yy - xy * xy, np.finfo(float).tiny)
    a = (yy * wanted[0] - xy * wanted[1]) / det
    b = (xx * wanted[1] - xy * wanted[0]) / det
    return Closing(defect, np.hypot(*ends), turn + a[number] * x + b[number] * y)


def _about_centre(values: Array, number: Ints, size: Ints) -> Array:
    """Return the values of each loop less their mean."""
    return np.asarray(values - (np.bincount(number, values) / size)[number])
