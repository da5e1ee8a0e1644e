"""Make a surface developable, by its curvature or by isometry to its flat image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from gso.tasks.base import Plan, Request
from gso.tasks.developable import joint_isometry, schedule
from gso.tasks.developable.analysis import Analysis
from gso.tasks.developable.bound_search import check_bounds, check_iterations, search
from gso.tasks.developable.developable_metrics import flat_metrics, metrics
from gso.tasks.developable.options import Options
from gso.unknowns import ALONG

__all__ = [
    "FORMULATIONS",
    "IMPLIES",
    "OPTIONS",
    "Analysis",
    "Options",
    "check_bounds",
    "check_iterations",
    "flat_metrics",
    "metrics",
    "plan",
    "search",
]

#: The formulation that a preset belongs to.
IMPLIES = {"jiang2020": "isometry"}
#: Settings by formulation.
OPTIONS = {"curvature": Options, "isometry": joint_isometry.Options}


def plan(analysis: Analysis, request: Request) -> Plan:
    """Plan the stages of the solve."""
    return _PLANS[request.formulation](analysis, request)


def _before_isometry(analysis: Analysis, request: Request) -> Plan:
    """Plan the curvature solve whose result the solve by isometry starts from."""
    bound = request.max_displacement
    # The box bounds of the solve by isometry cover only part of the ball around a vertex.
    bound = None if bound is None else 0.99 * ALONG * bound
    return schedule.plan(analysis, replace(request, options=Options(), max_displacement=bound))


#: How each formulation is planned; the first is the default.
_PLANS: dict[str, Callable[[Analysis, Request], Plan]] = {
    "curvature": schedule.plan,
    "isometry": partial(joint_isometry.plan, curvature=_before_isometry),
}
FORMULATIONS = tuple(_PLANS)
