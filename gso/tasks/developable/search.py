"""Searches of the developable task: bounds on distance, on curvature and on strain.

Each searches over the weight of the terms that make a surface developable. The smallest weight
that meets the bound gives the smallest displacement.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gso import metrics, parametrization
from gso.errors import OptionError
from gso.status import Status
from gso.tasks.base import Analysis, Request, Runner, Solution
from gso.tasks.developable import isometry
from gso.tasks.developable.options import DEVELOPABLE, Options
from gso.tasks.developable.target import PROGRESS, of_curvature, of_strain, reach, strain_of

#: Weights tried in turn within a bound, until the strain is small enough.
_HARDER = (1.0, 6.0, 36.0)

#: Formulations that search themselves: "ruled" for the number of strips; it has no strain.
_OWN = ("ruled",)


def check_bounds(formulation: str, bounds: dict[str, float | None]) -> None:
    """Raise an OptionError if bounds contradict each other or the formulation."""
    if bounds["target_curvature"] is None:
        return
    if formulation != "curvature":
        raise OptionError(
            f"target_curvature belongs to the formulation 'curvature', not {formulation!r}"
        )
    for name in ("max_deviation", "max_strain"):
        if bounds[name] is not None:
            raise OptionError(f"give {name} or target_curvature, not both")


def check_iterations(bounds: dict[str, float | None]) -> None:
    """Raise an OptionError if bounds exclude a start with a limit on the iterations."""
    for name in ("target_curvature", "max_strain"):
        if bounds[name] is not None:
            raise OptionError(
                f"{name} takes many solves, which the iterations of a start would cut off; "
                "leave one of them out"
            )


def search(
    run: Runner,
    request: Request,
    bounds: dict[str, float | None],
    unit: float,
    *,
    others: bool,
) -> tuple[Solution, str]:
    """Search for a result within given bounds.

    If a bound on distance or strain is missed, "isometry" is tried too where that is allowed.

    Parameters
    ----------
    run : Runner
        Solves requests.
    request : Request
        The request without bounds.
    bounds : dict
        "max_deviation" in the user's unit, "max_strain", "target_curvature"; None for none.
    unit : float
        Radius of the unit ball in the user's unit.
    others : bool
        Whether other formulations may be tried.

    Returns
    -------
    solution, formulation
    """
    analysis = run.analysis
    target, strain = bounds["target_curvature"], bounds["max_strain"]
    bound = bounds["max_deviation"]
    bound = None if bound is None else bound / unit
    free = replace(request, max_displacement=None)
    asked = [free] if bound is None else [replace(request, max_displacement=bound), free]
    if not run.usable_start(*asked):
        request = replace(request, start=None)
    if request.formulation in _OWN:
        return run(replace(request, max_displacement=bound)), request.formulation
    if target is not None:
        return reach(run, request, of_curvature(analysis, target))[0], request.formulation
    best: Any = None
    least, formulation = np.inf, request.formulation
    for tried in (request, *(_others(analysis, request) if others else ())):
        if bound is not None:
            solution, met = stay_within(run, tried, bound, strain)
        else:
            solution, met = reach(run, tried, of_strain(run, strain))  # type: ignore[arg-type]
        if best is not None or not met:
            value = _strain_left(run, solution)
        if best is None or met or value < least:
            best, formulation = solution, tried.formulation
        if met:
            break
        least = min(least, value)
    return best, formulation


def _others(analysis: Analysis, request: Request) -> list[Request]:
    """Return a request for "isometry", if it is applicable.

    It is for meshes that can be flattened, without hard constraints, B-splines or options of
    another formulation than "curvature".
    """
    usual = type(request.options) is Options and request.options.variables != "surface"
    hard = any(part.hard for part in analysis.constraints.parts)
    if not usual or hard or not parametrization.flattens(analysis.mesh):
        return []
    return [replace(request, formulation="isometry", options=isometry.Options(), start=None)]


def _strain_left(run: Runner, solution: Solution) -> float:
    """Return the largest strain of a solution's flat pattern; infinity if it has no pattern."""
    if not parametrization.flattens(run.analysis.mesh):
        return np.inf
    return strain_of(run, solution.points)


def stay_within(
    run: Runner, request: Request, bound: float, strain: float | None
) -> tuple[Solution, bool]:
    """Return the most developable result within a bound on the distance to the design.

    Solves with the bound use growing weights, until the largest strain is at most `strain`, or
    `DEVELOPABLE` where it is None. A solve without the bound is tried too, and counts if it
    stays within the bound. Surfaces that cannot be flattened are compared by curvature.

    Returns
    -------
    solution, met
        Whether the search is complete: the limit is met, the design was developable already,
        or the search was cancelled.
    """
    limit = of_strain(run, DEVELOPABLE if strain is None else strain)
    if strain is None and not parametrization.flattens(run.analysis.mesh):
        limit = of_curvature(run.analysis, 0.0)
    best: Any = None
    least = np.inf
    for weight in _HARDER:
        solution = run(replace(request, max_displacement=bound, weight_factor=weight))
        if solution.status in (Status.ALREADY_GOOD, Status.CANCELLED):
            return _cancelled(best or solution, solution), True
        value = limit.value(solution.points)
        if best is not None and not value < PROGRESS * least:
            break
        best, least = solution, value
        if limit.met(value):
            break
    free = run(request)
    if free.status is Status.CANCELLED:
        return _cancelled(best, free), True
    if _distance(run.analysis, free) <= bound and (value := limit.value(free.points)) < least:
        return free, limit.met(value)
    return best, limit.met(least)


def _cancelled(best: Any, last: Any) -> Any:
    if last.status is Status.CANCELLED:
        best.status = Status.CANCELLED
    return best


def _distance(analysis: Analysis, solution: Solution) -> float:
    """Return the largest distance between the design and a solution, in both directions."""
    return metrics.largest_distance(analysis.mesh, analysis.mesh.replaced(solution.points))
