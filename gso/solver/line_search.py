"""The line search: backtracking until the energy falls enough, or no longer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gso.geometry import ops
from gso.status import Status
from gso.typing import Array, N

#: Required share of the linear decrease, and smallest step that is tried.
DECREASE, SHORTEST = 1e-4, 1e-4
#: Largest factor from one decrease of the energy to the next that is taken to last.
SLOWEST = 0.9
#: Energy (dimensionless) that counts as zero.
_NOTHING = 1e-20


def shorten(step: N, rise: N, slope: N) -> N:
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
) -> tuple[Array, float, float]:
    """Backtrack from the longest step until the energy falls in proportion to the slope.

    With bounds, trial points are projected onto them (Bertsekas 1982) and the slope is
    that of the projected step.

    :func:`shorten` gives the next step.

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
    longest : float
        First step tried; the smallest one is relative to it where it is below 1.

    Returns
    -------
    x, energy, step
        The accepted point; the old one with step 0 when there is none.
    """
    t = longest
    while t >= SHORTEST * min(longest, 1.0):
        candidate = x + t * direction
        if project is not None:
            candidate = project(candidate)
        slope = float(gradient @ (candidate - x))
        value = energy(candidate)
        if value <= start + DECREASE * slope:
            return candidate, value, t
        t = float(shorten(t, value - start, slope))
    return x, start, 0.0


def falls(before: N, after: N, step: N, expected: N, tolerance: float) -> tuple[Any, Any]:
    """Return whether the energy falls enough to go on, and whether the solve has converged if not.

    The arguments are those of :func:`relative_decrease`, or tensors of them.
    """
    least = tolerance * abs(before)
    stepped: Any = step > 0
    # A rejected step is no failure if the predicted decrease is negligible.
    return before - after > least, stepped | (expected <= ops.maximum(least, _NOTHING))


def ends_next(step: Any, enough: Any) -> Any:
    """Return whether a solve may end with the next iteration, given this one's step and decrease.

    Not after a shortened step: it raises the damping, so that the next one is short whatever the
    surface. One small decrease would then end the solve or not by the last digits.

    Parameters
    ----------
    step : float or tensor
        The accepted step length.
    enough : bool or tensor of bool
        Whether the energy fell enough to go on.
    """
    return (step >= 1.0) | (step <= 0.0) | (enough ^ True)


def foretold(before: float, now: float) -> float:
    """Return the decrease of all further iterations, from those of the last two.

    Decreases are taken to fall by the same factor from iteration to iteration.

    >>> foretold(8.0, 2.0)  # 0.5 + 0.125 + ...
    0.6666666666666666
    """
    factor = min(max(now / before if before > 0 else 1.0, 0.0), SLOWEST)
    return max(now, 0.0) * factor / (1.0 - factor)


def relative_decrease(
    before: float, after: float, step: float, expected: float, tolerance: float
) -> Status | None:
    """Stop when an iteration lowers the energy by less than a share of it.

    Parameters
    ----------
    before, after : float
        Energy at the start and at the end of the iteration.
    step : float
        Accepted step length; 0 if no step lowers the energy enough.
    expected : float
        Decrease predicted by the quadratic model.
    tolerance : float
        The share.

    Returns
    -------
    Status or None
        None to continue.
    """
    enough, well = falls(before, after, step, expected, tolerance)
    if enough:
        return None
    return Status.CONVERGED if well else Status.STALLED
