"""The checks that decide whether a result is usable."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gso import tasks
from gso.status import Status
from gso.tasks.request import Limits
from gso.verdict.surface_checks import against_itself, against_pattern, against_surface
from gso.verdict.tasks import TASKS, ruled
from gso.wording import places

if TYPE_CHECKING:
    from gso.result import Result

#: Tasks whose pattern does not preserve lengths.
_STRETCHED = ("conformal",)


def judge(result: Result, limits: Limits, violation: float = 0.0) -> tuple[str, ...]:
    """List the reasons why a result is not usable, with their places; empty if it is usable.

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
    tuple of str
    """
    return tuple(_reasons(result, limits, violation))


def _reasons(result: Result, limits: Limits, violation: float) -> Iterator[str]:
    if result.status.is_failure:
        yield str(result.status)
    pattern = result.pattern
    for points in (result.mesh.vertices, None if pattern is None else pattern.flat):
        if points is None or np.isfinite(points).all():
            continue
        wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
        yield f"the coordinates of {places('vertex', wrong)} are not finite"
        return
    if tasks.get(result.task).flat:
        surface = result.design
    else:
        surface = result.mesh
        if result.ruled is not None:
            yield from against_itself(surface)
        elif result.status is not Status.ALREADY_GOOD:
            yield from against_surface(result.design, surface)
    if pattern is not None:
        yield from against_pattern(surface, pattern, lengths=result.task not in _STRETCHED)
    if result.ruled is not None:
        yield from ruled(result, limits, violation)
    elif result.task in TASKS:
        yield from TASKS[result.task](result, limits, violation)
