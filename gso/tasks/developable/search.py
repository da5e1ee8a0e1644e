"""Searches of the developable task: bounds on distance, on curvature and on strain.

Each searches over the weight of the terms that make a surface developable. The smallest weight
that meets the bound gives the smallest displacement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from gso import metrics, parametrization
from gso.components import average, several
from gso.errors import MeshError, OptionError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.status import Status
from gso.tasks.base import Analysis, Request, Runner, Solution
from gso.tasks.developable import isometry
from gso.tasks.developable.options import DEVELOPABLE, Options
from gso.tasks.evaluation import largest_strain
from gso.typing import Array

#: Curvature threshold above the curvature of every design.
_ANY = 1e300
#: Largest numbers of solves in one search, and of bisection steps between two of its results.
_SOLVES = 10
_BLENDS = 25
#: Range of weights in a search. Beyond it fairness has no effect, and surfaces crumple.
_RANGE = (1e-2, 1e3)
#: A solve that leaves more than this share of the value makes no progress. A search in which no
#: result meets the demand stops after `_OBSTACLES` such solves in a row.
_PROGRESS = 0.98
_OBSTACLES = 3
#: Weights tried in turn within a bound, until the strain is small enough.
_HARDER = (1.0, 6.0, 36.0)
_ITERATIONS = 25
_COARSE_ITERATIONS = 15
#: Largest displacement of a vertex, in the unit ball, that a search accepts.
FARTHEST = 0.25


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


@dataclass
class Bound:
    """An upper bound on a measure of the surface.

    Attributes
    ----------
    value : callable
        Measure of a surface (n, 3), in the frame of the request.
    target : float
        Its upper bound.
    close : float
        Relative distance below the target within which a value counts as close to it.
    """

    value: Callable[[Array], float]
    target: float
    close: float

    @property
    def aim(self) -> float:
        """Value that the next weight is chosen to reach."""
        return (1.0 - 0.5 * self.close) * self.target

    def met(self, value: float) -> bool:
        """Return whether a value is at most the target."""
        return value <= self.target

    def near(self, value: float) -> bool:
        """Return whether a value meets the target and is close to it."""
        return (1.0 - self.close) * self.target <= value <= self.target


def of_curvature(analysis: Analysis, target: float) -> Bound:
    """Bound ``loss_gc_worst`` by `target`, reached within 5 %."""

    def value(points: Array) -> float:
        return curved(analysis.mesh, points)

    return Bound(value, target, 0.05)


def curved(mesh: Mesh, points: Array) -> float:
    """Return ``loss_gc_worst`` of a surface (n, 3) in the unit ball.

    Several components are averaged by area, each measured by its own size.
    """
    after = mesh.replaced(points)
    if not several(mesh):
        return metrics.loss_gc_worst(after, scale=1.0)
    return float(average(lambda a, b: metrics.loss_gc_worst(b, scale=metrics.unit(a)), mesh, after))


def of_strain(run: Runner, target: float) -> Bound:
    """Bound the largest strain of the flat pattern by `target`, reached within 10 %."""
    return Bound(partial(_strain, run), target, 0.1)


def _pattern(run: Runner, points: Array) -> Pattern:
    """Return the flat pattern of a surface (n, 3) on the faces of the design."""
    found = run.lay_out(run.analysis.mesh.replaced(points))
    if found is None:
        raise MeshError(
            "max_strain needs a surface that can be laid out, every component with a boundary and "
            "without handles: cut it open along edges first"
        )
    return found


def _strain(run: Runner, points: Array) -> float:
    surface = run.analysis.mesh.replaced(points)
    return largest_strain(surface, _pattern(run, points))


def _strain_left(run: Runner, solution: Solution) -> float:
    """Return the largest strain of a solution's flat pattern; infinity if it has no pattern."""
    if not parametrization.flattens(run.analysis.mesh):
        return np.inf
    return _strain(run, solution.points)


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
        if best is not None and not value < _PROGRESS * least:
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
    found = metrics.surface_distance(analysis.mesh, analysis.mesh.replaced(solution.points))
    return max(found.there_max, found.back_max)


def reach(run: Runner, request: Request, bound: Bound) -> tuple[Solution, bool]:
    """Search for the weight that just meets a bound.

    The value falls with the weight, but not monotonically. The search is a regula falsi on
    logarithms; each solve starts from the last one that missed, unless that made no progress.
    If no result is close enough to the target, the surface is interpolated between the best
    result that meets the bound and the one with the least value that misses it (or the
    design). Results farther than `FARTHEST` from the design are not accepted.

    Returns
    -------
    solution, met
        Whether the bound is met, or the search was cancelled.
    """
    design = run.analysis.mesh.vertices
    start = bound.value(design)
    free = run.analysis.constraints.empty
    if bound.met(start) and free:
        options = replace(request.options, developable_below=_ANY)
        return run(replace(request, options=options, start=None)), True
    found = _Found(run, bound)
    if free:
        found.missed = (design, start)
    weighed = replace(request, options=_patient(request.options))
    weight, low, high = 1.0, 0.0, np.inf
    value_low = value_high = np.nan
    last, least, obstacles = None, np.inf, 0
    for _ in range(_SOLVES):
        last = run(replace(weighed, weight_factor=weight))
        if last.status is Status.CANCELLED:
            break
        value = bound.value(last.points)
        last.details = {**last.details, "weight factor": weight}
        far = found.add(last, value)
        if bound.near(value) and not far:
            break
        if bound.met(value) or far:
            high, value_high = weight, value
        else:
            stuck = value > _PROGRESS * value_low
            low, value_low = weight, value
            # Lost curvature or strain returns slowly: continue from a result that has more.
            # Where more weight changes nothing, begin again from the request's start.
            weighed = replace(weighed, start=request.start if stuck else last.points)
        obstacles = 0 if value < _PROGRESS * least else obstacles + 1
        least = min(least, value)
        if found.best is None and obstacles == _OBSTACLES:
            break
        if not _RANGE[0] < weight < _RANGE[1] or (np.isfinite(high) and high < 1.02 * low):
            break
        weight = _next(weight, value, bound.aim, low, high, value_low, value_high)
    chosen = found.chosen(last)
    return chosen, chosen.status is not Status.TARGET_MISSED


@dataclass
class _Found:
    """The best results of a search so far.

    `best` meets the bound with the least mean displacement, `missed` is the surface with the
    least value that misses it (the design at first), `closest` the solution with that value.
    """

    run: Runner
    bound: Bound
    best: Any = None
    value: float = np.inf
    moved: float = np.inf
    missed: tuple[Array, float] | None = None
    closest: tuple[Any, float] = field(default=(None, np.inf))

    def add(self, solution: Any, value: float) -> bool:
        """Record a result; return whether it is too far from the design."""
        u = solution.points - self.run.analysis.mesh.vertices
        moved = float(np.sqrt((u * u).sum(axis=1)).max(initial=0.0))
        if not (np.isfinite(moved) and moved <= FARTHEST):
            return True
        if self.bound.met(value):
            mean = float(np.abs(u).mean())
            if mean < self.moved:
                self.best, self.value, self.moved = solution, value, mean
        else:
            if self.missed is None or value < self.missed[1]:
                self.missed = (solution.points, value)
            if value < self.closest[1]:
                self.closest = (solution, value)
        return False

    def chosen(self, last: Any) -> Any:
        """Return the best result, with its status."""
        best = self.best
        if best is None:
            best = self.closest[0] or last
            status = Status.TARGET_MISSED
        else:
            status = Status.TARGET_REACHED
            if not self.bound.near(self.value):
                best = self._blended(best)
        best.status = Status.CANCELLED if last.status is Status.CANCELLED else status
        return best

    def _blended(self, solution: Solution) -> Solution:
        """Return a solution moved towards the surface that missed, as far as the bound allows."""
        linear = not any(part.hard for part in self.run.analysis.constraints.parts)
        if self.missed is None or solution.spline is not None or not linear:
            return solution
        far, near = self.missed[0], solution.points
        low, high = 0.0, 1.0
        for _ in range(_BLENDS):
            share = 0.5 * (low + high)
            value = self.bound.value(far + share * (near - far))
            if self.bound.met(value):
                high = share
                if self.bound.near(value):
                    break
            else:
                low = share
        if high == 1.0:
            return solution
        points = far + high * (near - far)
        blocks = {"surface": points}
        if "flat" in solution.blocks:
            blocks["flat"] = _pattern(self.run, points).flat
        return self.run.moved(solution, blocks)


def _patient(options: Any) -> Any:
    """Return options with enough iterations and, except for B-splines, free vertices."""
    if not hasattr(options, "coarse_iterations"):
        return options
    changes: dict[str, Any] = {
        "iterations": max(options.iterations, _ITERATIONS),
        "coarse_iterations": max(options.coarse_iterations, _COARSE_ITERATIONS),
    }
    if options.variables != "surface":
        changes["variables"] = "free"
    return replace(options, **changes)


def _next(
    weight: float,
    value: float,
    aim: float,
    low: float,
    high: float,
    value_low: float,
    value_high: float,
) -> float:
    """Choose the next weight: regula falsi in logarithms in a bracket, a power law outside."""
    if low > 0 and np.isfinite(high):
        a, b = np.log(low), np.log(high)
        share = (np.log(value_low) - np.log(aim)) / max(
            np.log(value_low) - np.log(max(value_high, 1e-12)), 1e-12
        )
        return float(np.exp(a + np.clip(share, 0.1, 0.9) * (b - a)))
    factor = float(np.clip((max(value, 1e-12) / aim) ** 1.2, 0.1, 10.0))
    return weight * (min(factor, 0.5) if np.isfinite(high) else max(factor, 1.5))
