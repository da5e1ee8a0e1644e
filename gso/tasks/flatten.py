"""Lay a surface out in the plane with as little stretch as possible.

``strain`` minimises the membrane strain of all corner triangles: the sheet to cut.
``lengths`` minimises the published isometry defect of the cells, which is blind to some
shear: a figure to compare. ``isometry`` minimises the squared defect of Jiang et al. 2020
with their regulariser of the mapping: what the developable task's isometry does, with the
surface as it is. All start from an image without flips, and no step turns a triangle over.
Grids are solved coarse to fine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gso import flat_start, limits
from gso import metrics as measure
from gso.mesh import Mesh
from gso.resample import coarser
from gso.status import OptionError
from gso.tasks import held, joined
from gso.tasks.base import Plan, Request, Stage, open_up, same
from gso.tasks.joint import lengths_remark
from gso.tasks.measured import parted
from gso.tasks.options import Options as BaseOptions
from gso.terms import (
    Weighted,
    christoffel,
    collapse,
    congruence,
    edges,
    fairness,
    isometry,
    shear,
    stretch,
)
from gso.terms.losses import Absolute
from gso.variables import Layout, Variables, free

Array = NDArray[np.float64]

FORMULATIONS = ("strain", "lengths", "isometry")
#: The formulation that a preset belongs to.
IMPLIES = {"jiang2020": "isometry"}
BLOCK = "flat"

#: Strains below it are rounding errors, and are not told apart.
_SMALLEST_LEVEL = 1e-7
#: Root-mean-square strain above which the user is told to cut the surface.
_FAR_FROM_FLAT = 0.1
#: Typical strain above which large strains are made more expensive.
_LARGE_STRAIN = 0.03
#: Relative fall of the energy at which a stage that only prepares another one stops.
_NEARLY = 1e-2
#: Ratio to the level at which a start is strained too much for the powers of `Spread`.
_STRAINED = 1.5
#: Weight of the squeezed triangles in ``lengths``.
_W_COLLAPSE = 3e-3
#: Their weights, one after the other, on the way to a much strained image in ``strain``.
_UNSQUEEZE = (1e-2, 1e-3)


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the flatten task.

    Attributes
    ----------
    norm : {"mixed", "l2", "l1"}
        What strain costs. "l2": its square (as rigid as possible). "l1": its size, for the
        smallest mean at the price of a few large strains. "mixed": its size, and steeply
        more for large strains; mean and peaks both come out lower than with "l2". For
        ``lengths``, "mixed" is the same as "l1".
    w_edges : float
        ``strain`` with norm "mixed": weight of the relative change of the edges' lengths,
        beside that of the corner triangles' strain.
    knee : float
        ``strain`` with norm "mixed": strains of more than this many times the typical one
        are made expensive; smaller numbers trade mean strain for smaller peaks.
    w_shear : float
        ``lengths``: weight of the squared shear, which keeps neighbouring vertices from
        drifting apart unseen.
    w_fairness : float
        Weight of the mean squared second derivative of the flat image, in units of the
        surface's unit ball.
    w_mapping : float
        ``isometry``: weight of the mean squared difference of the polylines' second
        differences, seen in the mesh itself, between surface and image.
    eps : float
        ``lengths``: differences of length below this share of the cells' diagonals count
        squared.
    coarse_size : int
        Largest side of the coarsest grid.
    relax_iterations : int
        Largest number of local and global steps before the first stage.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"iterations": 2, "tolerance": 5e-2},
        "balanced": {},
        "accurate": {"iterations": 100, "tolerance": 1e-8},
        "jiang2020": {"iterations": 60, "tolerance": 1e-4},
    }

    iterations: int = 40
    tolerance: float = 1e-2
    norm: str = "mixed"
    w_edges: float = 0.35
    knee: float = 2.2
    w_shear: float = 1e-2
    w_fairness: float = 0.0
    w_mapping: float = 0.03
    eps: float = 3e-4
    coarse_size: int = 40
    relax_iterations: int = 100

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.norm not in ("mixed", "l2", "l1"):
            raise OptionError(f"norm is {self.norm!r}; take 'mixed', 'l2' or 'l1'")
        if not (self.eps > 0 and self.knee > 0):
            raise OptionError("eps and knee must be positive")
        if self.coarse_size < 4:
            raise OptionError(f"coarse_size is {self.coarse_size}; it must be 4 or more")


def plan(request: Request) -> Plan:
    """Stages of the solve, from an image without flips to the one wanted.

    Raises
    ------
    MeshError
        A component is closed or has handles: it must be cut open first.
    """
    options = request.options
    opened = open_up(request)
    request = replace(request, mesh=opened.mesh)
    mesh = request.mesh
    grid = mesh.grid_index is not None and request.constraints.empty
    levels = [*(coarser(mesh, options.coarse_size) if grid else []), mesh]
    start = flat_start.begin(
        levels[0], iterations=options.relax_iterations, doubtful=opened.doubtful
    )
    notes = [*opened.notes, *_remarks(mesh, start.level)]
    given, refused = flat_start.given(mesh, request.start)
    strained = given is not None and flat_start.strain(mesh, given) > _STRAINED * start.level
    below = levels
    if given is not None:
        levels = [mesh]
    stages = _stages(request, levels, max(start.level, _SMALLEST_LEVEL))
    if given is not None:
        stages = stages[-1:]
        if strained and request.formulation == "strain":
            stages = [_strain_stage(replace(options, norm="l2"), mesh, 1.0), *stages]
    first = start.flat if given is None else given
    finish = partial(_finish, opened, given)
    if not request.constraints.empty:
        first = flat_start.align(mesh, first, request.constraints)
        stages = _bound(request, stages)
        finish = partial(_settle, request)
    return Plan(
        Layout.of(len(mesh.vertices), "flat"),
        first.ravel(),
        stages,
        notes=notes,
        details={"strain_level": start.level},
        finish=finish,
        remark=partial(_remark, opened) if request.formulation == "isometry" else None,
        unstarted=None if given is None else partial(_unstarted, request, below, start.flat),
        refused=refused,
        cut=opened.cut,
    )


def _finish(opened: flat_start.Opened, given: Array | None, coordinates: Array) -> Array:
    """The image in its place, in the numbering of the cut mesh where there is one."""
    return opened.back(_place(opened.mesh, given, coordinates).reshape(-1, 2)).ravel()


def _remark(opened: flat_start.Opened, coordinates: Array) -> list[str]:
    surface = opened.mesh if opened.cut is None else opened.cut.mesh
    return lengths_remark(surface, coordinates.reshape(-1, 2))


def _bound(request: Request, stages: list[Stage]) -> list[Stage]:
    """Stages under constraints: first the sheet is drawn to them, then it keeps them."""
    even = _strain_stage(replace(request.options, norm="l2"), request.mesh, 1.0)
    steps = held.drawing(request, replace(even, iterations=30))
    return [*steps, *(held.keeping(request, stage) for stage in (even, *stages))]


def _settle(request: Request, coordinates: Array) -> Array:
    """Constrained images stay where they are, but for parts that nothing holds."""
    mesh, flat = request.mesh, coordinates.reshape(-1, 2)
    if not request.constraints.anchored and len(flat_start.parts(mesh)) == 1:
        return _place(mesh, None, coordinates)
    return flat_start.settle(mesh, flat, request.constraints).ravel()


def _remarks(mesh: Mesh, level: float) -> list[str]:
    notes = []
    parts = flat_start.parts(mesh)
    if len(parts) > 1:
        notes.append(f"the {len(parts)} components are laid out side by side")
    if sum(map(len, parts)) < len(mesh.vertices):
        notes.append("vertices that belong to no face are at the pattern's origin")
    if level > _FAR_FROM_FLAT:
        notes.append(
            f"the surface is far from any plane (strain about {level:.0%}): cut it into pieces, or "
            "cut it open where it closes around itself"
        )
    return notes


def _stages(request: Request, levels: list[Mesh], level: float) -> list[Stage]:
    """Coarse to fine; the last stage is the one wanted, the others prepare it."""
    options, mesh = request.options, levels[-1]
    even = options if options.norm != "l1" else replace(options, norm="mixed")
    stages = [_strain_stage(even, m, level) for m in levels]
    for below, above, stage in zip(levels, levels[1:], stages[1:], strict=False):
        stage.enter = partial(_refine, below, above)
    if request.formulation == "lengths":
        lengths = _length_stage(options, mesh, level)
        if len(levels) > 1:
            # What comes from a coarser grid is near enough.
            lengths.enter = stages.pop().enter
        stages.append(lengths)
    elif request.formulation == "isometry":
        stages.append(_isometry_stage(options, mesh))
    elif options.norm == "l1":
        stages.append(_strain_stage(options, mesh, level))
    # Without a coarser grid before it, the last stage has farther to go.
    closer = 1.0 if levels[-1].grid_index is not None else 0.2
    stages[-1].iterations, stages[-1].tolerance = options.iterations, closer * options.tolerance
    if request.formulation == "strain" and level > _FAR_FROM_FLAT:
        stages = [*stages[:-1], *_unsqueezing(mesh, stages[-1])]
    return stages


def _unsqueezing(mesh: Mesh, last: Stage) -> list[Stage]:
    """Stages that keep triangles from being squeezed flat, before the last one.

    Much strain is least where some triangles have no area left. A step ends at the first
    triangle that would turn over: without resistance the solve comes to a halt there.
    """
    resistance = collapse.build(mesh)
    before = [
        replace(
            last,
            items=[*last.items, *(Weighted(t, weight) for t in resistance)],
            enter=last.enter if k == 0 else same,
            tolerance=_NEARLY,
        )
        for k, weight in enumerate(_UNSQUEEZE)
    ]
    return [*before, replace(last, enter=same)]


def _strain_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    alone = not parted(mesh)
    return _stage(
        "strain",
        mesh,
        joined.objective(
            mesh, lambda own: _strain_terms(options, own, level if alone else _level(own))
        ),
    )


def _level(mesh: Mesh) -> float:
    """Typical strain of a component among others."""
    return max(flat_start.begin(mesh).level, _SMALLEST_LEVEL)


def _strain_terms(options: Options, mesh: Mesh, level: float) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    if options.norm == "l2":
        items += [Weighted(t, 1.0) for t in stretch.build(mesh)]
    elif options.norm == "l1":
        loss = stretch.Spread(level, knee=np.inf, eps=0.03)
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
    else:
        loss = stretch.Spread(level, knee=options.knee * float(bent(np.float64(level))))
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
        # Level times the size is what `Spread` costs at small strains, too.
        items.append(Weighted(edges.build(mesh), options.w_edges * level, Absolute(0.1 * level)))
    return items


def bent(level: Any) -> Any:
    """Share of the knee: less where the strain is so large that peaks must be held down."""
    return ((_LARGE_STRAIN / level) ** (1 / 3)).clip(0.68, 1.0)


def _length_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    # Of several components, sizes are those of their cells, each in its own unit ball.
    sizes = [isometry.typical_length(p.mesh) / p.mesh.frame.scale for p in parted(mesh)]
    size = float(np.mean(sizes)) if sizes else isometry.typical_length(mesh)
    eps = options.eps * size
    items = joined.objective(mesh, partial(_length_terms, options, level, eps))
    stage = _stage("lengths", mesh, items)
    if options.norm == "l2":
        return stage
    return replace(stage, eps=(10.0 * eps, eps), robust="isometry")


def _length_terms(options: Options, level: float, eps: float, mesh: Mesh) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    items += [Weighted(t, options.w_shear) for t in shear.build(mesh)]
    items += [Weighted(t, _W_COLLAPSE) for t in collapse.build(mesh)]
    terms = isometry.build(mesh)
    if options.norm == "l2":
        # Divided by the level it is as large as with "l1", and so are the other weights.
        return items + [Weighted(t, 1.0 / level) for t in terms]
    size = isometry.typical_length(mesh)
    return items + [Weighted(t, size, Absolute(eps)) for t in terms]


def _isometry_stage(options: Options, mesh: Mesh) -> Stage:
    return _stage("isometry", mesh, joined.objective(mesh, partial(_isometry_terms, options)))


def _isometry_terms(options: Options, mesh: Mesh) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    items += [Weighted(t, 1.0) for t in congruence.build(mesh, "flat")]
    return items + [Weighted(t, options.w_mapping) for t in christoffel.build(mesh, "flat")]


def _fair(mesh: Mesh, weight: float) -> list[Weighted]:
    return [Weighted(fairness.build(mesh, block="flat"), weight)] if weight > 0 else []


def _stage(name: str, mesh: Mesh, items: list[Weighted]) -> Stage:
    layout = Layout.of(len(mesh.vertices), "flat")
    return Stage(
        name,
        layout,
        items,
        partial(_unknowns, layout),
        tolerance=_NEARLY,
        limits=[limits.orientation(flat_start.upward(mesh), layout)],
    )


def _unknowns(layout: Layout, coordinates: Array) -> Variables:
    return free(layout)


def _unstarted(request: Request, levels: list[Mesh], flat: Array) -> Array:
    """An image of the first grid on the last one, near its constraints."""
    for coarse, fine in pairwise(levels):
        flat = flat_start.refine(coarse, fine, flat)
    if not request.constraints.empty:
        flat = flat_start.align(levels[-1], flat, request.constraints)
    return flat.ravel()


def _refine(coarse: Mesh, fine: Mesh, coordinates: Array) -> Array:
    return flat_start.refine(coarse, fine, coordinates.reshape(-1, 2)).ravel()


def _place(mesh: Mesh, given: Array | None, coordinates: Array) -> Array:
    return flat_start.place(mesh, coordinates.reshape(-1, 2), given).ravel()


def metrics(mesh: Mesh, after: Mesh | None, flat: Array, scale: float) -> dict[str, float]:
    """Metrics of a flat image (n, 2) of `mesh`; units: :data:`gso.metrics.INFO`.

    ``loss_iso_cell`` is left out on a mesh without quads.
    """
    strain = measure.principal_strains(mesh, flat)
    out = {
        "loss_iso_cell": measure.loss_iso_cell(mesh, flat),
        "edge_length_error": measure.edge_length_error(mesh, flat),
        "strain_mean": strain.mean,
        "strain_p99": strain.p99,
        "strain_max": float(strain.values.max()),
        "area_error": measure.area_error(mesh, flat),
        "flipped_cells": float(measure.flips(mesh, flat)),
    }
    return {name: value for name, value in out.items() if not np.isnan(value)}
