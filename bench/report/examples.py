"""Results for the figures: some surfaces of different curvature, by several methods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from harness import quietly

from gso.linalg import blas_threads
from gso.metrics import loss_gc
from report.method import TASKS, Array, Method, level_name
from report.methods import of
from report.quality import levels
from report.settings import Settings
from report.store import Store
from report.surfaces import Case, Surfaces

#: Methods in the figures, by task; those that cannot run are left out.
DRAWN = {
    "developable": ("TNO jiang2020", "TNO balanced", "Net-S", "Net-C", "Net-CF", "Net", "hybrid"),
    "flatten": ("Init", "TNO lengths", "TNO strain", "Net", "Net-W", "Net strain", "libigl ARAP"),
    "denoise": ("TNO", "Net"),
}
#: Number of surfaces among which the examples are chosen.
_AMONG = 64


@dataclass
class Example:
    """A case, its number in the set, and the results by method."""

    case: Case
    number: int
    results: dict[str, Array] = field(default_factory=dict)


#: By task and level of the noise.
Examples = dict[tuple[str, float], list[Example]]


def chosen(settings: Settings, surfaces: Surfaces) -> list[int]:
    """Return the surfaces whose mean curvature is nearest to the values in the settings."""
    among = min(_AMONG, len(surfaces))
    curved = np.array([loss_gc(surfaces[k], scale=1.0) for k in range(among)])
    return [int(np.abs(curved - wanted).argmin()) for wanted in settings.examples]


def solved(
    settings: Settings, surfaces: Surfaces, kept: Store, tick: Callable[..., None]
) -> Examples:
    """Solve the examples, by task and level of the noise."""
    found: Examples = {}
    with blas_threads(1):
        for task in TASKS:
            # The figure of denoising shows one surface, with a row for each level.
            some = chosen(settings, surfaces)[: 1 if task == "denoise" else None]
            for sigma in levels(task):
                found[task, sigma] = [_example(surfaces, k, task, sigma, kept) for k in some]
            tick(task)
    return found


def _example(surfaces: Surfaces, k: int, task: str, sigma: float, kept: Store) -> Example:
    example = Example(surfaces.case(k, sigma), k)
    methods = {name: of(task, name) for name in DRAWN[task]}
    for name, method in methods.items():
        if not method.absent():
            place = f"examples/{task}-{name}-{level_name(sigma)}".replace(" ", "-")
            key = method.key(sigma) | {"surfaces": surfaces.key, "number": k}
            make = partial(_points, method, example.case)
            points = quietly(kept.arrays, place, key, make)["points"]
            example.results |= {name: points} if points.size else {}
    return example


def _points(method: Method, case: Case) -> dict[str, Array]:
    """Return the points to draw; none where a method fails, which its table row reports."""
    try:
        return {"points": method(case).points}
    except Exception:  # a peer may raise anything; the others are still drawn
        return {"points": np.empty(0)}
