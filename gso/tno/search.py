"""The two questions of the developable task: how close, and how developable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gso import metrics
from gso.status import Status
from gso.tasks.base import Request

#: Solves of one search, and how far below its target a result may lie.
_SOLVES = 10
_CLOSE = 0.03
_RANGE = (1e-2, 1e5)
_PROGRESS = 0.98
_ITERATIONS = 25
_COARSE_ITERATIONS = 15


def stay_within(run: Callable[[Request], Any], request: Request, bound: float) -> Any:
    """The more developable of two solves: one with the bound, one without that meets it."""
    bounded = run(replace(request, max_deviation=bound))
    if bounded.status in (Status.ALREADY_GOOD, Status.CANCELLED):
        return bounded
    free = run(request)
    if free.status is Status.CANCELLED:
        bounded.status = Status.CANCELLED
        return bounded
    used = request.mesh.used
    distance = metrics.point_to_surface(free.points[used], request.mesh)
    if distance.max() > bound or _curvature(request, free) >= _curvature(request, bounded):
        return bounded
    return free


def _distance(request: Request, outcome: Any) -> float:
    """``d_H`` of an outcome."""
    return metrics.d_H(request.mesh, request.mesh.replaced(outcome.points))


def _curvature(request: Request, outcome: Any) -> float:
    """``loss_gc`` of an outcome, in the frame of the request."""
    return metrics.loss_gc(request.mesh.replaced(outcome.points), scale=1.0)


def reach_target(run: Callable[[Request], Any], request: Request, target: float) -> Any:
    """Solve with growing or falling curvature weight until ``loss_gc`` is just below `target`.

    Mean |K| falls steadily with the weight, so the smallest displacement that meets the
    target belongs to the smallest weight that does: a secant search on their logarithms,
    every solve started from the last one above the target.
    """
    if metrics.loss_gc(request.mesh, scale=1.0) <= target and request.constraints.empty:
        options = replace(request.options, developable_below=target)
        return run(replace(request, options=options, start=None))
    given = request.options
    best: Any = None
    distance = np.inf
    # A preset may meet the target already: nothing farther away is returned.
    spline = {"variables": "surface"} if given.variables == "surface" else {}
    presets = (replace(given, **preset | spline) for preset in given.PRESETS.values())
    for options in dict.fromkeys((given, *presets)):
        last = run(replace(request, options=options))
        if last.status is Status.CANCELLED:
            break
        if _curvature(request, last) <= target and (moved := _distance(request, last)) < distance:
            best, distance = last, moved
    options = replace(
        given,
        variables=spline.get("variables", "free"),
        iterations=max(given.iterations, _ITERATIONS),
        coarse_iterations=max(given.coarse_iterations, _COARSE_ITERATIONS),
    )
    request = replace(request, options=options)
    weight, low, high = 1.0, 0.0, np.inf
    value_low = value_high = np.nan
    for _ in range(_SOLVES):
        if last.status is Status.CANCELLED:
            break
        last = run(replace(request, curvature_weight=weight))
        value = _curvature(request, last)
        if value <= target:
            high, value_high = weight, value
            moved = _distance(request, last)
            last.details = {**last.details, "curvature_weight": weight}
            if moved < distance:
                best, distance = last, moved
            if value >= (1.0 - _CLOSE) * target:
                break
        else:
            stuck = value > _PROGRESS * value_low
            low, value_low = weight, value
            # Curvature that is gone comes back slowly: go on from the side that has more.
            # Where more weight changes nothing, a new start gets round the obstacle.
            request = replace(request, start=None if stuck else last.points)
        if not _RANGE[0] < weight < _RANGE[1]:
            break
        weight = _next(weight, value, target, low, high, value_low, value_high)
    chosen = last if best is None else best
    if last.status is Status.CANCELLED:
        chosen.status = Status.CANCELLED
    else:
        chosen.status = Status.TARGET_MISSED if best is None else Status.TARGET_REACHED
    return chosen


def _next(
    weight: float,
    value: float,
    target: float,
    low: float,
    high: float,
    value_low: float,
    value_high: float,
) -> float:
    """Next weight: regula falsi in logarithms inside a bracket, a power law outside."""
    aim = 0.985 * target
    if low > 0 and np.isfinite(high):
        a, b = np.log(low), np.log(high)
        share = (np.log(value_low) - np.log(aim)) / max(
            np.log(value_low) - np.log(max(value_high, 1e-12)), 1e-12
        )
        return float(np.exp(a + np.clip(share, 0.1, 0.9) * (b - a)))
    factor = float(np.clip((max(value, 1e-12) / aim) ** 1.2, 0.1, 10.0))
    return weight * factor
