"""The last steps of every solve: the pattern of its surface, and the verdict on it."""

from __future__ import annotations

import time

import numpy as np

from gso.metrics import nonplanarity
from gso.pipeline.case import Case
from gso.pipeline.lay_flat import lay_out
from gso.pipeline.run import Run
from gso.pipeline.user_result import pack
from gso.result import Result
from gso.status import Status
from gso.tasks.base import Solution
from gso.tasks.request import Limits
from gso.verdict import Reason, judge

#: Distance of a quad's diagonals over the mean edge length: up to the first value quads count
#: as planar, above the second they are visibly not.
_PLANAR, _BENT = 1e-6, 1e-3


def conclude(run: Run, solution: Solution) -> Result:
    """Return the result of a run in the user's frame, judged if that was asked for."""
    result, request = pack(run, solution), run.case.request
    return (
        add_verdict(result, request.limits, violation_of(run.case)) if request.verdict else result
    )


def violation_of(case: Case) -> float:
    """Return the largest violation of a constraint by the design, in its unit."""
    constraints = case.analysis.constraints
    if constraints.empty or constraints.flat:
        return 0.0
    misses = constraints.violations(case.analysis.mesh.vertices).values()
    # Violations below rounding errors do not count.
    largest = max((miss.length for miss in misses if miss.length > 1e-9), default=0.0)
    return case.frame.scale * largest


def add_verdict(result: Result, limits: Limits, violation: float = 0.0) -> Result:
    """Add to a result the pattern of its surface, the reasons against it, and its final status.

    `seconds` gets entries "pattern" and "verdict". If there are reasons against the result, a
    status that does not refuse it becomes ``Status.UNUSABLE``.

    Parameters
    ----------
    result : Result
    limits : Limits
        What it was asked to hold.
    violation : float
        Largest violation of a constraint by the design, see :func:`gso.verdict.judge`.
    """
    if result.task == "developable" and np.isfinite(result.mesh.vertices).all():
        clock = time.perf_counter()
        result.pattern = lay_out(result.mesh, result.pattern)
        result.seconds["pattern"] = time.perf_counter() - clock
        result.notes += _planarity(result)
    clock = time.perf_counter()
    add_reasons(result, judge(result, limits, violation))
    result.seconds["verdict"] = time.perf_counter() - clock
    return result


def add_reasons(result: Result, reasons: tuple[Reason, ...]) -> None:
    """Add reasons to a result; its status then refuses it."""
    result.reasons = reasons
    if result.reasons and not result.status.is_failure:
        result.status = Status.UNUSABLE


def _planarity(result: Result) -> tuple[str, ...]:
    """Make a note if the design's quads are planar and the result's are not."""
    if result.design.is_triangles:
        return ()
    if nonplanarity(result.design).max() > _PLANAR:
        return ()
    after = float(nonplanarity(result.mesh).max())
    if after <= _BENT:
        return ()
    return (
        f"the input's quads are planar, those of the result are not: their diagonals are up to "
        f"{after:.2g} of the mean edge apart; the constraint PlanarFaces keeps them planar",
    )


def warning(result: Result) -> str:
    """Return what to warn of: the status or the reasons against the result; else empty."""
    if result.status.converged or result.status is Status.MAX_ITERATIONS:
        return ""
    if result.status is not Status.UNUSABLE:
        return str(result.status)
    return "\n  ".join(["not usable as what was asked for:", *map(str, result.reasons)])


#: Relative difference up to which two energies count as the same minimum.
_SAME = 1e-3


def is_better(one: Result, other: Result) -> bool:
    """Return whether a result alone is usable, or has less energy at equal usability."""
    if one.usable != other.usable:
        return one.usable
    return sum(one.energy.values()) < (1.0 - _SAME) * sum(other.energy.values())


def difference(dragged: Result, taken: Result) -> str:
    """Describe how the result that was taken differs from the dragged one."""
    apart = np.linalg.norm(taken.mesh.vertices - dragged.mesh.vertices, axis=1)
    k = int(apart.argmax())
    why = (
        "has less energy than the dragged surface"
        if taken.usable == dragged.usable
        else "is usable and the dragged surface is not"
    )
    return (
        f"the solve from the design {why}, and was taken; the two are up to {apart[k]:.4g} apart, "
        f"at vertex {k}"
    )
