"""The last steps of every solve: the pattern of its surface, and the verdict on it."""

from __future__ import annotations

import time

import numpy as np

from gso.metrics import nonplanarity
from gso.result import Result
from gso.status import Status
from gso.tasks.base import Request
from gso.tno.layout import lay_out
from gso.verdict import Asked, judge

#: Gap of the diagonals over the mean edge up to which quads are planar, and above which they
#: visibly are not.
_PLANAR, _BENT = 1e-6, 1e-3


def asked_of(request: Request, scale: float, **limits: float | None) -> Asked:
    """What was asked for, from a request in the unit ball and limits in the user's unit."""
    compiled, mesh = request.constraints, request.mesh
    moved = 0.0
    if not compiled.empty and not compiled.flat:
        misses = compiled.misses(mesh.vertices).values()
        # What is missed by less than rounding is kept.
        moved = max((miss.length for miss in misses if miss.length > 1e-9), default=0.0)
    return Asked(**limits, moved=scale * moved)


def judged(result: Result, asked: Asked) -> Result:
    """The result with the pattern of its surface, the reasons against it, and its status.

    `seconds` gets entries "pattern" and "verdict". A status by which all is well becomes
    ``Status.UNUSABLE`` where there are reasons against the result, and each of them is a note.
    """
    if result.task == "developable" and np.isfinite(result.mesh.vertices).all():
        clock = time.perf_counter()
        result.pattern = lay_out(result.mesh, result.pattern)
        result.seconds["pattern"] = time.perf_counter() - clock
        result.notes += _planarity(result)
    clock = time.perf_counter()
    result.reasons = judge(result, asked)
    said = str(result.status)
    result.notes += tuple(r for r in result.reasons if r != said and r not in result.notes)
    if result.reasons and not result.status.refuses:
        result.status = Status.UNUSABLE
    result.seconds["verdict"] = time.perf_counter() - clock
    return result


def _planarity(result: Result) -> tuple[str, ...]:
    """That planar quads are planar no more."""
    if result.design.is_triangles:
        return ()
    before, after = (float(nonplanarity(m).max()) for m in (result.design, result.mesh))
    if before > _PLANAR or after <= _BENT:
        return ()
    return (
        f"the input's quads are planar, those of the result are not: their diagonals are up to "
        f"{after:.2g} of the mean edge apart; the constraint PlanarFaces keeps them planar",
    )


def warning(result: Result) -> str:
    """What to warn of: why the solve ended, and the first reason against the result; or nothing."""
    if result.status.converged or result.status is Status.MAX_ITERATIONS:
        return ""
    if result.status is not Status.UNUSABLE:
        return str(result.status)
    return f"not usable as what was asked for: {result.reasons[0]}"
