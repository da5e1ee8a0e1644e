"""The checks that decide whether a result is usable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gso import tasks
from gso.status import Status
from gso.tasks.request import Limits
from gso.verdict.codes import Code
from gso.verdict.compare import Measurement, compare, failure
from gso.verdict.reason import Reason, ordered
from gso.verdict.surface_checks import Measured, crossed, of_pattern, of_surface
from gso.verdict.task_checks import CHECKS, Bounds

if TYPE_CHECKING:
    from gso.result import Result

#: Tasks whose pattern does not preserve lengths.
_STRETCHED = ("conformal",)


def judge(result: Result, limits: Limits, violation: float = 0.0) -> tuple[Reason, ...]:
    """List the reasons why a result is not usable, the most severe first; empty if it is usable.

    For developable surfaces the largest strain and the given limits are stored in the result's
    details under "verdict".

    Parameters
    ----------
    result : Result
        The solver's result, with its `pattern` if it has one.
    limits : Limits
        Limits that were given, in the user's unit.
    violation : float
        Largest violation of a constraint by the design, in its unit: 0 if the design satisfies all
        constraints, infinite if a violation cannot be expressed as a length.

    Returns
    -------
    tuple of Reason
    """
    measured, bounds = _measured(result, limits, violation)
    stopped = [failure(Code[result.status.name])] if result.status.is_failure else []
    return ordered([*stopped, *compare(measured, bounds)])


def judge_components(result: Result) -> tuple[Reason, ...]:
    """List the reasons that the components of a result give together: one passes through another.

    What is only edited and not laid flat may do so.
    """
    surface = result.design if tasks.get(result.task).flat else result.mesh
    laid = result.pattern is not None and result.task not in _STRETCHED
    if not laid or not np.isfinite(surface.vertices).all():
        return ()
    return compare(crossed(surface, surface.components[surface.faces[:, 0]]), {})


def _measured(result: Result, limits: Limits, violation: float) -> tuple[Measured, Bounds]:
    pattern = result.pattern
    for points in (result.mesh.vertices, None if pattern is None else pattern.flat):
        if points is not None and not np.isfinite(points).all():
            wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
            return {Code.NOT_FINITE: Measurement.count("vertex", wrong)}, {}
    measured: Measured = {}
    if tasks.get(result.task).flat:
        surface = result.design
        if result.task not in _STRETCHED:
            measured |= crossed(surface)
    else:
        surface = result.mesh
        if result.status is not Status.ALREADY_GOOD:
            measured |= of_surface(result.design, surface, built=pattern is not None)
        elif pattern is not None:
            # Nothing was moved, but the surface may have vertices on bend lines.
            measured |= crossed(result.design)
    if pattern is not None:
        measured |= of_pattern(surface, pattern, lengths=result.task not in _STRETCHED)
    check = CHECKS.get(result.KIND or result.task)
    if check is None:
        return measured, {}
    own, bounds = check(result, limits, violation)
    return measured | own, bounds
