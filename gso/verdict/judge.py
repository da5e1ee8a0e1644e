"""The checks that decide whether a result is usable."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gso import tasks
from gso.status import Status
from gso.verdict.asked import Asked
from gso.verdict.surface_checks import against_pattern, against_surface
from gso.verdict.tasks import CHECKS
from gso.wording import places

if TYPE_CHECKING:
    from gso.result import Result

#: Tasks whose pattern does not preserve lengths.
_STRETCHED = ("conformal",)


def judge(result: Result, asked: Asked) -> tuple[str, ...]:
    """List the reasons why a result is not usable, with their places; empty if it is usable.

    Parameters
    ----------
    result : Result
        The solver's result, with its `pattern` if it has one.
    asked : Asked
        Limits that were given.

    Returns
    -------
    tuple of str
    """
    return tuple(_reasons(result, asked))


def _reasons(result: Result, asked: Asked) -> Iterator[str]:
    if result.status.is_failure:
        yield str(result.status)
    pattern = result.pattern
    for points in (result.mesh.vertices, None if pattern is None else pattern.flat):
        if points is None or np.isfinite(points).all():
            continue
        wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
        yield f"the coordinates of {places('vertex', wrong)} are not finite"
        return
    if getattr(tasks.get(result.task), "BLOCK", "surface") == "flat":
        surface = result.design
    else:
        surface = result.mesh
        if result.status is not Status.ALREADY_GOOD:
            yield from against_surface(result.design, surface)
    if pattern is not None:
        yield from against_pattern(surface, pattern, lengths=result.task not in _STRETCHED)
    check = CHECKS.get(result.KIND or result.task)
    if check is not None:
        yield from check(result, asked)
