"""Other solves where the first result is not usable, and the choice between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gso.faults import crossings
from gso.metrics import loss_gc_worst
from gso.pipeline.judgement import conclude
from gso.pipeline.run import Run
from gso.result import Result
from gso.status import Status
from gso.tasks.base import Options
from gso.tasks.request import Request
from gso.verdict import Code

#: Factor by which a solve may raise the curvature of the one whose result it improves, and the
#: share of the other's strain below which it may have any curvature.
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

    Where the user gave limits, the task searches for a result that holds them; where a search from
    a guarded start, as nets make it, finds none, it searches again from the design. Where there
    are none, a result that strains too much, is too far away or folds is solved again, kept near
    the design, by the same formulation and, where the user did not name it, by others. The first
    usable result is returned, or else the one that misses its limits by the smallest factor
    (:func:`excess`). Where the formulation improves the result of another one, that one is solved
    for in the same way, and returned where it is better (:func:`_is_worse`). A callback ends all
    solves, and a start with a budget of iterations has none but the first.
    """
    solves = _Solves(run)
    case, request = run.case, run.case.solver_request
    best = solves.usable(request)
    before = case.task.formulations[request.formulation].before
    judged = request.verdict and best.status is not Status.ALREADY_GOOD
    own = request
    if run.start_refused:
        own = replace(request, x0=None)
    begun = before(own) if before is not None and judged and solves.may_go_on else None
    if begun is not None and case.constraints.empty:
        other = solves.usable(begun)
        if _is_worse(best, other):
            note = (
                f"the solve by {request.formulation!r} is less developable than its start: this is "
                f"the result of {begun.formulation!r}"
            )
            best = replace(other, notes=(*dict.fromkeys([*best.notes, *other.notes]), note))
    return solves.summed(best)


class _Solves:
    """The judged results of a run by request: the first one of the case, and others."""

    def __init__(self, run: Run):
        self.run = run
        self._found: dict[tuple[object, ...], Result] = {}
        self._cancelled = False

    def usable(self, request: Request[Options]) -> Result:
        """Return the first usable result of a request and those near the design, or the best."""
        best = first = self._result(request)
        kept = ""
        for other in self._others(request, first):
            result = self._result(other)
            if excess(result) < excess(best):
                best, kept = result, _kept(other, request)
            if best.usable or self._cancelled:
                break
        if best is first:
            return first
        why = str(first.reasons[0]).partition(";")[0]
        note = f"this is another solve, by {best.formulation!r}{kept}; of the first one {why}"
        return replace(best, notes=(*best.notes, note))

    @property
    def may_go_on(self) -> bool:
        """Whether limits, a budget of iterations and the callback allow other solves."""
        request = self.run.case.request
        free = not request.limits.given and request.start.iterations is None
        return free and not self._cancelled

    def summed(self, best: Result) -> Result:
        """Return one of the results with the iterations and times of all."""
        run, judged = self.run, self._found.values()
        if self._cancelled:
            best.status = Status.CANCELLED
        best.iterations, best.history = run.iterations, run.history
        best.seconds |= run.timings.as_dict()
        for name in ("pattern", "verdict"):
            if name in best.seconds:
                best.seconds[name] = sum(r.seconds.get(name, 0.0) for r in judged)
        return best

    def _result(self, request: Request[Options]) -> Result:
        """Return the judged result of a request."""
        run, own = self.run, self.run.case.solver_request
        asked = (request.formulation, request.options, request.max_displacement)
        key = (*asked, request.weight_factor, request.x0 is None, request.terms)
        if key not in self._found:
            begun = request is own or request.limits.given
            result = conclude(run, run.solve(request) if begun else run(request))
            if request is not own:
                result.warm_start = "cold"
            self._cancelled |= result.status is Status.CANCELLED
            self._found[key] = result
        return self._found[key]

    def _others(self, request: Request[Options], first: Result) -> Iterator[Request[Options]]:
        """Return other requests, if they may remove the reasons against a result."""
        case, missed = self.run.case, first.status is Status.CONSTRAINTS_MISSED
        others, codes = case.task.others, {reason.code for reason in first.reasons}
        from_net = case.request.start.guarded and request.x0 is not None
        searched = request.limits.given and not (self.run.start_refused or self._cancelled)
        if from_net and searched and codes:
            yield replace(request, x0=None)
        if others is None or missed or not self.may_go_on or not codes or codes - _MENDED:
            return
        if Code.CROSSES_ITSELF in codes and crossings(case.design).size:
            return
        yield from others(case.analysis, request, bool(codes - {Code.FAR}))


def _kept(other: Request[Options], request: Request[Options]) -> str:
    """Say how another request differs from the first one; empty where only its formulation does."""
    if other.max_displacement is not None or other.terms != request.terms:
        return ", that is kept near the design"
    return ", that begins with the design" if request.limits.given else ""


def _is_worse(result: Result, other: Result) -> bool:
    """Return whether a result is worse than another one.

    It is if only the other is usable, or if it has more than one and a half times the other's
    curvature and no less than half of its strain. Of two that are not usable, it is too if only it
    has faults.
    """
    if result.usable != other.usable:
        return other.usable
    one, two = (loss_gc_worst(r.mesh, scale=1.0) for r in (result, other))
    curved = one > _RISE * two and not _strain(result) < _GAIN * _strain(other)
    return curved or excess(other) < np.inf == excess(result)


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
