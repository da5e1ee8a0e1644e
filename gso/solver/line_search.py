"""The line search: backtracking until the energy falls enough."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gso.geometry import ops
from gso.typing import Array

#: Required share of the linear decrease, and smallest step that is tried.
DECREASE, SHORTEST = 1e-4, 1e-4


def shorter(step: Any, rise: Any, slope: Any) -> Any:
    """Return the step to try after one that did not lower the energy enough.

    It is the minimum of the parabola through the two known values and the slope, clipped to
    between a tenth and a half of the last step.

    Parameters
    ----------
    step : float or tensor
        The last step.
    rise : float or tensor
        Energy there minus that at the start; infinite where it is not finite.
    slope : float or tensor
        Slope of the energy times the step.
    """
    fitted = -slope * step / ops.maximum(2.0 * (rise - slope), 1e-300)
    fitted = ops.minimum(ops.maximum(fitted, 0.1 * step), 0.5 * step)
    return ops.where(rise < float("inf"), fitted, 0.3 * step)


def armijo(
    energy: Callable[[Array], float],
    x: Array,
    direction: Array,
    start: float,
    gradient: Array,
    *,
    project: Callable[[Array], Array] | None = None,
    longest: float = 1.0,
    decrease: float = DECREASE,
    shortest: float = SHORTEST,
) -> tuple[Array, float, float]:
    """Backtrack from the longest step until the energy falls in proportion to the slope.

    With bounds, trial points are projected onto them (Bertsekas 1982) and the slope is
    that of the projected step.

    :func:`shorter` gives the next step.

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
        t = float(shorter(t, value - start, slope))
    return x, start, 0.0
