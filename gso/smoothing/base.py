"""Shared code of the smoothers: checks of options, a common unit of length, the result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.errors import OptionError
from gso.mesh import Frame
from gso.spelling import choices
from gso.typing import Array


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


def checked_options(
    order: int | None, orders: tuple[int, ...], weight: float | None, norm: str
) -> None:
    """Raise on an invalid order, weight or norm.

    Raises
    ------
    OptionError
        `order` is not in `orders`, `weight` is negative or not finite, or `norm` is unknown.
    """
    if norm not in ("l2", "l1"):
        raise OptionError(f"norm {norm!r} is unknown; {choices(norm, ('l2', 'l1'))}")
    if order is not None and order not in orders:
        known = ", ".join(map(str, orders))
        raise OptionError(f"order {order} does not exist for norm {norm!r}; choose one of {known}")
    if weight is not None and not (np.isfinite(weight) and weight >= 0):
        raise OptionError(f"weight {weight} must be a number that is not negative")


def to_unit(points: Array) -> tuple[Array, Frame, float]:
    """Centre the points and scale them to root-mean-square radius one.

    Also return the frame of the input, and the standard deviation of rounding errors in the new
    unit, which accounts for coordinates far from the origin.

    >>> unit, frame, _ = to_unit(np.array([[9.0, 0.0, 0.0], [11.0, 0.0, 0.0]]))
    >>> unit[:, 0], frame.scale
    (array([-1.,  1.]), 1.0)
    """
    flat = points.reshape(-1, 3)
    centre = flat.mean(axis=0)
    radius = float(np.sqrt(((flat - centre) ** 2).sum() / len(flat)))
    frame = Frame(centre, radius if radius > 0 else 1.0)
    rounding = np.finfo(float).eps * (1.0 + float(np.abs(flat).max()) / frame.scale)
    return frame.to_unit(points), frame, rounding
