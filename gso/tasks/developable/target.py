"""Search for the weight that just meets a bound on curvature or strain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from gso import metrics
from gso.components import average, several
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.status import Status
from gso.tasks.base import Analysis, Runner, Solution
from gso.tasks.developable import joint_isometry
from gso.tasks.developable.options import Options
from gso.tasks.evaluation import largest_strain
from gso.tasks.request import Request
from gso.typing import Array

#: Requests of the formulations whose weights are searched.
SearchRequest: TypeAlias = Request["Options | joint_isometry.Options"]

#: Curvature threshold above the curvature of every design.
_ANY = 1e300
#: Largest numbers of solves in one search, and of bisection steps between two of its results.
_SOLVES = 10
_BLENDS = 25
#: Ratio of the weights that meet and that miss a bound, below which a search ends; the second where
#: its result is not interpolated between theirs.
_BRACKET, _NARROW = 1.12, 1.02
#: Outside of a bracket, the logarithm of the factor for the weight, relative to that of the value
#: over the target: for more weight, and for less. Factors change a weight by at least the last.
_MORE, _LESS, _LEAST = 1.2, 0.85, 1.1
#: Range of weights in a search. Beyond it fairness has no effect, and surfaces crumple.
_RANGE = (1e-2, 1e3)
#: A solve that leaves more than this share of the value makes no progress. A search in which no
#: result meets the demand stops after `_OBSTACLES` such solves in a row.
PROGRESS = 0.98
_OBSTACLES = 3
_ITERATIONS = 25
_COARSE_ITERATIONS = 15
#: Largest displacement of a vertex, in the unit ball, that a search accepts.
FARTHEST = 0.25


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
        return curvature_of(analysis.mesh, points)

    return Bound(value, target, 0.05)


def curvature_of(mesh: Mesh, points: Array) -> float:
    """Return ``loss_gc_worst`` of a surface (n, 3) in the unit ball.

    Several components are averaged by area, each measured by its own size.
    """
    after = mesh.replaced(points)
    if not several(mesh):
        return metrics.loss_gc_worst(after, scale=1.0)
    return float(average(lambda a, b: metrics.loss_gc_worst(b, scale=metrics.unit(a)), mesh, after))


def of_strain(run: Runner, target: float) -> Bound:
    """Bound the largest strain of the flat pattern by `target`, reached within 10 %."""
    return Bound(partial(strain_of, run), target, 0.1)


def _pattern(run: Runner, points: Array) -> Pattern:
    """Return the flat pattern of a surface (n, 3) on the faces of the design."""
    found = run.lay_out(run.analysis.mesh.replaced(points))
    if found is None:
        raise MeshError(
            "max_strain needs a surface that can be laid out, every component with a boundary and "
            "without handles: cut it open along edges first"
        )
    return found


def strain_of(run: Runner, points: Array) -> float:
    surface = run.analysis.mesh.replaced(points)
    return largest_strain(surface, _pattern(run, points))


def reach(run: Runner, request: SearchRequest, bound: Bound) -> tuple[Solution, bool]:
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
        return run(replace(request, options=options, x0=None)), True
    found = _Found(run, bound)
    if free:
        found.missed = (design, start)
    weighed = replace(request, options=_patient(request.options))
    weight, low, high = 1.0, 0.0, np.inf
    value_low = value_high = np.nan
    least, obstacles = np.inf, 0
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
            stuck = value > PROGRESS * value_low
            low, value_low = weight, value
            # Lost curvature or strain returns slowly: continue from a result that has more.
            # Where more weight changes nothing, begin again from the request's start.
            weighed = replace(weighed, x0=request.x0 if stuck else last.points)
        obstacles = 0 if value < PROGRESS * least else obstacles + 1
        least = min(least, value)
        if found.best is None and obstacles == _OBSTACLES:
            break
        narrow = _BRACKET if found.interpolates(last) else _NARROW
        if not _RANGE[0] < weight < _RANGE[1] or (np.isfinite(high) and high < narrow * low):
            break
        weight = _next(weight, value, bound.aim, low, high, value_low, value_high)
    chosen = found.choose(last)
    return chosen, chosen.status is not Status.TARGET_MISSED


@dataclass
class _Found:
    """The best results of a search so far.

    `best` meets the bound with the least mean displacement, `missed` is the surface with the
    least value that misses it (the design at first), `closest` the solution with that value.
    """

    run: Runner
    bound: Bound
    best: Solution | None = None
    value: float = np.inf
    displacement: float = np.inf
    missed: tuple[Array, float] | None = None
    closest: tuple[Solution | None, float] = (None, np.inf)

    def add(self, solution: Solution, value: float) -> bool:
        """Record a result; return whether it is too far from the design."""
        u = solution.points - self.run.analysis.mesh.vertices
        far = float(np.sqrt((u * u).sum(axis=1)).max(initial=0.0))
        if not (np.isfinite(far) and far <= FARTHEST):
            return True
        if self.bound.met(value):
            mean = float(np.abs(u).mean())
            if mean < self.displacement:
                self.best, self.value, self.displacement = solution, value, mean
        else:
            if self.missed is None or value < self.missed[1]:
                self.missed = (solution.points, value)
            if value < self.closest[1]:
                self.closest = (solution, value)
        return False

    def choose(self, last: Solution) -> Solution:
        """Return the best result, with its status."""
        best = self.best
        if best is None:
            best = self.closest[0] or last
            status = Status.TARGET_MISSED
        else:
            status = Status.TARGET_REACHED
            if not self.bound.near(self.value):
                best = self._blend(best)
        best.status = Status.CANCELLED if last.status is Status.CANCELLED else status
        return best

    def interpolates(self, solution: Solution) -> bool:
        """Return whether surfaces between a solution and another one are results, too."""
        hard = any(part.hard for part in self.run.analysis.constraints.parts)
        return solution.spline is None and not hard

    def _blend(self, solution: Solution) -> Solution:
        """Return a solution moved towards the surface that missed, as far as the bound allows."""
        if self.missed is None or not self.interpolates(solution):
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
        return self.run.evaluate(solution, blocks)


def _patient(options: Options | joint_isometry.Options) -> Options | joint_isometry.Options:
    """Return options with enough iterations and, except for B-splines, free vertices."""
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
    less = np.isfinite(high)
    factor = float(np.clip((max(value, 1e-12) / aim) ** (_LESS if less else _MORE), 0.1, 10.0))
    return weight * (min(factor, 1.0 / _LEAST) if less else max(factor, _LEAST))
