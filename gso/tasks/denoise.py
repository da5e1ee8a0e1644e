"""Remove noise, with an amount of smoothing estimated from the noisy data alone.

Grids are smoothed in closed form and other meshes by sparse solves; see
:mod:`gso.smoothing` for the methods and their sources. If there are constraints, one more
stage finds the smallest and smoothest change that satisfies them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso.mesh import Mesh
from gso.smoothing import smooth_grid, smooth_mesh
from gso.status import Status
from gso.tasks import constrained
from gso.tasks.base import Analysis, Formulation, Plan, Task
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the denoise task.

    Attributes
    ----------
    order : int or None
        Order of the penalised differences; chosen from the data when None.
    weight : float or None
        Amount of smoothing, dimensionless; chosen from the data when None. The value used is in
        the result's `details`; pass it, or a multiple of it, to repeat or vary the smoothing. On
        grids with None, `details` has the weight of the plain smoother of that order with the
        same degrees of freedom.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {"fast": {}, "balanced": {}, "accurate": {}}

    order: int | None = None
    weight: float | None = None


def plan(analysis: Analysis, request: Request[Options]) -> Plan:
    """Smooth the surface, unless a start is given, and plan a stage for the constraints if any."""
    mesh, options = analysis.mesh, request.options
    if request.x0 is None:
        points, details = _smooth(mesh, request)
    else:
        points, details = request.x0, {}
    points = np.where(mesh.used[:, None], points, mesh.vertices)
    free = analysis.constraints.empty
    return Plan(
        Layout.of(len(points), "surface"),
        points.ravel(),
        [] if free else [constrained.approach(analysis, points, iterations=options.iterations)],
        status=Status.CONVERGED if free else None,
        details=details,
    )


def _smooth(mesh: Mesh, request: Request[Options]) -> tuple[Array, dict[str, float]]:
    """Compute smoothed vertices (n, 3), and the order, weight, sigma and degrees of freedom."""
    order, weight = request.options.order, request.options.weight
    norm = "l1" if request.formulation == "crease" else "l2"
    if mesh.grid is not None:
        smoothed = smooth_grid(mesh.grid, order=order, weight=weight, norm=norm)
    else:
        smoothed = smooth_mesh(mesh, order=order, weight=weight, norm=norm)
    names = ("order", "weight", "sigma", "dof")
    return smoothed.points.reshape(-1, 3), {name: getattr(smoothed, name) for name in names}


def metrics(before: Mesh, after: Mesh, flat: None, scale: float) -> dict[str, float]:
    """Compute how much the surface changed, and the roughness of the result over the input's."""
    rms, largest = measure.displacement(before, after)
    return {
        "roughness_ratio": measure.fairness_ratio(before, after),
        "normal_change": measure.normal_angle(before, after),
        "displacement_rms": rms,
        "displacement_max": largest,
        "loss_gc_before": measure.loss_gc(before, scale=scale),
        "loss_gc": measure.loss_gc(after, scale=scale),
    }


TASK = Task(
    {"smooth": Formulation(Options, plan), "crease": Formulation(Options, plan)},
    metrics,
    lengths=("sigma",),
)
