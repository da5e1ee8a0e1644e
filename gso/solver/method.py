"""Methods: the direction of a step, the line search along it, and when to stop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gso.geometry import ops
from gso.solver.directions import GaussNewton, LevenbergMarquardt
from gso.solver.line_search import armijo
from gso.status import Status

#: Energy (dimensionless) that counts as zero.
_NOTHING = 1e-20


def falls(before: Any, after: Any, step: Any, expected: Any, tolerance: float) -> tuple[Any, Any]:
    """Return whether the energy falls enough to go on, and whether the solve has converged if not.

    The arguments are those of :func:`relative_decrease`, or tensors of them.
    """
    least = tolerance * abs(before)
    # A rejected step is no failure if the predicted decrease is negligible.
    return before - after > least, (step > 0) | (expected <= ops.maximum(least, _NOTHING))


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


@dataclass(frozen=True)
class Method:
    """How a problem is minimised.

    Attributes
    ----------
    direction : callable
        Makes the object that computes the directions of one solve, such as
        :class:`gso.solver.directions.GaussNewton`.
    line_search : callable
        Finds the step, with the arguments of :func:`gso.solver.line_search.armijo`.
    stop : callable
        Decides when to stop, with the arguments of :func:`relative_decrease`.
    """

    direction: Callable[[], Any] = GaussNewton
    line_search: Callable[..., Any] = armijo
    stop: Callable[[float, float, float, float, float], Status | None] = relative_decrease


METHODS = {
    "gauss-newton": Method(GaussNewton),
    "levenberg-marquardt": Method(LevenbergMarquardt),
}
