"""Searches of the developable task: bounds on distance, on curvature and on strain.

Each searches over the weight of the terms that make a surface developable. The smallest weight
that meets the bound gives the smallest displacement.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gso import metrics, parametrization
from gso.energy import Weighted, proximity
from gso.energy.losses import Beyond
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.status import Status
from gso.tasks.base import Analysis, Runner, Solution
from gso.tasks.base import Options as BaseOptions
from gso.tasks.developable import joint_isometry
from gso.tasks.developable.objective import BOUNDED
from gso.tasks.developable.options import DEVELOPABLE, NEAR, Options
from gso.tasks.developable.target import (
    PROGRESS,
    SearchRequest,
    of_curvature,
    of_strain,
    reach,
    strain_of,
)
from gso.tasks.request import Request

R = TypeVar("R", bound=Request[BaseOptions])

#: Weights tried in turn within a bound, until the strain is small enough.
_HARDER = (1.0, 6.0, 36.0)
#: Largest distance of a usable result, from a design in the unit ball, whose size is 2.
_USABLE = 2.0 * NEAR
#: Displacement, a little below the usable one, beyond which solves near the design penalise the
#: square of the excess, and the weight of that. And factors on their weights of curvature and
#: fairness, which are tried in turn.
_SOFT, _SOFT_WEIGHT = 0.92 * _USABLE, 100.0
_SOFT_FACTORS = ((1.0, 1.0), (4.0, 3.0), (12.0, 4.0))
#: Factor on the elongation in a solve by isometry near the design: its iterations end before a
#: boundary that has grown is short again.
_BORDERS = 3.0


def search(run: Runner, request: SearchRequest) -> Solution:
    """Search for a result within given limits.

    If a bound on distance or strain is missed, "isometry" is tried too where the user did not
    name the formulation. A surface that strains little enough but is too far away to be usable is
    solved again within the usable distance.

    Parameters
    ----------
    run : Runner
        Solves requests.
    request : Request
        The request, in the solver's frame.
    """
    analysis, limits = run.analysis, request.limits
    bound, strain = limits.max_deviation, limits.max_strain
    request = _with_usable_start(run, request)
    if limits.target_curvature is not None:
        return reach(run, request, of_curvature(analysis, limits.target_curvature))[0]

    def attempt(request: SearchRequest) -> tuple[Solution, bool]:
        if bound is None:
            return reach(run, request, of_strain(run, strain or DEVELOPABLE))
        return stay_within(run, request, bound, strain)

    best, met = attempt(request)
    other = None if met else _by_isometry(analysis, request)
    if other is not None:
        solution, met = attempt(other)
        if met or _strain_left(run, solution) < _strain_left(run, best):
            best = solution
    if bound is None and met and _distance(analysis, best) > _USABLE:
        limit = of_strain(run, strain or DEVELOPABLE)
        solution, met = reach(run, replace(request, max_displacement=_USABLE), limit)
        if met:
            best = _with_end_of(solution, best)
    return best


def _with_usable_start(run: Runner, request: R) -> R:
    """Return the request, without its start where that is not to be used."""
    bound = request.limits.max_deviation
    bounded = [] if bound is None else [replace(request, max_displacement=bound)]
    return request if run.usable_start(*bounded, request) else replace(request, x0=None)


def _by_isometry(analysis: Analysis, request: SearchRequest) -> SearchRequest | None:
    """Return a request for "isometry", if it is applicable.

    It is where the user did not name the formulation, for meshes that can be flattened, without
    hard constraints, B-splines or options of another formulation than "curvature".
    """
    options = request.options
    usual = type(options) is Options and options.variables != "surface"
    hard = any(part.hard for part in analysis.constraints.parts)
    if request.formulation_given or not usual or hard:
        return None
    if not parametrization.flattens(analysis.mesh):
        return None
    other = request.with_options(joint_isometry.Options())
    return replace(other, formulation="isometry", x0=None)


def _strain_left(run: Runner, solution: Solution) -> float:
    """Return the largest strain of a solution's flat pattern; infinity if it has no pattern."""
    if not parametrization.flattens(run.analysis.mesh):
        return np.inf
    return strain_of(run, solution.points)


def near_design(
    analysis: Analysis, request: SearchRequest, strained: bool
) -> Iterator[SearchRequest]:
    """Yield requests whose results stay near the design, for where one without limits does not.

    First by the same formulation. On grids, displacements beyond the bound are penalised, with
    growing weights of curvature and fairness, which leaves the surface smoother than a hard bound.
    On other meshes, where rounding grows in these solves, the bound is hard. Both begin with the
    same weights, unless the result was `strained`. Then the bound is hard, with its usual weights.
    Then, for "isometry", by that of the surface it starts from, and else by "isometry", if the user
    did not name one and did not ask for a fast solve, without the bound first. There are none with
    constraints, B-splines or the settings of a reference.
    """
    options = request.options
    reference = isinstance(options, joint_isometry.Options) and options.begin == "design"
    if reference or options.variables == "surface" or not analysis.constraints.empty:
        return
    near = replace(request, x0=None, max_displacement=_USABLE)
    if isinstance(options, Options) and analysis.mesh.grid_index is not None:
        soft = replace(request, x0=None, terms=(*request.terms, _beyond))
        for curvature, fairness in _SOFT_FACTORS[strained:]:
            smoother = replace(options, w_fairness=fairness * options.w_fairness)
            factor = curvature * request.weight_factor
            yield replace(soft.with_options(smoother), weight_factor=factor)
    elif isinstance(options, Options) and not strained:
        curvature, fairness, closeness = BOUNDED
        same = replace(
            options,
            w_fairness=options.w_fairness / fairness,
            w_proximity=options.w_proximity / closeness,
        )
        factor = request.weight_factor / curvature
        yield replace(near.with_options(same), weight_factor=factor)
    yield _with_borders(near)
    if isinstance(options, joint_isometry.Options):
        yield replace(near.with_options(Options()), formulation="curvature")
        return
    other = _by_isometry(analysis, near)
    if other is not None and options.iterations >= Options().iterations:
        # Without bounds the solve comes closer to a minimum in as many iterations, and therefore to
        # the same surface from a design and its copies.
        yield _with_borders(replace(other, max_displacement=None))
        yield _with_borders(other)


def _beyond(mesh: Mesh) -> list[Weighted]:
    """Build the term against displacements beyond the soft bound."""
    moved = proximity.build(mesh, vertex_normals(mesh))
    return [Weighted(replace(moved, name="beyond the distance"), _SOFT_WEIGHT, Beyond(_SOFT))]


def _with_borders(request: SearchRequest) -> SearchRequest:
    """Return a request that keeps the lengths of boundaries more, if it is one by isometry."""
    options = request.options
    if not isinstance(options, joint_isometry.Options):
        return request
    return request.with_options(replace(options, w_elongation=_BORDERS * options.w_elongation))


def stay_within(
    run: Runner, request: SearchRequest, bound: float, strain: float | None
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
    best: Solution | None = None
    least = np.inf
    for weight in _HARDER:
        solution = run(replace(request, max_displacement=bound, weight_factor=weight))
        if solution.status in (Status.ALREADY_GOOD, Status.CANCELLED):
            return _with_end_of(best or solution, solution), True
        value = limit.value(solution.points)
        if best is not None and not value < PROGRESS * least:
            break
        best, least = solution, value
        if limit.met(value):
            break
    free = run(request)
    if free.status is Status.CANCELLED:
        return _with_end_of(best or free, free), True
    if _distance(run.analysis, free) <= bound:
        value = limit.value(free.points)
        if value < least:
            best, least = free, value
    return best or free, limit.met(least)


def _with_end_of(best: Solution, last: Solution) -> Solution:
    """Return the best solution, which is cancelled if the last one is."""
    if last.status is Status.CANCELLED:
        best.status = Status.CANCELLED
    return best


def _distance(analysis: Analysis, solution: Solution) -> float:
    """Return the largest distance between the design and a solution, in both directions."""
    return metrics.largest_distance(analysis.mesh, analysis.mesh.replaced(solution.points))
