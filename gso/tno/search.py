"""The smallest curvature weight that reaches a target."""

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


def reach_target(run: Callable[[Request], Any], request: Request, target: float) -> Any:
    """Solve with growing or falling curvature weight until ``loss_gc`` is just below `target`.

    Mean |K| falls steadily with the weight, so the smallest displacement that meets the
    target belongs to the smallest weight that does: a secant search on their logarithms,
    every solve started from the one before.
    """
    if metrics.loss_gc(request.mesh, scale=1.0) <= target and request.constraints.empty:
        request = replace(request, options=replace(request.options, developable_below=target))
        return run(request)
    weight, low, high = 1.0, 0.0, np.inf
    value_low = value_high = np.nan
    best = last = None
    for _ in range(_SOLVES):
        last = run(replace(request, curvature_weight=weight))
        moved = request.mesh.replaced(last.points)
        value = metrics.loss_gc(moved, scale=1.0)
        if value <= target:
            best, high, value_high = last, weight, value
            if value >= (1.0 - _CLOSE) * target:
                break
        else:
            low, value_low = weight, value
        if last.status is Status.CANCELLED or not _RANGE[0] < weight < _RANGE[1]:
            break
        weight = _next(weight, value, target, low, high, value_low, value_high)
        request = replace(request, start=last.points)
    chosen = last if best is None else best
    chosen.status = Status.TARGET_MISSED if best is None else Status.TARGET_REACHED
    chosen.details = {**chosen.details, "curvature_weight": weight}
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
