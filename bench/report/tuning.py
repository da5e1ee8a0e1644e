"""The choice of the peers' parameters, on surfaces that are not part of the report."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from harness import quietly

from gso import metrics
from report import store
from report.method import TUNED, Array, Method, level_name, tuned
from report.methods import methods
from report.quality import levels
from report.store import Store
from report.surfaces import Case, Surfaces

#: Metric by which the parameters are chosen; lower is better.
_SCORE: dict[str, Callable[[Case, Array], float]] = {
    "developable": lambda case, points: metrics.loss_gc_worst(points),
    "denoise": lambda case, points: metrics.normal_angle(case.surface, points),
}
#: Share of the input's score below which a result counts as an improvement.
_LESS = 0.999
#: Number of surfaces for the choice.
COUNT = 8


def tune(surfaces: Surfaces, kept: Store, command: str, tick: Callable[..., None]) -> None:
    """Choose parameters by task, method and level of the noise, and write ``tuned.json``."""
    values: dict[str, Any] = copy.deepcopy(tuned())
    count = min(COUNT, len(surfaces))
    for method in (m for m in methods().values() if m.candidates and not m.missing()):
        for sigma in levels(method.task):
            own = values.setdefault(method.task, {}).setdefault(method.name, {})
            key = {
                "candidates": method.candidates,
                "packages": store.installed(method.needs),
                "surfaces": [surfaces.key, count],
                "files": store.source(*method.files),
            }
            place = f"tuning/{method.name}-{level_name(sigma)}".replace(" ", "-")
            best = partial(_best, method, surfaces, count, sigma)
            own[level_name(sigma)] = kept.value(place, key, best)
            tick(f"{method.name} {level_name(sigma)}")
    found = {"command": command, "surfaces": f"first {count}, {surfaces.name}", "values": values}
    TUNED.write_text(json.dumps(found, indent=1) + "\n")


def _best(method: Method, surfaces: Surfaces, count: int, sigma: float) -> dict[str, Any] | None:
    """Return the best parameters, or None if no result is better than the input."""
    cases = [surfaces.case(k, sigma) for k in range(count)]
    untouched = np.mean([_SCORE[method.task](case, case.given) for case in cases])
    scores = []
    for parameters in method.candidates:
        # SciPy's splines warn where they could not smooth as much as requested.
        results = [quietly(method.run, case, **parameters).points for case in cases]
        finite = all(np.isfinite(points).all() for points in results)
        found = [_SCORE[method.task](case, p) for case, p in zip(cases, results) if finite]
        scores.append(np.mean(found) if finite else np.inf)
    worth = min(scores) < _LESS * untouched
    return method.candidates[int(np.argmin(scores))] if worth else None
