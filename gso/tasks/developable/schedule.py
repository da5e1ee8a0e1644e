"""The stages of the formulation "curvature": coarse grids first, the design's vertices last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gso import metrics as measure
from gso.energy.losses import Absolute
from gso.errors import MeshError
from gso.hierarchy import coarser, prolong_displacement, resample_like
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.status import Status
from gso.tasks import constrained
from gso.tasks.base import Plan, Request, Stage
from gso.tasks.developable import spline_stage
from gso.tasks.developable.analysis import FLAT_CURVATURE, Analysis
from gso.tasks.developable.bounds import check_handles, inside, offset_bounds, radius
from gso.tasks.developable.objective import objective
from gso.tasks.developable.options import Options
from gso.typing import Array
from gso.unknowns import Layout, Variables, free, normal_offsets, spline_offsets

#: A design counts as a developable surface with noise if smoothing leaves at most this share of
#: its curvature. Displacements are then bounded by this many standard deviations of the noise.
NOISE_ONLY = 0.1
NOISE_REACH = 2.8

#: Iterations with normal offsets between a warm start and the stage of free vertices.
_OFFSETS_FIRST = 12
#: Tolerance of all stages but the last.
_LOOSE = 1e-3


def plan(analysis: Analysis, request: Request) -> Plan:
    """Plan the stages of the formulation "curvature"."""
    mesh, options, constraints = analysis.mesh, request.options, analysis.constraints
    notes: list[str] = []
    check_handles(analysis, request)
    if not mesh.stars:
        raise _nothing_inside(mesh)
    start = mesh.vertices if request.start is None else request.start
    curved = analysis.shape.curvature
    spline = spline_stage.controls(analysis, request)
    if spline is not None:
        # The spline stage starts from the result of the usual solve.
        request = replace(request, options=replace(options, variables="normal"))
    good = curved <= options.developable_below and spline is None
    if good and request.start is None and constraints.empty:
        return Plan(_layout(mesh), mesh.vertices.ravel(), status=Status.ALREADY_GOOD)
    left = measure.loss_gc_mean(analysis.shape.smooth, scale=1.0)
    if constraints.empty and left <= min(NOISE_ONLY * curved, FLAT_CURVATURE):
        bound = min(NOISE_REACH * analysis.shape.noise, request.max_displacement or np.inf)
        request = replace(request, max_displacement=bound)
        if spline is None:
            notes.append("the design is developable but for noise: it moves no further than that")
    levels = _levels(analysis, request)
    starts = _starts(analysis, request, levels)
    stages = [_coarse_stage(analysis, request, level, k) for k, level in enumerate(levels)]
    stages += _stages(analysis, request, len(levels))
    for k in range(len(levels)):
        enter = partial(_carry, starts[k], starts[k + 1], radius(request))
        stages[k + 1] = replace(stages[k + 1], enter=enter)
    if spline is not None:
        stages.append(spline_stage.stage(stages[-1], mesh, spline))
    begin = starts[0].vertices if levels else inside(start, mesh, radius(request))
    free_to_return = constraints.empty
    free_to_return &= request.start is None or request.max_displacement is None
    fallback = start.ravel()
    if spline is not None:
        fallback = spline_stage.closest(_layout(mesh), mesh, spline, fallback)
    return Plan(
        _layout(mesh),
        begin.ravel(),
        stages,
        notes=notes,
        fallback=fallback if free_to_return else None,
        spline=spline,
        cold_start=None if request.start is None else mesh.vertices.ravel,
    )


def _levels(analysis: Analysis, request: Request) -> list[Mesh]:
    """Return the coarser copies of the design on which to solve first, coarsest first."""
    mesh = analysis.mesh
    if mesh.grid_index is None or not analysis.constraints.empty:
        return []
    if request.start is not None and request.max_displacement is not None:
        return []
    o = request.options
    # A warm start has the large displacements already, which the coarsest grids are for.
    return coarser(mesh, o.coarse_size if request.start is None else o.free_size)


def _starts(analysis: Analysis, request: Request, levels: list[Mesh]) -> list[Mesh]:
    """Return the surfaces to start from on each coarser grid and on the design's own.

    A warm start keeps its fine detail: only the displacements found on the coarser grids are
    interpolated and added to it. They correct its low-frequency error, which would take many
    iterations on the fine grid, at a fraction of the cost.
    """
    if request.start is None:
        return [*levels, analysis.mesh]
    begun = analysis.mesh.replaced(request.start)
    return [*resample_like(levels, begun), begun]


def _nothing_inside(mesh: Mesh) -> MeshError:
    return MeshError(
        f"{mesh!r} has no interior vertex, so no curvature; refine it or give a larger piece"
    )


def _layout(mesh: Mesh) -> Layout:
    return Layout.of(len(mesh.vertices), "surface")


def _unknowns(kind: str, mesh: Mesh, options: Options, coordinates: Array) -> Variables:
    """Build the unknowns at the start of a stage."""
    layout = _layout(mesh)
    if kind == "free":
        return free(layout)
    points = coordinates.reshape(-1, 3)
    normals = vertex_normals(mesh.replaced(points))
    shape = mesh.grid_shape
    if kind == "spline" and shape is not None:
        controls = (min(options.controls, shape[0]), min(options.controls, shape[1]))
        return spline_offsets(layout, points, normals, shape, controls)
    return normal_offsets(layout, points, normals)


def _stages(analysis: Analysis, request: Request, coarser_grids: int) -> list[Stage]:
    """Plan the stages on the design's own vertices."""
    o, mesh, constraints = request.options, analysis.mesh, analysis.constraints
    items = objective(analysis, request, mesh)
    bounds = offset_bounds(mesh, radius(request), constraints.hard_ids)
    cold = request.start is None and mesh.grid_index is None
    falling = _falling(o) if cold else (Absolute(o.eps),)

    def stage(kind: str, iterations: int, losses: Sequence[Absolute]) -> Stage:
        return Stage(
            kind,
            _layout(mesh),
            items,
            partial(_unknowns, kind, mesh, o),
            iterations=iterations,
            tolerance=o.tolerance,
            continuation=losses,
            continued="curvature",
            bounds=bounds,
            imposed=analysis.imposed,
            moving=partial(_unknowns, "normal", mesh, o) if kind == "free" else None,
        )

    final = falling[-1:]
    if request.max_displacement is not None:
        # Only offsets along normals have bounds. The second stage uses updated normals.
        return [stage("normal", o.iterations, losses) for losses in (falling, final)]
    if cold or not constraints.empty:
        bound = not constraints.empty
        first = stage("free" if bound else "normal", 15, falling)
        # Sliding, gluing and length constraints need free vertices.
        last = stage("free" if bound else o.variables, o.iterations, final)
        if not bound:
            return [first, last]
        start = mesh.vertices if request.start is None else request.start
        return [constrained.approach(analysis, start), first, last]
    most = _iterations(o, coarser_grids, request.start is not None)
    last = stage(o.variables, most, falling)
    if o.variables == "free" and request.start is not None:
        # Normal offsets remove most of the remaining energy at a third of the cost.
        first = stage("normal", _OFFSETS_FIRST, falling)
        return [replace(first, tolerance=_LOOSE), last]
    return [last]


def _falling(options: Options) -> tuple[Absolute, ...]:
    """Return the losses of |K| by iteration, with a decreasing smoothing."""
    return tuple(Absolute(factor * options.eps) for factor in (10.0, 3.0, 1.0))


def _iterations(options: Options, coarser_grids: int, begun: bool) -> int:
    """Compute the iterations on a grid that follows `coarser_grids` coarser ones.

    `begun` is whether there is a warm start, which has been solved on fewer coarser grids.

    From the fourth refinement on they are fewer, as coarser grids have found nearly all of the
    displacement: two thirds as many of offsets, and half as many from grid to grid, but not fewer
    than 5, of free vertices, which are costly there.
    """
    if coarser_grids < 2 or begun:
        return options.iterations
    most = options.refining_iterations
    if options.variables != "free":
        return max(most * 2 // 3, min(most, 3)) if coarser_grids > 3 else most
    return max(most >> max(coarser_grids - 3, 0), min(most, 5))


def _coarse_stage(analysis: Analysis, request: Request, level: Mesh, number: int) -> Stage:
    """Plan the stage of a coarser grid, with free vertices on the coarsest.

    So are those of the next ones up to `free_size`, and of all if the last stage's are, unless
    there is a warm start. With `max_displacement` all use normal offsets.
    """
    o = request.options
    first, begun = number == 0, request.start is not None
    small = max(level.grid_shape or (0,)) <= o.free_size
    iterations = o.coarse_iterations if first else o.between_iterations
    if first and begun:
        iterations //= 2
    kind = "free" if first or (not begun and (small or o.variables == "free")) else "normal"
    if request.max_displacement is not None:
        kind = "normal"
    return Stage(
        "x".join(map(str, level.grid_shape or ())),
        _layout(level),
        objective(analysis, request, level),
        partial(_unknowns, kind, level, o),
        iterations=iterations,
        tolerance=_LOOSE,
        continuation=_falling(o) if first and not begun else (Absolute(o.eps),),
        continued="curvature",
        bounds=offset_bounds(level, radius(request)),
    )


def _carry(coarse: Mesh, fine: Mesh, bound: float | None, coordinates: Array) -> Array:
    """Interpolate the displacement of a coarse grid and add it to a finer one."""
    return inside(
        prolong_displacement(coarse, fine, coordinates.reshape(-1, 3)), fine, bound
    ).ravel()
