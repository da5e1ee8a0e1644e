"""Flatten a surface into the plane with as little strain as possible.

``strain`` minimises the membrane strain of all corner triangles; use it for a pattern to cut.
``lengths`` minimises the published isometry defect of the cells (Wang et al. 2024), which does
not see some shear; use it for comparison. ``isometry`` minimises the squared defect of Jiang et
al. 2020 with their regulariser of the mapping, like the isometry formulation of the developable
task, but with the surface fixed. All start from an image without inverted triangles, and no step
inverts a triangle. Grids are solved coarse to fine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from gso import metrics as measure
from gso import parametrization
from gso.constraints import Compiled
from gso.energy import (
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
from gso.energy.losses import Absolute
from gso.errors import OptionError
from gso.hierarchy import coarser
from gso.mesh import Mesh
from gso.parametrization import orientation
from gso.tasks import constrained, per_component
from gso.tasks.base import Analysis, Plan, Request, Stage, same
from gso.tasks.developable.flat_image import length_notes
from gso.tasks.evaluation import parted
from gso.tasks.options import Options as BaseOptions
from gso.typing import Array
from gso.unknowns import Layout, free

FORMULATIONS = ("strain", "lengths", "isometry")
#: The formulation that a preset belongs to.
IMPLIES = {"jiang2020": "isometry"}
BLOCK = "flat"

#: Lower bound on the strain level: smaller strains are rounding errors.
_SMALLEST_LEVEL = 1e-7
#: Root-mean-square strain above which the user is told to cut the surface.
_FAR_FROM_FLAT = 0.1
#: Strain level above which the knee is lowered, so that large strains cost more.
_LARGE_STRAIN = 0.03
#: Tolerance (relative decrease of the energy) of all stages but the last.
_NEARLY = 1e-2
#: Ratio of a start's strain to the level above which an "l2" stage precedes the other loss.
_STRAINED = 1.5
#: Weight of the collapse term in ``lengths``.
_W_COLLAPSE = 3e-3
#: Weights of the collapse term in the stages of ``strain`` before the last, for large strains.
_UNSQUEEZE = (1e-2, 1e-3)


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the flatten task.

    Attributes
    ----------
    norm : {"mixed", "l2", "l1"}
        Cost of strain. "l2": its square (as rigid as possible). "l1": its absolute value, for
        the smallest mean at the price of a few large strains. "mixed": its absolute value, and
        a steep power for large strains; mean and peaks are both lower than with "l2". For
        ``lengths``, "mixed" is the same as "l1".
    w_edges : float
        ``strain`` with norm "mixed": weight of the relative change of the edges' lengths,
        relative to the strain of the corner triangles.
    knee : float
        ``strain`` with norm "mixed": multiple of the typical strain above which the steep power
        dominates; smaller numbers trade mean strain for smaller peaks.
    w_shear : float
        ``lengths``: weight of the squared shear. The lengths do not see some shear, by which
        neighbouring vertices could drift apart.
    w_fairness : float
        Weight of the mean squared second derivative of the flat image, in units of the
        surface's unit ball.
    w_mapping : float
        ``isometry``: weight of the regulariser of the mapping: the mean squared difference,
        between surface and image, of the inner products of second differences and edges.
    eps : float
        ``lengths``: length differences below this share of the cells' diagonals are penalised
        quadratically.
    coarse_size : int
        Largest side of the coarsest grid.
    relax_iterations : int
        Largest number of as-rigid-as-possible (local/global) iterations before the first stage.
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


def plan(analysis: Analysis, request: Request) -> Plan:
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
    given, refused = parametrization.given(mesh, request.start)
    typical = max(start.level, _SMALLEST_LEVEL)
    if given is None:
        stages = _stages(request, levels, typical)
    else:
        stages = _stages(request, [mesh], typical)[-1:]
        strained = parametrization.strain(mesh, given) > _STRAINED * start.level
        if strained and request.formulation == "strain":
            stages = [_strain_stage(replace(options, norm="l2"), mesh, 1.0), *stages]
    first = start.flat if given is None else given
    finish = partial(_finish, opened, given)
    if not constraints.empty:
        first = parametrization.align(mesh, first, constraints)
        stages = _constrained(analysis, request, stages)
        finish = partial(_settle, mesh, constraints)
    cold = partial(_cold, levels, constraints, start.flat)
    return Plan(
        Layout.of(len(mesh.vertices), "flat"),
        first.ravel(),
        stages,
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


def _constrained(analysis: Analysis, request: Request, stages: list[Stage]) -> list[Stage]:
    """Plan stages under constraints: first soft with growing weight, then as they are given."""
    even = _strain_stage(replace(request.options, norm="l2"), analysis.mesh, 1.0)
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
    if level > _FAR_FROM_FLAT:
        notes.append(
            f"the surface is far from any plane (strain about {level:.0%}): cut it into pieces, or "
            "cut it open where it closes around itself"
        )
    return notes


def _stages(request: Request, levels: list[Mesh], level: float) -> list[Stage]:
    """Plan coarse-to-fine stages, the last of which has the objective of the formulation."""
    options, mesh = request.options, levels[-1]
    even = options if options.norm != "l1" else replace(options, norm="mixed")
    stages = [_strain_stage(even, levels[0], level)]
    for below, above in pairwise(levels):
        enter = partial(_refine, below, above)
        stages.append(replace(_strain_stage(even, above, level), enter=enter))
    if request.formulation == "lengths":
        lengths = _length_stage(options, mesh, level)
        if len(levels) > 1:
            # The interpolated coarser image is close enough: no strain stage on this grid.
            lengths = replace(lengths, enter=stages.pop().enter)
        stages.append(lengths)
    elif request.formulation == "isometry":
        stages.append(_isometry_stage(options, mesh))
    elif options.norm == "l1":
        stages.append(_strain_stage(options, mesh, level))
    # On meshes that are not grids the last stage starts farther from the minimum.
    closer = 1.0 if levels[-1].grid_index is not None else 0.2
    stages[-1] = replace(
        stages[-1], iterations=options.iterations, tolerance=closer * options.tolerance
    )
    if request.formulation == "strain" and level > _FAR_FROM_FLAT:
        stages = [*stages[:-1], *_unsqueezing(mesh, stages[-1])]
    return stages


def _unsqueezing(mesh: Mesh, last: Stage) -> list[Stage]:
    """Precede the last stage by stages with a collapse term of falling weight.

    Where strain is large, the energy is lowest with some triangles collapsed. As a step ends
    before the first triangle that would invert, the solve would stall at them without this term.
    """
    resistance = collapse.build(mesh)
    before = [
        replace(
            last,
            own_items=[*last.own_items, *(Weighted(t, weight) for t in resistance)],
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
        per_component.objective(
            mesh, lambda own: _strain_terms(options, own, level if alone else _level(own))
        ),
    )


def _level(mesh: Mesh) -> float:
    """Compute the typical strain of one of several components."""
    return max(parametrization.begin(mesh).level, _SMALLEST_LEVEL)


def _strain_terms(options: Options, mesh: Mesh, level: float) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    if options.norm == "l2":
        items += [Weighted(t, 1.0) for t in stretch.build(mesh)]
    elif options.norm == "l1":
        loss = stretch.TwoPowerLoss(level, knee=np.inf, eps=0.03)
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
    else:
        loss = stretch.TwoPowerLoss(level, knee=options.knee * float(bent(np.float64(level))))
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
        # `TwoPowerLoss` too costs level times the strain where strains are small.
        items.append(Weighted(edges.build(mesh), options.w_edges * level, Absolute(0.1 * level)))
    return items


def bent(level: Any) -> Any:
    """Compute the factor on the knee: below one where the strain level is large."""
    return ((_LARGE_STRAIN / level) ** (1 / 3)).clip(0.68, 1.0)


def _length_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    # With several components: the mean of their cells' sizes, each in its own unit ball.
    sizes = [isometry.typical_length(p.mesh) / p.mesh.frame.scale for p in parted(mesh)]
    size = float(np.mean(sizes)) if sizes else isometry.typical_length(mesh)
    eps = options.eps * size
    items = per_component.objective(mesh, partial(_length_terms, options, level, eps))
    stage = _stage("lengths", mesh, items)
    if options.norm == "l2":
        return stage
    losses = (Absolute(10.0 * eps), Absolute(eps))
    return replace(stage, continuation=losses, continued="isometry")


def _length_terms(options: Options, level: float, eps: float, mesh: Mesh) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    items += [Weighted(t, options.w_shear) for t in shear.build(mesh)]
    items += [Weighted(t, _W_COLLAPSE) for t in collapse.build(mesh)]
    terms = isometry.build(mesh)
    if options.norm == "l2":
        # Dividing by the level makes it as large as with "l1", so the other weights can stay.
        return items + [Weighted(t, 1.0 / level) for t in terms]
    size = isometry.typical_length(mesh)
    return items + [Weighted(t, size, Absolute(eps)) for t in terms]


def _isometry_stage(options: Options, mesh: Mesh) -> Stage:
    return _stage(
        "isometry", mesh, per_component.objective(mesh, partial(_isometry_terms, options))
    )


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
        lambda _: free(layout),
        tolerance=_NEARLY,
        limits=[orientation.orientation(parametrization.oriented_triangles(mesh), layout)],
    )


def _cold(levels: list[Mesh], constraints: Compiled, flat: Array) -> Array:
    """Interpolate the image of the coarsest grid to the finest and align it to constraints."""
    for coarse, fine in pairwise(levels):
        flat = parametrization.refine(coarse, fine, flat)
    if not constraints.empty:
        flat = parametrization.align(levels[-1], flat, constraints)
    return flat.ravel()


def _refine(coarse: Mesh, fine: Mesh, coordinates: Array) -> Array:
    return parametrization.refine(coarse, fine, coordinates.reshape(-1, 2)).ravel()


def _place(mesh: Mesh, given: Array | None, coordinates: Array) -> Array:
    return parametrization.place(mesh, coordinates.reshape(-1, 2), given).ravel()


def metrics(mesh: Mesh, after: Mesh | None, flat: Array, scale: float) -> dict[str, float]:
    """Compute the metrics of a flat image (n, 2) of `mesh`; units: :data:`gso.metrics.INFO`.

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
