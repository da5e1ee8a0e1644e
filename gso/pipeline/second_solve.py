"""Other solves where the first result is not usable, and the choice between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso.metrics import loss_gc_worst
from gso.pipeline.case import Case
from gso.pipeline.judgement import conclude
from gso.pipeline.run import Run
from gso.result import Result
from gso.status import Status
from gso.tasks.base import Options
from gso.tasks.request import Request
from gso.verdict import Code

#: Factor by which a solve may raise the curvature of its start, and the share of the start's strain
#: below which it may be anything.
_RISE, _GAIN = 1.5, 0.5
#: Reasons that a bound on the distance and more fairness may remove.
_MENDED = {
    Code.STRAIN,
    Code.FAR,
    Code.FOLDED,
    Code.CROSSES_ITSELF,
    Code.COLLAPSED,
    Code.PATTERN_INVERTED,
    Code.PATTERN_OVERLAPS,
    Code.PATTERN_COLLAPSED,
    Code.CURVATURE_ROSE,
}


def solve_and_judge(run: Run) -> Result:
    """Solve the case of a run; again, within a distance, where the result is not usable.

    Where the user gave limits, the task searches for a result that holds them. Where there are
    none, a result that strains too much, is too far away or folds is solved again with a bound on
    the distance, by the same formulation and, where the user did not name it, by others. The first
    usable result is returned, or else the one that misses its limits by the smallest factor.
    """
    case = run.case
    first = best = _or_start(run, conclude(run, run.solve()))
    for request in _others(case, first):
        solution = run(request)
        if solution.status is Status.CANCELLED:
            best.status = Status.CANCELLED
            break
        result = conclude(run, solution)
        for name in ("pattern", "verdict"):
            result.seconds[name] += first.seconds[name]
        if excess(result) < excess(best):
            why = str(first.reasons[0]).partition(";")[0]
            result.notes += (
                f"this is another solve, by {result.formulation!r}, with a bound on the distance; "
                f"of the first one {why}",
            )
            best = result
        if best.usable:
            break
    best.iterations, best.history = run.iterations, run.history
    return best


def _or_start(run: Run, result: Result) -> Result:
    """Return a result, or that which its solve started from, if that is better.

    More than one and a half times the curvature has to buy at least half of the strain.
    """
    request = run.case.solver_request
    before = run.case.task.formulations[request.formulation].before
    begun = None if before is None or request.limits.given else before(request)
    if begun is None or not request.verdict or not run.case.constraints.empty:
        return result
    start = run(begun)
    curved = loss_gc_worst(result.mesh, scale=1.0)
    there = run.case.frame.mesh.replaced(start.points)
    if start.status.is_failure or curved * run.case.frame.scale**2 <= _RISE * loss_gc_worst(
        there, scale=1.0
    ):
        return result
    other = conclude(run, start)
    if not _strain(other) * _GAIN < _strain(result) or excess(result) < excess(other):
        return result
    other.notes = (
        *dict.fromkeys([*result.notes, *other.notes]),
        f"the solve by {result.formulation!r} has more curvature than its start, and no less than "
        "half of its strain: this is the start",
    )
    return other


def _strain(result: Result) -> float:
    return float(result.details.get("verdict", {}).get("strain_max", np.inf))


def excess(result: Result) -> float:
    """Return the largest factor by which a result misses its limits; 0 if it is usable.

    Faults, which have no limit, count as far beyond.
    """
    if result.usable:
        return 0.0
    factors = [
        reason.value / reason.bound if reason.bound else float("inf")
        for reason in result.reasons
        if reason.value is not None
    ]
    return max(factors, default=float("inf"))


def _others(case: Case, first: Result) -> Iterator[Request[Options]]:
    """Return other requests, if they may remove the reasons against a result."""
    request, others = case.solver_request, case.task.others
    codes = {reason.code for reason in first.reasons}
    stopped = first.status in (Status.CANCELLED, Status.CONSTRAINTS_MISSED)
    if others is None or request.limits.given or stopped or not codes or not codes <= _MENDED:
        return
    yield from others(case.analysis, request)
