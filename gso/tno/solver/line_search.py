"""The line search: backtracking until the energy falls enough."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso.typing import Array


def armijo(
    energy: Callable[[Array], float],
    x: Array,
    direction: Array,
    start: float,
    gradient: Array,
    *,
    project: Callable[[Array], Array] | None = None,
    longest: float = 1.0,
    decrease: float = 1e-4,
    shortest: float = 1e-4,
) -> tuple[Array, float, float]:
    """Backtrack from the longest step until the energy falls in proportion to the slope.

    With bounds, trial points are projected onto them (Bertsekas 1982) and the slope is
    that of the projected step.

    The next step is the minimum of the parabola through the two known values and the slope,
    clipped to between a tenth and a half of the last step.

    Parameters
    ----------
    energy : callable
        The objective.
    x, direction : ndarray
        Current point and search direction.
    start, gradient : float, ndarray
        Energy and its gradient at x.
    project : callable, optional
        Projection onto the bounds of the unknowns.
    longest, decrease, shortest : float
        First step tried, required share of the linear decrease, smallest step tried (relative
        to `longest` where that is below 1).

    Returns
    -------
    x, energy, step
        The accepted point; the old one with step 0 when there is none.
    """
    t = longest
    while t >= shortest * min(longest, 1.0):
        candidate = x + t * direction
        if project is not None:
            candidate = project(candidate)
        slope = float(gradient @ (candidate - x))
        value = energy(candidate)
        if value <= start + decrease * slope:
            return candidate, value, t
        if np.isfinite(value):
            fitted = -slope * t / max(2.0 * (value - start - slope), 1e-300)
            t = float(np.clip(fitted, 0.1 * t, 0.5 * t))
        else:
            t *= 0.3
    return x, start, 0.0
