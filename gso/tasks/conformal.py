"""Flatten a surface conformally: preserve its angles.

The objective, on the design scaled to the unit ball, is

    1/2 mean E_conf + w_scale / 2 mean (s - 1)^2 + w_shear / 2 mean |shear|^2

with E_conf the squared differences of squared lengths of Jiang et al. 2020, where those of a
face in space are multiplied by a scale s of that face, a further unknown. A disk has many
conformal maps: the second term selects the one that changes lengths least. The third term, over
the corner triangles, couples the two checkerboard lattices of a quad mesh. The solve starts from
an as-rigid-as-possible image without inverted triangles, which is close to that map, and no step
inverts a triangle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso import parametrization
from gso.constraints import Compiled
from gso.energy import Weighted, congruence, scale, shear
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.tasks import constrained, per_component
from gso.tasks.base import Analysis, Formulation, Plan, Stage, Task
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout, free


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the conformal task.

    Attributes
    ----------
    w_scale : float
        Weight of ``(s - 1)^2``, where s is the factor on a face's squared lengths. The remaining
        angle distortion is about as large as this weight.
    w_shear : float
        Weight of the squared shear of the corner triangles. Much above `w_scale`, the shear term
        dominates the result.
    relax_iterations : int
        Largest number of as-rigid-as-possible (local/global) iterations before the solve.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"iterations": 5, "w_scale": 1e-3, "w_shear": 1e-2},
        "balanced": {},
        "accurate": {"iterations": 100, "tolerance": 1e-10, "w_scale": 1e-6, "w_shear": 1e-5},
    }

    iterations: int = 40
    tolerance: float = 1e-6
    method: str = "levenberg-marquardt"
    w_scale: float = 1e-4
    w_shear: float = 1e-3
    relax_iterations: int = 100

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.w_scale > 0 and self.w_shear > 0):
            raise OptionError(
                "w_scale and w_shear must be positive: without them the map is not determined"
            )


def plan(analysis: Analysis, request: Request[Options]) -> Plan:
    """Plan one stage, from an image without inverted triangles; more under constraints.

    Raises
    ------
    MeshError
        A component is closed or has handles: it must be cut open first.
    """
    options, constraints = request.options, analysis.constraints
    opened = analysis.opened_for(request)
    mesh = opened.mesh
    layout = Layout((("flat", len(mesh.vertices), 2), ("scale", len(mesh.faces), 1)))
    given, refused = parametrization.given(mesh, request.x0)
    flat = given
    if flat is None:
        flat = parametrization.begin(
            mesh, iterations=options.relax_iterations, doubtful=opened.doubtful
        ).flat
    stage = Stage(
        "conformal",
        layout,
        per_component.objective(mesh, partial(_terms, options)),
        lambda _: free(layout),
        iterations=options.iterations,
        tolerance=options.tolerance,
        limits=[parametrization.orientation(parametrization.oriented_triangles(mesh), layout)],
    )
    stages = [stage]
    if not constraints.empty:
        flat = parametrization.align(mesh, flat, constraints)
        stages = [
            *constrained.gradual(constraints, stage),
            replace(stage, imposed=analysis.imposed),
        ]
    return Plan(
        layout,
        layout.pack({"flat": flat, "scale": _area_ratios(mesh, flat)}),
        stages,
        notes=opened.notes,
        finish=partial(_finish, constraints, opened, layout, given),
        start_refused=refused,
        cut=opened.cut,
    )


def _terms(options: Options, mesh: Mesh) -> list[Weighted]:
    items = [Weighted(t, 1.0) for t in congruence.build(mesh, "flat", scale="scale")]
    items += [Weighted(scale.build(mesh), options.w_scale)]
    return items + [Weighted(t, options.w_shear) for t in shear.build(mesh)]


def _area_ratios(mesh: Mesh, flat: Array) -> Array:
    """Compute each face's area in the image over that on the surface; one if it has no area."""
    large, small = measure.stretches(mesh, flat)
    return np.where(np.isnan(large), 1.0, large * small)


def _finish(
    constraints: Compiled,
    opened: parametrization.Opened,
    layout: Layout,
    given: Array | None,
    coordinates: Array,
) -> Array:
    """Scale the image to the surface's area and place it; keep the size of constrained images.

    The block "scale", factors on squared lengths during the solve, becomes ratios of lengths,
    image over surface. If the surface was cut open, both blocks are returned in the numbering
    of the cut mesh.
    """
    blocks = layout.split(coordinates)
    flat, ratio = blocks["flat"], blocks["scale"]
    if not constraints.empty:
        flat = parametrization.settle(opened.mesh, flat, constraints)
    else:
        factor = measure.area(opened.mesh) / measure.area(opened.mesh, flat)
        flat = parametrization.place(opened.mesh, flat * np.sqrt(factor), given)
        ratio = ratio * factor
    lengths = np.sqrt(np.maximum(ratio, 0.0))
    return layout.pack({"flat": opened.back(flat), "scale": opened.faces_back(lengths)})


def metrics(mesh: Mesh, after: Mesh | None, flat: Array, scale: float) -> dict[str, float]:
    """Compute the metrics of a conformal image (n, 2); units: :data:`gso.metrics.INFO`."""
    distortion = measure.quasi_conformal(mesh, flat) - 1.0
    distortion = distortion[~np.isnan(distortion)]
    if not distortion.size:
        # Every face is degenerate.
        return {"flipped_cells": float(measure.flips(mesh, flat))}
    lengths = np.sqrt(np.prod(measure.stretches(mesh, flat), axis=0))
    return {
        "angle_distortion_mean": float(distortion.mean()),
        "angle_distortion_p99": float(np.percentile(distortion, 99)),
        "scale_min": float(np.nanmin(lengths)),
        "scale_max": float(np.nanmax(lengths)),
        "area_error": measure.area_error(mesh, flat),
        "flipped_cells": float(measure.flips(mesh, flat)),
    }


TASK = Task({"isometry": Formulation(Options, plan)}, metrics, flat=True)
