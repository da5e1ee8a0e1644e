"""Make a surface developable, by its curvature or by isometry to its flat image."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from gso.tasks.base import Formulation, Plan, Task
from gso.tasks.developable import joint_isometry, schedule
from gso.tasks.developable.analysis import Analysis
from gso.tasks.developable.bound_search import near_design, search
from gso.tasks.developable.developable_metrics import flat_metrics, metrics
from gso.tasks.developable.options import NEAR, SHEET, Options
from gso.tasks.request import Request
from gso.unknowns import ALONG

__all__ = ["NEAR", "SHEET", "TASK", "Options"]

#: Settings of the surface that a solve by isometry starts from. That solve closes holes by itself,
#: and farther from the design it would have less room to.
_START = Options(w_holes=0.02)


def _before_isometry(analysis: Analysis, request: Request[joint_isometry.Options]) -> Plan:
    """Plan the curvature solve whose result the solve by isometry starts from."""
    bound = request.max_displacement
    # The box bounds of the solve by isometry cover only part of the ball around a vertex.
    bound = None if bound is None else 0.99 * ALONG * bound
    begun = replace(request.with_options(_START), max_displacement=bound)
    return schedule.plan(analysis, begun)


def _curvature(request: Request[joint_isometry.Options]) -> Request[Options] | None:
    """Return the request for the usual surface, which a solve by isometry from it improves."""
    o = request.options
    if request.x0 is not None or o.begin != "curvature" or o.variables == "surface":
        return None
    usual = request.with_options(Options())
    return replace(usual, formulation="curvature", formulation_given=False)


TASK = Task(
    {
        "curvature": Formulation(
            Options,
            schedule.plan,
            limits=("max_deviation", "max_strain", "target_curvature"),
            search=search,
            terms=True,
        ),
        "isometry": Formulation(
            joint_isometry.Options,
            partial(joint_isometry.plan, curvature=_before_isometry),
            presets=("jiang2020",),
            limits=("max_deviation", "max_strain"),
            search=search,
            before=_curvature,
        ),
    },
    metrics,
    analysis=Analysis,
    pattern_metrics=flat_metrics,
    others=near_design,
)
