"""Other solves where the first result is not usable, and the choice between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso.faults import crossings
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
    usable result is returned, or else the one that misses its limits by the smallest factor
    (:func:`excess`). A callback ends all solves, and a start with a budget of iterations has none
    but the first.
    """
    case = run.case
    first = conclude(run, run.solve())
    judged = [first, *_start_of(run, first)]
    best = first = judged[-1]
    for request in _others(case, first):
        solution = run(request)
        if solution.status is Status.CANCELLED:
            best.status = Status.CANCELLED
            break
        result = conclude(run, solution)
        result.warm_start = "cold"
        judged.append(result)
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
    best.seconds |= run.timings.as_dict()
    for name in ("pattern", "verdict"):
        if name in best.seconds:
            best.seconds[name] = sum(r.seconds.get(name, 0.0) for r in judged)
    return best


def _start_of(run: Run, result: Result) -> list[Result]:
    """Return the result that a solve started from, if it is better; else none.

    More than one and a half times the curvature has to buy at least half of the strain.
    """
    case = run.case
    request, scale = case.solver_request, case.frame.scale
    before = case.task.formulations[request.formulation].before
    begun = None if before is None or not _may_go_on(case, result) else before(request)
    if begun is None or not request.verdict or not case.constraints.empty:
        return []
    start = run(begun)
    if start.status is Status.CANCELLED:
        result.status = Status.CANCELLED
        return []
    curved = loss_gc_worst(result.mesh, scale=1.0) * scale**2
    there = loss_gc_worst(case.frame.mesh.replaced(start.points), scale=1.0)
    if start.status.is_failure or curved <= _RISE * there:
        return []
    other = conclude(run, start)
    if not _strain(other) * _GAIN < _strain(result) or excess(result) < excess(other):
        return []
    other.notes = (
        *dict.fromkeys([*result.notes, *other.notes]),
        f"the solve by {result.formulation!r} has more curvature than its start, and no less than "
        "half of its strain: this is the start",
    )
    return [other]


def _may_go_on(case: Case, result: Result) -> bool:
    """Return whether limits, a budget of iterations and the callback allow other solves."""
    free = not case.request.limits.given and case.request.start.iterations is None
    return free and result.status is not Status.CANCELLED


def _strain(result: Result) -> float:
    return float(result.details.get("verdict", {}).get("strain_max", np.inf))


def excess(result: Result) -> float:
    """Return the largest factor by which a result misses its limits; 0 if it is usable.

    Faults, which have no limit, and more curvature than the design's count as far beyond.
    """
    if result.usable:
        return 0.0
    factors = [
        reason.value / reason.bound
        if reason.bound and reason.code is not Code.CURVATURE_ROSE
        else float("inf")
        for reason in result.reasons
        if reason.value is not None
    ]
    return max(factors, default=float("inf"))


def _others(case: Case, first: Result) -> Iterator[Request[Options]]:
    """Return other requests, if they may remove the reasons against a result."""
    others, missed = case.task.others, first.status is Status.CONSTRAINTS_MISSED
    codes = {reason.code for reason in first.reasons}
    if others is None or missed or not _may_go_on(case, first) or not codes or codes - _MENDED:
        return
    if Code.CROSSES_ITSELF in codes and crossings(case.design).size:
        return
    yield from others(case.analysis, case.solver_request, bool(codes - {Code.FAR}))
