"""The stages of the formulation "curvature": coarser meshes first, the design's vertices last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from gso import metrics as measure
from gso.constraints import TIGHT, Compiled
from gso.energy.losses import Absolute
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.status import Status
from gso.tasks import base, constrained
from gso.tasks.base import Plan, Stage
from gso.tasks.developable import hidden_curvature, spline_stage
from gso.tasks.developable.analysis import FLAT_CURVATURE, Analysis
from gso.tasks.developable.bounds import check_handles, inside, offset_bounds, radius
from gso.tasks.developable.levels import FREE_VERTICES, Level, detailed, levels, pinned_only
from gso.tasks.developable.objective import objective
from gso.tasks.developable.options import Options
from gso.tasks.request import Request
from gso.tasks.stage_constraints import StageConstraints
from gso.typing import Array
from gso.unknowns import Layout, Variables, free, normal_offsets, spline_offsets, tangents

#: A design counts as a developable surface with noise if smoothing leaves at most this share of
#: its curvature. Displacements are then bounded by this many standard deviations of the noise.
NOISE_ONLY = 0.1
NOISE_REACH = 2.8

#: Most iterations with normal offsets between a warm start and the stage of free vertices, and
#: their tolerance after a start of known resolution.
_OFFSETS_FIRST, _OFFSETS_LOOSE = 12, 1e-2
#: Most iterations that correct a start of known resolution, on the coarsest grid and on the next
#: ones up to `free_size`. On the next ones they are costly, and end when one of them lowers the
#: energy by less than this share of it.
_CORRECTIONS, _CORRECTED = (3, 4), 0.3
#: Most iterations, with the usual tolerance, where less than this share of the energy may be left.
_MORE_CORRECTIONS, _CLOSE = (8, 3), 1e-3
#: Coarser grids that a start stands for that is solved already.
_SOLVED = 3
#: Factor on the iterations on the coarsest mesh where that is not a grid.
_LONGER = 1.5
#: Vertices above which the first iteration after a handle has moved changes offsets only.
_QUICK = 2000
#: Kinds of unknowns: displacements along one of two tangents.
TANGENTS = ("first tangent", "second tangent")
#: Sweeps over normals and both tangents where the vertices around held ones are to be free.
_SWEEPS = 3
#: Tolerance of all stages but the last.
_LOOSE = 1e-3
#: Shares of the weight of curvature for that by the normals of quads, where these hide some.
_IMAGE = (0.5, 0.75, 0.9)


def plan(analysis: Analysis, request: Request[Options]) -> Plan:
    """Plan the stages of the formulation "curvature"."""
    mesh, options, constraints = analysis.mesh, request.options, analysis.constraints
    notes: list[str] = []
    check_handles(analysis, request)
    if not mesh.stars:
        if options.by_component or _missed(analysis):
            raise _nothing_inside(mesh)
        return Plan(_layout(mesh), mesh.vertices.ravel(), status=Status.ALREADY_GOOD)
    start = mesh.vertices if request.x0 is None else request.x0
    curved = analysis.shape.curvature
    spline = spline_stage.controls(analysis, request)
    if spline is not None:
        # The spline stage starts from the result of the usual solve.
        request = replace(request, options=replace(options, variables="normal"))
    good = curved <= options.developable_below and spline is None
    if good and request.x0 is None and constraints.empty:
        return Plan(_layout(mesh), mesh.vertices.ravel(), status=Status.ALREADY_GOOD)
    smooth = analysis.shape.smooth
    left = curved if smooth is mesh else measure.loss_gc_mean(smooth, scale=1.0)
    if constraints.empty and left <= min(NOISE_ONLY * curved, FLAT_CURVATURE):
        bound = min(NOISE_REACH * analysis.shape.noise, request.max_displacement or np.inf)
        request = replace(request, max_displacement=bound)
        if spline is None:
            notes.append("the design is developable but for noise: it moves no further than that")
    *coarse, own = levels(analysis, request)
    stages = [_coarse_stage(analysis, request, level, k) for k, level in enumerate(coarse)]
    stages += _stages(analysis, request, len(coarse))
    for k, (before, level) in enumerate(pairwise([*coarse, own])):
        enter = partial(level.enter, before, radius(request))
        stages[k + 1] = replace(stages[k + 1], enter=enter)
    if coarse and not constraints.empty:
        first = base.Analysis(coarse[0].mesh, coarse[0].constraints)
        stages.insert(0, constrained.approach(first, coarse[0].mesh.vertices))
    if spline is not None:
        stages.append(spline_stage.stage(stages[-1], mesh, spline))
    edited = None
    if coarse and not constraints.empty and stages[-1].name == "normal":
        edited = replace(
            stages[-1],
            name="free",
            variables=partial(_unknowns, "free", mesh, options),
            moving=stages[-1].variables,
        )
    further = None
    if spline is None:
        shares = [partial(objective, analysis, request, mesh, share) for share in _IMAGE]
        further = hidden_curvature.further(mesh, options.developable_below, stages[-1], shares)
    begin = coarse[0].begin.vertices if coarse else inside(start, mesh, radius(request))
    free_to_return = constraints.empty
    free_to_return &= request.x0 is None or request.max_displacement is None
    fallback = start.ravel()
    if spline is not None:
        fallback = spline_stage.closest(_layout(mesh), mesh, spline, fallback)
    return Plan(
        _layout(mesh),
        begin.ravel(),
        stages,
        further=further,
        notes=notes,
        fallback=fallback if free_to_return else None,
        spline=spline,
        cold_start=None if request.x0 is None else mesh.vertices.ravel,
        edited=edited,
    )


def _missed(analysis: Analysis) -> bool:
    """Tell whether the design misses a hard constraint."""
    misses = analysis.constraints.violations(analysis.mesh.vertices).values()
    return any(miss.hard and miss.length > TIGHT for miss in misses)


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
    if kind in TANGENTS:
        return normal_offsets(layout, points, tangents(normals)[TANGENTS.index(kind)])
    shape = mesh.grid_shape
    if kind == "spline" and shape is not None:
        controls = (min(options.controls, shape[0]), min(options.controls, shape[1]))
        return spline_offsets(layout, points, normals, shape, controls)
    return normal_offsets(layout, points, normals)


def _stages(analysis: Analysis, request: Request[Options], coarser_meshes: int) -> list[Stage]:
    """Plan the stages on the design's own vertices."""
    o, mesh, constraints = request.options, analysis.mesh, analysis.constraints
    items = objective(analysis, request, mesh)
    bounds = offset_bounds(mesh, radius(request), constraints.hard_ids)
    cold = request.x0 is None and mesh.grid_index is None and not coarser_meshes
    falling = _falling(o) if cold else (Absolute(o.eps),)
    # On small meshes free vertices are fast enough, and offsets alone cannot meet lengths.
    quick = len(mesh.vertices) > _QUICK and not _needs_repetition(constraints)
    moving = partial(_unknowns, "normal", mesh, o) if quick else None

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
            moving=moving if kind == "free" else None,
        )

    final = falling[-1:]
    known = request.start.resolution is not None
    if request.x0 is not None and request.start.solved:
        coarser_meshes += _SOLVED
    most = _iterations(o, coarser_meshes, request.x0 is not None and not known)
    if request.max_displacement is not None:
        # Only offsets along normals have bounds. The second stage uses updated normals.
        return [stage("normal", o.iterations, losses) for losses in (falling, final)]
    if coarser_meshes and not constraints.empty:
        if mesh.grid_index is not None or o.variables == "free" or not pinned_only(constraints):
            return [stage("free", most if _needs_repetition(constraints) else o.iterations, final)]
        # Normal offsets alone would leave the tangential displacements to the coarser meshes.
        sweep = [stage("normal", 2, final), *(stage(kind, 1, final) for kind in TANGENTS)]
        return [*_SWEEPS * sweep, stage("normal", most // 2, final)]
    if cold or not constraints.empty:
        bound = not constraints.empty
        first = stage("free" if bound else "normal", 15, falling)
        # Sliding, gluing and length constraints need free vertices.
        last = stage("free" if bound else o.variables, o.iterations, final)
        if not bound:
            return [first, last]
        start = mesh.vertices if request.x0 is None else request.x0
        return [constrained.approach(analysis, start), first, last]
    last = stage(o.variables, most, falling)
    if o.variables == "free" and request.x0 is not None:
        # Normal offsets remove most of the remaining energy at a third of the cost.
        first = stage("normal", _OFFSETS_FIRST, falling)
        return [replace(first, tolerance=_OFFSETS_LOOSE if known else _LOOSE), last]
    return [last]


def _needs_repetition(constraints: Compiled) -> bool:
    """Return whether hard constraints are terms, for which the last stage is repeated."""
    return any(p.hard and not p.linear for p in constraints.parts)


def _falling(options: Options) -> tuple[Absolute, ...]:
    """Return the losses of |K| by iteration, with a decreasing smoothing."""
    return tuple(Absolute(factor * options.eps) for factor in (10.0, 3.0, 1.0))


def _iterations(options: Options, coarser_meshes: int, begun: bool) -> int:
    """Compute the iterations on a mesh that follows `coarser_meshes` coarser ones.

    `begun` is whether there is a warm start of any resolution, which is far from the solution.

    From the fourth refinement on they are fewer, as coarser meshes have found nearly all of the
    displacement: two thirds as many of offsets, and half as many from mesh to mesh, but not fewer
    than 5, of free vertices, which are costly there.
    """
    if coarser_meshes < 2 or begun:
        return options.iterations
    most = options.refining_iterations
    if options.variables != "free":
        return max(most * 2 // 3, min(most, 3)) if coarser_meshes > 3 else most
    return max(most >> max(coarser_meshes - 3, 0), min(most, 5))


def _coarse_stage(
    analysis: Analysis, request: Request[Options], level: Level, number: int
) -> Stage:
    """Plan the stage of a coarser mesh, with free vertices on the coarsest.

    So are those of the next ones up to `free_size` on grids, and up to `FREE_VERTICES` on others;
    and of all if the last stage's are, unless there is a warm start, and under constraints that
    are not positions of vertices. With `max_displacement` all use normal offsets.
    """
    o, mesh, start = request.options, level.mesh, request.start
    begun = request.x0 is not None
    first = number == 0 and not (begun and start.solved)
    grid = mesh.grid_shape
    small = max(grid) <= o.free_size if grid else len(mesh.vertices) <= FREE_VERTICES
    iterations = o.coarse_iterations if first else o.between_iterations
    if first and begun:
        iterations //= 2
    if first and not grid:
        iterations = int(_LONGER * iterations)
    loose = small or o.variables == "free" or not pinned_only(level.constraints)
    kind = "free" if first or (not begun and loose) else "normal"
    fall, tolerance = not begun and (first or not grid), _LOOSE
    if begun and small and start.resolution is not None:
        close = start.remaining < _CLOSE
        iterations = (_MORE_CORRECTIONS if close else _CORRECTIONS)[not first]
        tolerance = _LOOSE if first or close else _CORRECTED
        fine = not detailed(analysis.mesh, start.resolution)
        kind, fall = "free", first and (fine or close)
    if request.max_displacement is not None:
        kind = "normal"
    return Stage(
        f"{grid[0]}x{grid[1]}" if grid else f"{len(mesh.faces):,} triangles",
        _layout(mesh),
        objective(analysis, request, mesh),
        partial(_unknowns, kind, mesh, o),
        iterations=iterations,
        tolerance=tolerance,
        continuation=_falling(o) if fall else (Absolute(o.eps),),
        continued="curvature",
        bounds=offset_bounds(mesh, radius(request), level.constraints.hard_ids),
        imposed=None if level.constraints.empty else StageConstraints(level.constraints),
    )
