"""Flatten a surface into the plane with as little strain as possible.

``strain`` minimises the membrane strain of all corner triangles; use it for a pattern to cut.
``lengths`` minimises the published isometry defect of the cells (Wang et al. 2024), which does
not see some shear; use it for comparison. ``isometry`` minimises the squared defect of Jiang et
al. 2020 with their regulariser of the mapping, like the isometry formulation of the developable
task, but with the surface fixed. ``minimax`` makes the largest strains small, by a high power of
the strain; it starts from the image of ``strain``. All start from an image without inverted
triangles, and no step inverts a triangle. Grids are solved coarse to fine.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from gso import metrics as measure
from gso import parametrization
from gso.constraints import Compiled
from gso.hierarchy import coarser
from gso.mesh import Mesh
from gso.tasks import constrained
from gso.tasks.base import Analysis, Formulation, Plan, Stage, Task
from gso.tasks.developable.flat_image import length_notes
from gso.tasks.flatten.options import Options
from gso.tasks.flatten.stages import (
    FAR_FROM_FLAT,
    SMALLEST_LEVEL,
    STRAINED,
    planned_stages,
    strain_stage,
    with_own_terms,
)
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout

__all__ = ["FAR_FROM_FLAT", "TASK", "Options"]


def plan(analysis: Analysis, request: Request[Options]) -> Plan:
    """Plan the stages of the solve, from an image without inverted triangles.

    Raises
    ------
    MeshError
        A component is closed or has handles: it must be cut open first.
    """
    options, constraints = request.options, analysis.constraints
    opened = analysis.opened_for(request)
    mesh = opened.mesh
    grid = mesh.grid_index is not None and constraints.empty
    levels = [*(coarser(mesh, options.coarse_size) if grid else []), mesh]
    start = parametrization.begin(
        levels[0], iterations=options.relax_iterations, doubtful=opened.doubtful
    )
    notes = [*opened.notes, *_remarks(mesh, start.level)]
    given, refused = parametrization.given(mesh, request.x0)
    typical = max(start.level, SMALLEST_LEVEL)
    if given is None:
        planned = planned_stages(request, levels, typical)
    else:
        planned = planned_stages(request, [mesh], typical)[-1:]
        strained = parametrization.strain(mesh, given) > STRAINED * start.level
        if strained and request.formulation == "strain":
            first_stage = strain_stage(replace(options, norm="l2"), mesh, 1.0)
            planned = [with_own_terms(request, mesh, first_stage), *planned]
    first = start.flat if given is None else given
    finish = partial(_finish, opened, given)
    if not constraints.empty:
        first = parametrization.align(mesh, first, constraints)
        planned = _add_constraints(analysis, request, planned)
        finish = partial(_settle, mesh, constraints)
    cold = partial(_cold, levels, constraints, start.flat)
    return Plan(
        Layout.of(len(mesh.vertices), "flat"),
        first.ravel(),
        planned,
        notes=notes,
        details={"strain_level": start.level},
        finish=finish,
        result_notes=partial(_notes, opened) if request.formulation == "isometry" else None,
        cold_start=None if given is None else cold,
        start_refused=refused,
        cut=opened.cut,
    )


def _finish(opened: parametrization.Opened, given: Array | None, coordinates: Array) -> Array:
    """Place the image; if the surface was cut, return it in the numbering of the cut mesh."""
    return opened.back(_place(opened.mesh, given, coordinates).reshape(-1, 2)).ravel()


def _notes(opened: parametrization.Opened, coordinates: Array) -> list[str]:
    surface = opened.mesh if opened.cut is None else opened.cut.mesh
    return length_notes(surface, coordinates.reshape(-1, 2))


def _add_constraints(
    analysis: Analysis, request: Request[Options], stages: list[Stage]
) -> list[Stage]:
    """Plan stages under constraints: first soft with growing weight, then as they are given."""
    even = strain_stage(replace(request.options, norm="l2"), analysis.mesh, 1.0)
    even = with_own_terms(request, analysis.mesh, even)
    steps = constrained.gradual(analysis.constraints, replace(even, iterations=30))
    return [*steps, *(replace(stage, imposed=analysis.imposed) for stage in (even, *stages))]


def _settle(mesh: Mesh, constraints: Compiled, coordinates: Array) -> Array:
    """Place the parts of a constrained image that no constraint anchors; keep the others."""
    flat = coordinates.reshape(-1, 2)
    if not constraints.anchored and len(parametrization.parts(mesh)) == 1:
        return _place(mesh, None, coordinates)
    return parametrization.settle(mesh, flat, constraints).ravel()


def _remarks(mesh: Mesh, level: float) -> list[str]:
    notes = []
    parts = parametrization.parts(mesh)
    if len(parts) > 1:
        notes.append(f"the {len(parts)} components are laid out side by side")
    if sum(map(len, parts)) < len(mesh.vertices):
        notes.append("vertices that belong to no face are at the pattern's origin")
    if level > FAR_FROM_FLAT:
        notes.append(
            f"the surface is far from any plane (strain about {level:.0%}): cut it into pieces, or "
            "cut it open where it closes around itself"
        )
    return notes


def _cold(levels: list[Mesh], constraints: Compiled, flat: Array) -> Array:
    """Interpolate the image of the coarsest grid to the finest and align it to constraints."""
    for coarse, fine in pairwise(levels):
        flat = parametrization.refine(coarse, fine, flat)
    if not constraints.empty:
        flat = parametrization.align(levels[-1], flat, constraints)
    return flat.ravel()


def _place(mesh: Mesh, given: Array | None, coordinates: Array) -> Array:
    return parametrization.place(mesh, coordinates.reshape(-1, 2), given).ravel()


def metrics(mesh: Mesh, after: Mesh | None, flat: Array, scale: float) -> dict[str, float]:
    """Compute the metrics of a flat image (n, 2) of `mesh`; units: :data:`gso.metrics.INFO`.

    ``loss_iso_cell`` is left out on a mesh without quads.
    """
    out = {
        "loss_iso_cell": measure.loss_iso_cell(mesh, flat),
        "edge_length_error": measure.edge_length_error(mesh, flat),
        **measure.strains(mesh, flat),
        "area_error": measure.area_error(mesh, flat),
        "flipped_cells": float(measure.flips(mesh, flat)),
    }
    return {name: value for name, value in out.items() if not np.isnan(value)}


TASK = Task(
    {
        "strain": Formulation(Options, plan, terms=True),
        "lengths": Formulation(Options, plan, terms=True),
        "isometry": Formulation(Options, plan, presets=("jiang2020",), terms=True),
        "minimax": Formulation(Options, plan, terms=True),
    },
    metrics,
    flat=True,
)
