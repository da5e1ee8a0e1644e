"""Bend a surface by its handles and preserve its lengths.

The objective, on the design scaled to the unit ball, is

    1/2 mean E_iso + w_edges / 2 mean (change of l^2)^2
    + w_bending / 2 mean |change of curvature|^2

with E_iso the isometry defect of Jiang et al. 2020 (differences of the faces' squared diagonals
and their product) and l the lengths of the edges, both relative to their means. The diagonals
hardly couple the two checkerboard lattices of a quad mesh: the edge term does. Lengths alone
leave a family of isometric shapes. The bending term, which measures the change of curvature in
the surface's own frame, selects one of them: a design without handles, or with handles that
move rigidly, keeps its shape. The bending weight falls tenfold from stage to stage, like the
fairness weight of Jiang et al.: a large weight finds the shape in few iterations, a small one
preserves lengths.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso.deformation import ThinPlateField, follow
from gso.energy import Weighted, bending, congruence
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.status import Status
from gso.tasks import per_component
from gso.tasks.base import Analysis, Formulation, Plan, Stage, Task
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout, free

#: Tolerance (relative decrease of the energy) of all stages but the last.
_NEARLY = 1e-3


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the bend task.

    Attributes
    ----------
    w_bending : float
        Weight of the mean squared change of curvature, in units of the design's unit ball. It
        is about the strain that remains in a sheet for which a strain-free shape exists.
    w_bending_start : float
        Approximate bending weight of the first stage; it falls tenfold from stage to stage down
        to `w_bending`. Not used with `x0`.
    w_edges : float
        Weight of the change of the edges' squared lengths, relative to that of the faces'
        diagonals.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"w_bending": 1e-5, "tolerance": 1e-2},
        "balanced": {},
        "accurate": {"w_bending": 1e-8, "tolerance": 1e-8, "iterations": 60},
    }

    iterations: int = 30
    tolerance: float = 1e-4
    method: str = "levenberg-marquardt"
    w_bending: float = 1e-6
    w_bending_start: float = 1e-2
    w_edges: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.w_bending > 0:
            raise OptionError(
                f"w_bending is {self.w_bending!r}; without it the shape is not determined: "
                "it must be positive"
            )


def plan(analysis: Analysis, request: Request[Options]) -> Plan:
    """Plan stages of falling bending weight, from a surface that follows its handles smoothly."""
    mesh, options = analysis.mesh, request.options
    layout = Layout.of(len(mesh.vertices), "surface")
    if analysis.constraints.empty and request.x0 is None:
        return Plan(layout, mesh.vertices.ravel(), status=Status.ALREADY_GOOD)
    weights = [options.w_bending]
    while request.x0 is None and weights[-1] < 0.3 * options.w_bending_start:
        weights.append(10.0 * weights[-1])
    lengths = per_component.objective(mesh, partial(_lengths, options))
    change = per_component.objective(mesh, _change)
    stages = [
        Stage(
            f"bending {weight:.0e}",
            layout,
            [*lengths, *(replace(item, weight=weight) for item in change)],
            lambda _: free(layout),
            iterations=options.iterations,
            tolerance=options.tolerance if weight is weights[0] else _NEARLY,
            imposed=analysis.imposed,
        )
        for weight in weights[::-1]
    ]
    return Plan(layout, _start(analysis, request).ravel(), stages)


def _lengths(options: Options, mesh: Mesh) -> list[Weighted]:
    items = [Weighted(t, 1.0) for t in congruence.build(mesh, "surface")]
    return [*items, Weighted(congruence.edges(mesh, "surface"), options.w_edges)]


def _change(mesh: Mesh) -> list[Weighted]:
    return [Weighted(t, 1.0) for t in bending.build(mesh)]


def _start(analysis: Analysis, request: Request[Options]) -> Array:
    """Move the vertices of the design, or of the user's start, smoothly with the handles."""
    mesh = analysis.mesh
    ids, targets = analysis.constraints.pinned_positions
    if request.x0 is not None:
        mesh = mesh.replaced(request.x0)
        return mesh.vertices + ThinPlateField(mesh, ids)(targets - mesh.vertices[ids])
    return follow(mesh, ThinPlateField(mesh, ids), targets)


def metrics(before: Mesh, after: Mesh, flat: Array | None, scale: float) -> dict[str, float]:
    """Compute strain, length and curvature metrics; units: :data:`gso.metrics.INFO`.

    ``loss_iso_cell`` is left out on a mesh without quads.
    """
    out = {
        "loss_iso_cell": measure.loss_iso_cell(before, after),
        "edge_length_error": measure.edge_length_error(before, after),
        **measure.strains(before, after),
        "loss_gc_before": measure.loss_gc(before, scale=scale),
        "loss_gc": measure.loss_gc(after, scale=scale),
    }
    return {name: value for name, value in out.items() if not np.isnan(value)}


TASK = Task({"isometry": Formulation(Options, plan)}, metrics)
