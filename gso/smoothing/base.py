"""Shared code of the smoothers: input checks, a common unit of length, the result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.spelling import choices
from gso.typing import Array

NORMS = ("l2", "l1")


@dataclass(frozen=True)
class Smoothed:
    """A smoothed surface and how it was smoothed.

    Attributes
    ----------
    points : ndarray
        The surface, with the shape and unit of the input.
    order : int
        Order of the penalised differences.
    weight : float
        Weight of the penalty (dimensionless). Pass a multiple of it to the function that made
        the result for less or more smoothing.
    sigma : float
        Estimated standard deviation of the noise per coordinate, in the unit of the input.
    dof : float
        Effective degrees of freedom per coordinate: the trace of the smoother, between that of
        a plane (3) and the number of points.
    """

    points: Array
    order: int
    weight: float
    sigma: float
    dof: float


@dataclass(frozen=True)
class Frame:
    """Centroid and root-mean-square radius: smoothers work in ``(points - centre) / scale``.

    `rounding` is the standard deviation of rounding errors in that unit. It accounts for
    coordinates far from the origin, which are less exact.
    """

    centre: Array
    scale: float
    rounding: float

    def to_user(self, points: Array) -> Array:
        """Transform points back to the frame of the input."""
        return self.centre + self.scale * points


def checked_points(points: ArrayLike, ndim: int) -> Array:
    """Convert points to float64 (..., 3) with `ndim` axes.

    Raises
    ------
    MeshError
        Wrong shape, or a coordinate that is not finite.
    """
    array = np.asarray(points, np.float64)
    if array.ndim != ndim or array.shape[-1] != 3:
        shape = "(H, W, 3)" if ndim == 3 else "(n, 3)"
        raise MeshError(f"points have shape {array.shape}; give {shape}")
    bad = ~np.isfinite(array).all(axis=-1)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        name = where[0] if len(where) == 1 else where
        raise MeshError(f"vertex {name} has a coordinate that is not finite: remove or repair it")
    return array


def checked_grid(points: ArrayLike) -> Array:
    """Convert a grid to float64 (H, W, 3).

    Raises
    ------
    MeshError
        As of :func:`checked_points`, or fewer than 3 rows or columns.
    """
    array = checked_points(points, 3)
    height, width = array.shape[:2]
    if min(height, width) < 3:
        raise MeshError(f"the grid is {height} x {width}: smoothing needs at least 3 x 3 vertices")
    return array


def checked_options(
    order: int | None, orders: tuple[int, ...], weight: float | None, norm: str
) -> None:
    """Raise on an invalid order, weight or norm.

    Raises
    ------
    OptionError
        `order` is not in `orders`, `weight` is negative or not finite, or `norm` is unknown.
    """
    if norm not in NORMS:
        raise OptionError(f"norm {norm!r} is unknown; {choices(norm, NORMS)}")
    if order is not None and order not in orders:
        known = ", ".join(map(str, orders))
        raise OptionError(f"order {order} does not exist for norm {norm!r}; choose one of {known}")
    if weight is not None and not (np.isfinite(weight) and weight >= 0):
        raise OptionError(f"weight {weight} must be a number that is not negative")


def to_unit(points: Array) -> tuple[Array, Frame]:
    """Centre the points and scale them to root-mean-square radius one.

    >>> unit, frame = to_unit(np.array([[9.0, 0.0, 0.0], [11.0, 0.0, 0.0]]))
    >>> unit[:, 0], frame.scale
    (array([-1.,  1.]), 1.0)
    """
    flat = points.reshape(-1, 3)
    centre = flat.mean(axis=0)
    moved = points - centre
    radius = np.sqrt((moved**2).sum() / len(flat))
    scale = float(radius) if radius > 0 else 1.0
    rounding = np.finfo(float).eps * (1.0 + float(np.abs(flat).max()) / scale)
    return moved / scale, Frame(centre, scale, rounding)
