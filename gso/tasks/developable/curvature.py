"""Make a surface developable: remove its Gaussian curvature, stay close and fair.

The objective, on the design scaled to the unit ball, is

    w_curvature mean |K| + w_fairness / 2 mean |second derivative|^2 + w_proximity mean d
    + w_elongation / 2 mean (elongation)^2

with |K| smoothed by a decreasing epsilon. The absolute value concentrates bending along few
lines, which lets a surface become developable. Second derivatives are relative to a share of
the design's own, which is large where the design is developable. d penalises the displacement
from the design, its tangential part less: quadratically below `near`, linearly beyond. The
elongation of an edge is zero within a range of length ratios. Grids are solved coarse to fine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso.constraints import Compiled, Pins
from gso.energy import Weighted, curvature, elongation, fairness, proximity
from gso.energy.losses import Absolute, Distance
from gso.errors import MeshError, OptionError
from gso.hierarchy import alike, carry, coarser, resample
from gso.mesh import Mesh
from gso.smoothing import smooth_grid
from gso.status import Status
from gso.tasks import constrained, per_component
from gso.tasks.base import Plan, Request, Stage
from gso.tasks.developable import isometry, spline_stage
from gso.tasks.evaluation import parted
from gso.tasks.options import Options as BaseOptions
from gso.typing import Array
from gso.unknowns import (
    ALONG,
    Layout,
    Variables,
    free,
    normal_offsets,
    spline_offsets,
    vertex_normals,
)

FORMULATIONS = ("curvature", "isometry")
#: The formulation that a preset belongs to.
IMPLIES = {"jiang2020": "isometry"}

#: Mean |K| and mean squared bending of a typical design, for which weights are quoted.
TYPICAL_CURVATURE = 0.3
TYPICAL_BENDING = 5.0


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the developable task; lengths in units of the design's unit ball.

    Attributes
    ----------
    w_curvature : float
        Weight of mean |K| for a design with typical mean |K|; the weight used decreases slowly
        with the design's mean |K|.
    w_fairness : float
        Weight of the mean squared second derivative for a design with typical bending; the
        weight used decreases with the design's bending.
    w_proximity : float
        Weight of the displacement from the design.
    w_elongation : float
        Weight of edges much shorter or longer than in the design. Boundary edges are penalised
        from a change of length of 8 % on.
    near : float
        Displacements below this are penalised quadratically, larger ones linearly.
    tangential : float
        Factor on the tangential part of a displacement.
    eps : float
        Smoothing of |K|: curvature well below this is penalised quadratically.
    variables : {"normal", "free", "spline", "surface"}
        Unknowns of the last stage: offsets along normals, free vertices, or (on grids) a
        coarse bicubic field of offsets, which cannot crumple. With "surface" (on grids) they are
        the control points of a bicubic B-spline surface, returned as the result's `spline`.
        Except with "surface", `max_deviation` implies offsets along normals, and constraints
        imply free vertices and no coarser grids.
    controls : int
        "spline", "surface": control points along each side; fewer on small grids.
    coarse_iterations : int
        Iterations on the coarsest grid; half as many with `x0`.
    coarse_size : int
        Largest side of the coarsest grid; a grid that small is halved once.
    between_iterations : int
        Iterations on each grid between the coarsest and the design's own, where the unknowns
        are normal offsets. With "free" and without `x0` the vertices are free there too and
        take `iterations`, halved from grid to grid on fine grids.
    developable_below : float
        A design whose mean |K| is below this is developable already and is returned unchanged,
        unless there are constraints, `x0` or variables "surface".
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {
            "iterations": 4,
            "coarse_iterations": 8,
            "w_curvature": 1.15e-3,
            "w_fairness": 8.2e-6,
        },
        "balanced": {},
        "accurate": {
            "iterations": 14,
            "coarse_iterations": 12,
            "variables": "free",
            "w_curvature": 8.9e-4,
            "w_fairness": 9.0e-6,
        },
    }

    iterations: int = 12
    method: str = "levenberg-marquardt"
    w_curvature: float = 9.0e-4
    w_fairness: float = 7.8e-6
    w_proximity: float = 1.0
    w_elongation: float = 0.1
    near: float = 0.006
    tangential: float = 0.5
    eps: float = 0.007
    variables: str = "normal"
    controls: int = 16
    coarse_iterations: int = 12
    coarse_size: int = 32
    between_iterations: int = 6
    developable_below: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.variables not in ("normal", "free", "spline", "surface"):
            raise OptionError(
                f"variables is {self.variables!r}; take 'normal', 'free', 'spline' or 'surface'"
            )
        if self.controls < 4:
            raise OptionError(f"controls is {self.controls}; it must be 4 or more")
        if not (self.eps > 0 and self.near > 0):
            raise OptionError("eps and near must be positive")


#: Factor on the weight of curvature on meshes that are not grids: more curvature remains there,
#: around irregular vertices and for lack of a coarse-to-fine sequence.
GENERAL = 1.8
#: Gaussian curvature at which the fairness term preserves half of the design's own bending.
FLAT_CURVATURE = 0.02
#: A design counts as a developable surface with noise if smoothing leaves at most this share of
#: its curvature. Displacements are then bounded by this many standard deviations of the noise.
NOISE_ONLY = 0.1
NOISE_REACH = 2.8

#: Iterations with normal offsets between a warm start and the stage of free vertices.
_OFFSETS_FIRST = 12
#: Tolerance of all stages but the last.
_LOOSE = 1e-3

#: Settings by formulation.
OPTIONS = {"curvature": Options, "isometry": isometry.Options}


def plan(request: Request) -> Plan:
    """Plan the stages of the solve."""
    if request.formulation == "isometry":
        return isometry.plan(request, _before_joint)
    return _plan(request)


def _before_joint(request: Request) -> Plan:
    """Plan the curvature solve whose result the joint solve starts from."""
    bound = request.max_deviation
    # The box bounds of the joint solve cover only part of the ball around a vertex.
    reach = None if bound is None else 0.99 * ALONG * bound
    return _plan(replace(request, options=Options(), max_deviation=reach))


def _plan(request: Request) -> Plan:
    """Plan the curvature formulation: coarse grids first, the design's own vertices last."""
    mesh, options = request.mesh, request.options
    notes: list[str] = []
    _check_handles(request)
    if not mesh.stars:
        raise _nothing_inside(mesh)
    start = mesh.vertices if request.start is None else request.start
    curved = measure.loss_gc_both(mesh, scale=1.0)
    spline = spline_stage.controls(request)
    if spline is not None:
        # The spline stage starts from the result of the usual solve.
        request = replace(request, options=replace(options, variables="normal"))
    good = curved <= options.developable_below and spline is None
    if good and request.start is None and request.constraints.empty:
        return Plan(_layout(mesh), mesh.vertices.ravel(), status=Status.ALREADY_GOOD)
    smooth, sigma = _smoothed(mesh)
    left = measure.loss_gc_both(smooth, scale=1.0)
    if request.constraints.empty and left <= min(NOISE_ONLY * curved, FLAT_CURVATURE):
        reach = min(NOISE_REACH * sigma, request.max_deviation or np.inf)
        request = replace(request, max_deviation=reach)
        if spline is None:
            notes.append("the design is developable but for noise: it moves no further than that")
    make = partial(_objective, request, curved, _bending(mesh), smooth)
    if parted(mesh):
        make = partial(_joined, request)
    levels = _levels(request)
    starts = _starts(request, levels)
    stages = [_coarse_stage(request, level, make, k) for k, level in enumerate(levels)]
    stages += _stages(request, mesh, make, len(levels))
    for k, stage in enumerate(stages[1 : len(levels) + 1]):
        stage.enter = partial(_carry, starts[k], starts[k + 1], request.reach)
    if spline is not None:
        stages.append(spline_stage.stage(stages[-1], mesh, spline))
    begin = starts[0].vertices if levels else _inside(start, mesh, request.reach)
    free_to_return = request.constraints.empty
    free_to_return &= request.start is None or request.max_deviation is None
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
        unstarted=None if request.start is None else mesh.vertices.ravel,
    )


def _levels(request: Request) -> list[Mesh]:
    """Return the coarser copies of the design on which to solve first, coarsest first."""
    mesh = request.mesh
    if mesh.grid_index is None or not request.constraints.empty:
        return []
    if request.start is not None and request.max_deviation is not None:
        return []
    return coarser(mesh, request.options.coarse_size)


def _starts(request: Request, levels: list[Mesh]) -> list[Mesh]:
    """Return the surfaces to start from on each coarser grid and on the design's own.

    A warm start keeps its fine detail: only the displacements found on the coarser grids are
    interpolated and added to it. They correct its low-frequency error, which would take many
    iterations on the fine grid, at a fraction of the cost.
    """
    if request.start is None:
        return [*levels, request.mesh]
    begun = request.mesh.replaced(request.start)
    return [*alike(levels, begun), begun]


def _check_handles(request: Request) -> None:
    """Raise if hard constraints are incompatible with `max_deviation`."""
    c, reach = request.constraints, request.max_deviation
    if reach is None:
        return
    for part in c.parts:
        if part.hard and not isinstance(part, Pins):
            raise OptionError(
                f"{c.names[part.owner]} cannot be kept with max_deviation, under which vertices "
                "move along their normals only; leave one out, or give the constraint a weight "
                "where it takes one"
            )
    if not len(c.hard_ids):
        return
    far = np.linalg.norm(c.hard_positions - request.mesh.vertices[c.hard_ids], axis=1)
    if far.max() > reach:
        raise OptionError(
            f"a handle moves its vertex by {far.max() / reach:.3g} times max_deviation; "
            "allow more, or give the handle a weight"
        )


def _smoothed(mesh: Mesh) -> tuple[Mesh, float]:
    """Smooth the design and estimate the noise's standard deviation; on grids only."""
    if mesh.grid is None:
        return mesh, 0.0
    smoothed = smooth_grid(mesh.grid, order=4)
    return mesh.replaced(smoothed.points.reshape(-1, 3)), smoothed.sigma


def _own_bending(mesh: Mesh) -> Array:
    """Compute the share (n,) of its own bending that each vertex of a smooth design should keep.

    The share is near one where the design is developable already, so that fairness does not
    shrink its border, and near zero where the design has Gaussian curvature.
    """
    k = 0.5 * (np.abs(measure.curvature(mesh)) + np.abs(measure.curvature(mesh, 1)))
    grid = mesh.grid_index
    if grid is not None:
        inner = grid[1:-1, 1:-1]
        k[grid] = np.pad(k[inner], 1, mode="edge")
    k = np.where(np.isnan(k), np.inf, k)
    return kept_bending(k)


def kept_bending(curvature: Any) -> Any:
    """Compute the share of its own bending that a vertex of a Gaussian curvature should keep."""
    return 1.0 / (1.0 + (curvature / FLAT_CURVATURE) ** 2)


def adapted_weights(options: Options, curved: Any, bending: Any) -> tuple[Any, Any]:
    """Adapt the curvature and fairness weights to a design's mean |K| and squared bending."""
    curvature = options.w_curvature * (TYPICAL_CURVATURE / curved) ** 0.2
    return curvature, options.w_fairness * (TYPICAL_BENDING / (bending + 1.0)) ** 0.5


def _nothing_inside(mesh: Mesh) -> MeshError:
    return MeshError(
        f"{mesh!r} has no interior vertex, so no curvature; refine it or give a larger piece"
    )


def _bending(mesh: Mesh) -> float:
    """Compute the mean squared second derivative of a mesh along its polylines."""
    stencil, coefficients = fairness.differences(mesh)
    if len(stencil) == 0:
        return 0.0
    second = np.einsum("ke,ekd->ed", coefficients, mesh.vertices[stencil])
    return float((second**2).sum(axis=1).mean() * 2.0)


def _objective(
    request: Request, curved: float, bending: float, smooth: Mesh, mesh: Mesh
) -> list[Weighted]:
    """Build the terms on the design or on a coarser copy of it."""
    o = request.options
    w_curvature, w_fairness = adapted_weights(o, max(curved, 1e-3), bending)
    w_curvature *= request.demand if mesh.grid_index is not None else GENERAL * request.demand
    w_proximity = o.w_proximity
    if request.max_deviation is not None:
        # The bound keeps the result close, so the other terms can be stronger.
        w_curvature, w_fairness = 4.5 * w_curvature, 3.0 * w_fairness
        w_proximity = 0.3 * w_proximity
    normals = vertex_normals(mesh)
    near = proximity.build(mesh, normals, tangential=o.tangential)
    items = [Weighted(t, w_curvature, Absolute(o.eps)) for t in curvature.build(mesh)]
    if mesh is not request.mesh:
        smooth = mesh.replaced(_resampled(smooth, mesh))
    fair = fairness.build(mesh, reference=smooth.vertices, share=_own_bending(smooth))
    items.append(Weighted(fair, w_fairness))
    items.append(Weighted(near, w_proximity, Distance(o.near)))
    items.append(Weighted(elongation.build(mesh), o.w_elongation))
    return items + (constrained.pulls(request) if mesh is request.mesh else [])


def _joined(request: Request, mesh: Mesh) -> list[Weighted]:
    """Build the terms of several components, each for its own size and curvature."""

    def make(own: Mesh) -> list[Weighted]:
        alone = replace(request, mesh=own, constraints=Compiled())
        curved = measure.loss_gc_worst(own, scale=1.0)
        return _objective(alone, curved, _bending(own), _smoothed(own)[0], own)

    return per_component.objective(mesh, make) + constrained.pulls(request)


def _resampled(source: Mesh, target: Mesh) -> Array:
    """Resample the vertices of one grid at the resolution of another, row by row."""
    if source.grid is None or target.grid_shape is None:
        return source.vertices
    return resample(source.grid, *target.grid_shape).reshape(-1, 3)


def _layout(mesh: Mesh) -> Layout:
    return Layout.of(len(mesh.vertices), "surface")


def _unknowns(kind: str, mesh: Mesh, request: Request, coordinates: Array) -> Variables:
    """Build the unknowns at the start of a stage; hard linear constraints are eliminated."""
    layout = _layout(mesh)
    if kind == "free":
        variables = free(layout)
    else:
        points = coordinates.reshape(-1, 3)
        normals = vertex_normals(mesh.replaced(points))
        shape = mesh.grid_shape
        if kind == "spline" and shape is not None:
            most = request.options.controls
            controls = (min(most, shape[0]), min(most, shape[1]))
            variables = spline_offsets(layout, points, normals, shape, controls)
        else:
            variables = normal_offsets(layout, points, normals)
    return constrained.hold(request, variables) if mesh is request.mesh else variables


def _stages(request: Request, mesh: Mesh, make: Any, coarser_grids: int) -> list[Stage]:
    """Plan the stages on the design's own vertices."""
    o = request.options
    items = make(mesh)
    cold = request.start is None and mesh.grid_index is None
    falling = (10.0 * o.eps, 3.0 * o.eps, o.eps) if cold else (o.eps,)

    def stage(kind: str, iterations: int, eps: tuple[float, ...]) -> Stage:
        return Stage(
            kind,
            _layout(mesh),
            items,
            partial(_unknowns, kind, mesh, request),
            iterations=iterations,
            tolerance=o.tolerance,
            eps=eps,
            robust="curvature",
            bounds=_bounds(mesh, request.reach, request.constraints.hard_ids),
        )

    if request.max_deviation is not None:
        # Only offsets along normals have bounds. The second stage uses updated normals.
        return [stage("normal", o.iterations, e) for e in (falling, (o.eps,))]
    if cold or not request.constraints.empty:
        bound = not request.constraints.empty
        first = stage("free" if bound else "normal", 15, falling)
        # Sliding, gluing and length constraints need free vertices.
        last = stage("free" if bound else o.variables, o.iterations, (o.eps,))
        if not bound:
            return [first, last]
        start = mesh.vertices if request.start is None else request.start
        return [constrained.approach(request, start), first, last]
    last = stage(o.variables, _iterations(o, coarser_grids), falling)
    if o.variables == "free" and request.start is not None:
        # Normal offsets remove most of the remaining energy at a third of the cost.
        first = stage("normal", _OFFSETS_FIRST, falling)
        return [replace(first, tolerance=_LOOSE), last]
    return [last]


def _iterations(options: Options, coarser_grids: int) -> int:
    """Compute the iterations on a grid that follows `coarser_grids` coarser ones.

    Offsets take 1.5 times as many from the second refinement on, as fine grids converge more
    slowly. Free vertices are costly on very fine grids: from the third refinement on, each grid
    takes half the iterations of the one before, but not fewer than 5.
    """
    if options.variables != "free":
        return options.iterations * 3 // 2 if coarser_grids > 1 else options.iterations
    return max(options.iterations >> max(coarser_grids - 2, 0), min(options.iterations, 5))


def _coarse_stage(request: Request, level: Mesh, make: Any, number: int) -> Stage:
    """Plan the stage of a coarser grid, with free vertices on the coarsest.

    The other grids use free vertices if the last stage does and the start is cold, else normal
    offsets, which are cheaper. With `max_deviation` all use normal offsets.
    """
    o = request.options
    first, begun = number == 0, request.start is not None
    free_between = o.variables == "free" and not begun
    if first:
        iterations = o.coarse_iterations // 2 if begun else o.coarse_iterations
    else:
        iterations = _iterations(o, number) if free_between else o.between_iterations
    kind = "free" if first or free_between else "normal"
    if request.max_deviation is not None:
        kind = "normal"
    return Stage(
        "x".join(map(str, level.grid_shape or ())),
        _layout(level),
        make(level),
        partial(_unknowns, kind, level, request),
        iterations=iterations,
        tolerance=_LOOSE,
        eps=(10.0 * o.eps, 3.0 * o.eps, o.eps) if first and not begun else (o.eps,),
        robust="curvature",
        bounds=_bounds(level, request.reach),
    )


def _carry(coarse: Mesh, fine: Mesh, reach: float | None, coordinates: Array) -> Array:
    """Interpolate the displacement of a coarse grid and add it to a finer one."""
    return _inside(carry(coarse, fine, coordinates.reshape(-1, 3)), fine, reach).ravel()


def _bounds(mesh: Mesh, reach: float | None, held: Any = ()) -> Any:
    """Build the bounds on normal offsets that keep vertices within `reach` of the design's.

    Vertices in `held` are fixed and have no unknown. None without a reach.
    """
    return None if reach is None else partial(_offset_bounds, mesh, reach, held)


def _offset_bounds(mesh: Mesh, reach: float, held: Any, coordinates: Array) -> tuple[Array, Array]:
    points = coordinates.reshape(-1, 3)
    n = vertex_normals(mesh.replaced(points))
    u = points - mesh.vertices
    along = (u * n).sum(axis=1)
    root = np.sqrt(np.maximum(along**2 - (u * u).sum(axis=1) + reach**2, 0.0))
    low, high = np.minimum(-along - root, 0.0), np.maximum(-along + root, 0.0)
    return np.delete(low, held), np.delete(high, held)


def _inside(points: Array, mesh: Mesh, reach: float | None) -> Array:
    """Project points into the balls of radius `reach` around their vertices in the design."""
    if reach is None:
        return points
    u = points - mesh.vertices
    length = np.linalg.norm(u, axis=1, keepdims=True)
    return mesh.vertices + u * np.minimum(1.0, reach / np.maximum(length, 1e-300))


def flat_metrics(surface: Mesh, flat: Array) -> dict[str, float]:
    """Compute how well a flat image (n, 2) preserves the lengths of its surface."""
    strain = measure.principal_strains(surface, flat)
    out = {
        "isometry_energy": measure.isometry_energy(surface, flat),
        "parallelogram_strain": float(measure.parallelogram_strain(surface, flat).mean()),
        "loss_iso_cell": measure.loss_iso_cell(surface, flat),
        "edge_length_error": measure.edge_length_error(surface, flat),
        "strain_mean": strain.mean,
        "strain_p99": strain.p99,
        "flipped_cells": float(measure.flips(surface, flat)),
    }
    return {name: value for name, value in out.items() if not np.isnan(value)}


def curvature_metrics(before: Mesh, after: Mesh, scale: float) -> dict[str, float]:
    """Compute the curvature and planarity metrics that are defined for two surfaces."""
    found = {
        "loss_gc_before": measure.loss_gc(before, scale=scale),
        "loss_gc": measure.loss_gc(after, scale=scale),
        "loss_gc_worst_before": measure.loss_gc_worst(before, scale=scale),
        "loss_gc_worst": measure.loss_gc_worst(after, scale=scale),
        "loss_gc_half": measure.loss_gc_half(after, scale=scale),
        "mean_abs_K_before": measure.mean_abs_K(before, scale=scale),
        "mean_abs_K": measure.mean_abs_K(after, scale=scale),
    }
    if not before.is_triangles:
        gap = measure.nonplanarity(after)
        found |= {
            "nonplanarity_mean": float(gap.mean()),
            "nonplanarity_max": float(gap.max()),
            "nonplanarity_max_before": float(measure.nonplanarity(before).max()),
        }
    return {name: value for name, value in found.items() if not np.isnan(value)}


def metrics(before: Mesh, after: Mesh, flat: Array | None, scale: float) -> dict[str, float]:
    """Compute the published and the corrected metrics; units: :data:`gso.metrics.INFO`."""
    true = measure.surface_distance(before, after)
    percent = 100.0 / before.diagonal
    out = curvature_metrics(before, after, scale) | {
        "K_A_r": measure.K_A_r(before, after),
        "K_A_r_worst": measure.K_A_r_worst(before, after),
        "d_H": measure.d_H(before, after),
        "distance_mean": percent * 0.5 * (true.there_mean + true.back_mean),
        "distance_max": percent * max(true.there_max, true.back_max),
        "deviation_max": percent * true.there_max,
        "fairness_ratio": measure.fairness_ratio(before, after),
        "fold_max_before": float(measure.folds(before).max(initial=0.0)),
        "fold_max": float(measure.folds(after).max(initial=0.0)),
    }
    same = np.array_equal(before.faces, after.faces)
    if same:
        out["edge_ratio_min"] = float(np.nanmin(measure.edge_ratios(before, after)))
    if same and before.boundary_loops:
        loops = measure.loop_ratios(before, after)
        out |= {"loop_ratio_min": float(loops.min()), "loop_ratio_max": float(loops.max())}
    return out if flat is None else out | flat_metrics(after, flat)
