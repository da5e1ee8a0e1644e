"""Remove noise, the amount of smoothing read off the noisy data alone.

Grids are smoothed in closed form and other meshes by sparse solves; see
:mod:`gso.smoothing` for the methods and their sources. Where there are constraints, the
smallest and smoothest change that satisfies them follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso.mesh import Mesh
from gso.smoothing import smooth_grid, smooth_mesh
from gso.status import OptionError, Status
from gso.tasks import held
from gso.tasks.base import Plan, Request
from gso.tasks.options import Options as BaseOptions
from gso.variables import Layout

FORMULATIONS = ("smooth", "crease")


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the denoise task.

    Attributes
    ----------
    order : int or None
        Order of the differences that are penalised; chosen from the data when None.
    weight : float or None
        Amount of smoothing, dimensionless; chosen from the data when None. The value
        used stands in the result's `details` and can be given back, or a multiple of it.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {"fast": {}, "balanced": {}, "accurate": {}}

    order: int | None = None
    weight: float | None = None


def plan(request: Request) -> Plan:
    """The smoothed surface; what is left to solve is its constraints."""
    mesh, options = request.mesh, request.options
    if request.start is not None:
        raise OptionError("task 'denoise' has no start to choose; leave x0 out")
    settings = {
        "order": options.order,
        "weight": options.weight,
        "norm": "l1" if request.formulation == "crease" else "l2",
    }
    if mesh.grid is not None:
        smoothed = smooth_grid(mesh.grid, **settings)
    else:
        smoothed = smooth_mesh(mesh.vertices, mesh.faces, **settings)
    points = smoothed.points.reshape(-1, 3)
    points = np.where(mesh.used[:, None], points, mesh.vertices)
    bound = not request.constraints.empty
    stages = [held.approach(request, points, iterations=options.iterations)] if bound else []
    return Plan(
        Layout.of(len(points), "surface"),
        points.ravel(),
        stages,
        status=None if bound else Status.CONVERGED,
        details={
            "order": smoothed.order,
            "weight": smoothed.weight,
            "sigma": smoothed.sigma,
            "dof": smoothed.dof,
        },
    )


def metrics(before: Mesh, after: Mesh, flat: None, scale: float) -> dict[str, float]:
    """How much the surface changed, and how much rougher the input was."""
    rough = measure.fairness(before, scale=scale)
    moved = np.linalg.norm((after.vertices - before.vertices)[before.used], axis=1)
    return {
        "theta": measure.normal_angle(before, after),
        "displacement_rms": 100.0 * float(np.sqrt((moved**2).mean())) / before.diagonal,
        "displacement_max": 100.0 * float(moved.max()) / before.diagonal,
        "roughness_ratio": measure.fairness(after, scale=scale) / rough if rough > 0 else 1.0,
        "loss_gc_before": measure.loss_gc(before, scale=scale),
        "loss_gc": measure.loss_gc(after, scale=scale),
    }
