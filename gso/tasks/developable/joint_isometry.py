"""Make a surface developable by isometry: solve for the surface and its flat image together.

The objective, that of Jiang et al. 2020 with an added elongation term, is, on the design scaled
to the unit ball,

    w_isometry / 2 mean E_iso + w_mapping / 2 mean E_reg + w_fairness / 2 (mean E_fair
    + w_flat mean E_fair') + w_closest / 2 mean d_n^2 + w_place / 2 mean |u|^2
    + w_elongation / 2 mean (elongation)^2

with E_iso the squared differences, between surface and plane, of the faces' squared diagonals
and their product, relative to the mean one; E_reg the regulariser of the mapping; E_fair and
E_fair' the squared second derivatives of surface and image; d_n the distance from the tangent
plane at the closest point of the design; u the displacement of a vertex from the design, whose
term keeps the mesh from sliding; and the elongation of an edge zero within a range of length
ratios. The fairness weight starts large and falls tenfold from stage to stage until E_iso is
small.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

from gso import metrics as measure
from gso import parametrization
from gso.energy import (
    Weighted,
    christoffel,
    congruence,
    elongation,
    fairness,
    gauss_image,
    proximity,
)
from gso.energy.losses import Absolute
from gso.errors import OptionError
from gso.hierarchy import coarser, resample_like
from gso.mesh import Mesh
from gso.mesh.cut import Cut
from gso.mesh.normals import vertex_normals
from gso.status import Status
from gso.tasks import constrained, per_component
from gso.tasks.base import Plan, Stage
from gso.tasks.developable import flat_image, hidden_curvature, spline_stage
from gso.tasks.developable.analysis import Analysis
from gso.tasks.developable.bounds import radius
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout, Variables, ball_bounds, framed_displacements, free

#: Factor by which the fairness weight falls from stage to stage.
_FALL = 10.0
#: Tolerance (relative decrease of the energy) of all stages but the last.
_NEARLY = 1e-3
#: A warm start whose isometry defect is below this multiple of `isometry_threshold`
#: needs no coarser grids.
_ISOMETRIC = 100.0
#: Weights in turn of curvature by the normals of quads, where these hide some, and its smoothing.
_IMAGE, _EPS = (2e-3, 1e-2, 5e-2), 0.007
#: Smallest iteration limit where the design needs no change and only its image is solved for.
_UNROLL = 100


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the developable task's formulation "isometry"; lengths in the unit ball.

    Attributes
    ----------
    w_isometry : float
        Weight of the mean squared isometry defect of the faces.
    w_mapping : float
        Weight of the regulariser of the mapping: the mean squared difference, between surface
        and flat image, of the inner products of second differences and edges.
    w_fairness : float
        Final weight of the mean squared second derivative.
    w_fairness_start : float
        Initial fairness weight, which falls tenfold from stage to stage. Not used with `x0`.
    w_flat : float
        Fairness weight of the flat image, relative to that of the surface.
    w_closest : float
        Weight of the squared distance from the tangent plane at the closest point of the
        design.
    w_place : float
        Weight of the squared displacement of the vertices from the design.
    w_elongation : float
        Weight of edges of the surface much shorter or longer than in the design.
    isometry_threshold : float
        Stopping threshold: the remaining stages of lower fairness are skipped when the mean
        squared isometry defect is at most this.
    begin : {"curvature", "design"}
        Start from the result of the formulation "curvature", or from the design itself, as
        published: then curvature that coarse quads hide is not looked for. Ignored with `x0` or
        constraints, which determine their own start.
    variables : {"free", "surface"}
        Free vertices, or (on grids) a last stage in the control points of a bicubic B-spline
        surface, returned as the result's `spline`.
    controls : int
        "surface": control points along each side; fewer on small grids.
    coarse_size : int
        With begin "design" or `x0`: largest side of the coarsest grid; 0 for no coarser grids.
    coarse_iterations : int
        With begin "design" or `x0`: iterations of each stage on coarser grids.
    developable_below : float
        A design whose mean |K| is below this is developable already: it is returned unchanged,
        with its flat image, unless there are constraints, `x0` or variables "surface".
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"iterations": 6},
        "balanced": {},
        "accurate": {"iterations": 40, "tolerance": 1e-5},
        "jiang2020": {"begin": "design", "iterations": 15, "w_elongation": 0.0},
    }

    iterations: int = 15
    tolerance: float = 1e-3
    method: str = "levenberg-marquardt"
    w_isometry: float = 100.0
    w_mapping: float = 3.0
    w_fairness: float = 1e-4
    w_fairness_start: float = 1e-3
    w_flat: float = 0.01
    w_closest: float = 0.5
    w_place: float = 0.5
    w_elongation: float = 1.0
    isometry_threshold: float = 1e-8
    begin: str = "curvature"
    variables: str = "free"
    controls: int = 16
    coarse_size: int = 32
    coarse_iterations: int = 12
    developable_below: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.begin not in ("curvature", "design"):
            raise OptionError(f"begin is {self.begin!r}; take 'curvature' or 'design'")
        if self.variables not in ("free", "surface"):
            raise OptionError(f"variables is {self.variables!r}; take 'free' or 'surface'")
        if self.controls < 4:
            raise OptionError(f"controls is {self.controls}; it must be 4 or more")
        for name in ("w_isometry", "w_fairness"):
            if not getattr(self, name) > 0:
                raise OptionError(f"{name} must be positive")
        if not self.w_closest + self.w_place > 0:
            raise OptionError("w_closest or w_place must be positive, or nothing stays in place")


def plan(
    analysis: Analysis,
    request: Request[Options],
    curvature: Callable[[Analysis, Request[Options]], Plan],
) -> Plan:
    """Plan the stages of the joint solve.

    Parameters
    ----------
    analysis : Analysis
        The design and its constraints.
    request : Request
        What to solve, with the options of this formulation.
    curvature : callable
        Makes the plan of the formulation "curvature", for the start.

    Raises
    ------
    MeshError
        A component is closed or has handles: it has no flat image.
    """
    mesh, options, constraints = analysis.mesh, request.options, analysis.constraints
    spline = spline_stage.controls(analysis, request)
    _check_bound(analysis, request)
    if request.x0 is None:
        begun, opened = mesh, analysis.opened
    else:
        begun = mesh.replaced(request.x0)
        opened = parametrization.opened(begun)
    cut = opened.cut
    own = spline is None and request.x0 is None and constraints.empty
    if own and measure.loss_gc_worst(mesh, scale=1.0) <= options.developable_below:
        return _unrolling(analysis, request, opened)
    levels = _levels(analysis, request, begun)
    stages = _chain(analysis, request, [*levels, mesh], cut)
    before: list[Stage] = []
    start = [*resample_like(levels, begun), begun][0].vertices
    if not constraints.empty:
        before = [constrained.approach(analysis, start)]
    elif request.x0 is None and options.begin == "curvature":
        first = curvature(analysis, request)
        before, start = list(first.stages), first.start.reshape(-1, 3)
    enter = partial(flat_image.with_flat, levels[0] if levels else mesh, cut)
    stages[0] = replace(stages[0], enter=enter)
    if spline is not None:
        # The spline stage comes last, so no stage before it may end the solve.
        stages = [replace(stage, finished=None) for stage in stages]
        stages.append(spline_stage.stage(stages[-1], mesh, spline))
    bent = [partial(_with_normals, stages[-1], mesh, weight) for weight in _IMAGE]
    return Plan(
        flat_image.layout_of(mesh, cut),
        start.ravel(),
        [*before, *stages],
        # With bounds rounding grows over more stages, and symmetric designs lose their symmetry:
        # other solves than the one that was asked for have none.
        further=hidden_curvature.further(mesh, options.developable_below, stages[-1], bent)
        if spline is None
        and options.begin == "curvature"
        and (request.formulation_given or request.max_displacement is None)
        else None,
        notes=opened.notes,
        finish=partial(flat_image.place, mesh, cut),
        result_notes=partial(flat_image.notes, mesh, cut),
        spline=spline,
        cold_start=None
        if request.x0 is None
        else partial(flat_image.cold_start, [*levels, mesh], cut),
        cut=cut,
    )


def _with_normals(stage: Stage, mesh: Mesh, weight: float) -> list[Weighted]:
    """Return the terms of a stage, and curvature by the normals of quads with a weight."""
    bent = [Weighted(t, weight, Absolute(_EPS)) for t in gauss_image.build(mesh)]
    return [*stage.own_items, *bent]


def _check_bound(analysis: Analysis, request: Request[Options]) -> None:
    """Raise if constraints or options are incompatible with `max_deviation`."""
    if request.max_displacement is None:
        return
    constraints = analysis.constraints
    hard = [part for part in constraints.parts if part.hard]
    if hard:
        raise OptionError(
            f"{constraints.names[hard[0].owner]} cannot be kept with max_deviation by the "
            "formulation 'isometry'; leave one out, take 'curvature', or give it a weight"
        )
    if request.options.variables == "surface":
        raise OptionError(
            "max_deviation bounds the vertices of a mesh, not a B-spline; leave out "
            "variables='surface'"
        )


def _unrolling(
    analysis: Analysis, request: Request[Options], opened: parametrization.Opened
) -> Plan:
    """Plan to keep the design fixed and solve for its flat image."""
    mesh, options, cut = analysis.mesh, request.options, opened.cut
    flat = flat_image.initial(flat_image.open_surface(mesh, cut, mesh.vertices))
    stage = _stage(analysis, request, mesh, 0.0, cut)
    stage = replace(
        stage,
        name="unroll",
        own_items=[i for i in stage.own_items if i.term.name in ("isometry", "mapping")],
        variables=partial(flat_image.only_flat, stage.layout),
        # The surface is no unknown, so that it keeps every bound.
        bounds=None,
        iterations=max(options.iterations, _UNROLL),
        tolerance=min(options.tolerance, 1e-8),
    )
    start = stage.layout.pack({"surface": mesh.vertices, "flat": flat})
    return Plan(
        stage.layout,
        start,
        [stage],
        status=Status.ALREADY_GOOD,
        notes=opened.notes,
        finish=partial(flat_image.place, mesh, cut),
        cut=cut,
    )


def _levels(analysis: Analysis, request: Request[Options], begun: Mesh) -> list[Mesh]:
    """Return the coarser copies of the design on which to solve first, coarsest first.

    There are none if the result of the formulation "curvature" is the start, or if a warm start
    has a nearly isometric image already.
    """
    o = request.options
    grid = analysis.mesh.grid_index is not None and analysis.constraints.empty
    if not (grid and o.coarse_size):
        return []
    if request.x0 is None:
        climb = o.begin == "design" and o.variables == "free"
        return coarser(analysis.mesh, o.coarse_size) if climb else []
    flat = parametrization.begin(begun).flat
    done = measure.isometry_energy(begun, flat) <= _ISOMETRIC * o.isometry_threshold
    return [] if done else coarser(analysis.mesh, o.coarse_size)


def _chain(
    analysis: Analysis, request: Request[Options], levels: list[Mesh], cut: Cut | None = None
) -> list[Stage]:
    """Plan the stages, coarse to fine, with falling fairness on each grid.

    With a warm start there is one stage per grid, with the lowest fairness.
    """
    options = request.options
    weights = [options.w_fairness]
    while request.x0 is None and weights[0] < 0.999 * options.w_fairness_start:
        weights.insert(0, _FALL * weights[0])
    stages = []
    for below, mesh in zip([None, *levels], levels, strict=False):
        for k, weight in enumerate(weights):
            stage = _stage(analysis, request, mesh, weight, cut)
            if k == 0 and below is not None:
                stage = replace(stage, enter=partial(flat_image.refine, below, mesh))
            if mesh is levels[-1]:
                finished = partial(flat_image.is_isometric, mesh, cut, options.isometry_threshold)
                stage = replace(stage, iterations=options.iterations, finished=finished)
            else:
                stage = replace(stage, iterations=options.coarse_iterations)
            stages.append(stage)
    stages[-1] = replace(stages[-1], tolerance=options.tolerance)
    return stages


def _stage(
    analysis: Analysis,
    request: Request[Options],
    mesh: Mesh,
    w_fairness: float,
    cut: Cut | None = None,
) -> Stage:
    layout, bound = flat_image.layout_of(mesh, cut), radius(request)
    sheet = mesh if cut is None else cut.mesh
    name = "x".join(map(str, mesh.grid_shape or ("isometry",)))
    make = partial(_terms, request.options, request.weight_factor, w_fairness, cut)
    return Stage(
        f"{name}, fairness {w_fairness:.0e}",
        layout,
        # A cut refers to the whole mesh, so the components are not treated separately.
        per_component.objective(mesh, make) if cut is None else make(mesh),
        partial(_unknowns, bound, mesh, layout),
        tolerance=_NEARLY,
        limits=[parametrization.orientation(parametrization.oriented_triangles(sheet), layout)],
        bounds=None if bound is None else partial(_bounds, layout, len(mesh.vertices), bound),
        imposed=analysis.imposed if mesh is analysis.mesh else None,
    )


def _bounds(layout: Layout, count: int, bound: float, coordinates: Array) -> tuple[Array, Array]:
    return ball_bounds(layout, count, bound)


def _terms(
    o: Options, factor: float, w_fairness: float, cut: Cut | None, mesh: Mesh
) -> list[Weighted]:
    """Build the terms of one component."""
    normals = vertex_normals(mesh)
    sheet = mesh if cut is None else cut.mesh
    both = {"counterpart": "flat"}
    asked, mapped = factor * o.w_isometry, factor * o.w_mapping
    items = [Weighted(t, asked) for t in congruence.build(sheet, "surface", **both)]
    items += [Weighted(t, mapped) for t in christoffel.build(sheet, "surface", **both)]
    if cut is not None:
        items = [replace(i, term=i.term.renumbered("surface", cut.vertex)) for i in items]
    items.append(Weighted(fairness.build(mesh), w_fairness))
    items.append(Weighted(fairness.build(sheet, block="flat"), o.w_flat * w_fairness))
    if o.w_closest > 0:
        items.append(Weighted(proximity.closest(mesh, normals), o.w_closest))
    items.append(Weighted(proximity.build(mesh, normals), o.w_place))
    items.append(Weighted(elongation.build(mesh), o.w_elongation))
    return items


def _unknowns(bound: float | None, mesh: Mesh, layout: Layout, coordinates: Array) -> Variables:
    if bound is None:
        return free(layout)
    return framed_displacements(layout, mesh.vertices, vertex_normals(mesh), mesh.edges)
