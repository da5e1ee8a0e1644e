"""The stages of the flatten task, by formulation and norm."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from gso import parametrization
from gso.components import several, split
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
from gso.mesh import Mesh
from gso.tasks import per_component
from gso.tasks.base import Stage, same
from gso.tasks.flatten.options import Options
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout, free

#: Lower bound on the strain level: smaller strains are rounding errors.
SMALLEST_LEVEL = 1e-7
#: Root-mean-square strain above which the user is told to cut the surface.
FAR_FROM_FLAT = 0.1
#: Tolerance (relative decrease of the energy) of all stages but the last.
_NEARLY = 1e-2
#: Ratio of a start's strain to the level above which an "l2" stage precedes the other loss.
STRAINED = 1.5
#: Powers of the strain in ``minimax``, with the number of iterations of each but the last; ratio
#: of the strain at which they are scaled to the typical one.
_POWERS = ((4.0, 6), (8.0, 6), (16.0, 6), (32.0, 1))
_PEAK = 2.0
#: Weight of the collapse term in ``lengths``.
_W_COLLAPSE = 3e-3
#: Weights of the collapse term in the stages of ``strain`` before the last, for large strains.
_UNSQUEEZE = (1e-2, 1e-3)


def planned_stages(request: Request[Options], levels: list[Mesh], level: float) -> list[Stage]:
    """Plan coarse-to-fine stages, the last of which has the objective of the formulation."""
    options, mesh = request.options, levels[-1]
    even = options if options.norm != "l1" else replace(options, norm="mixed")
    stages = [strain_stage(even, levels[0], level)]
    for below, above in pairwise(levels):
        enter = partial(refine, below, above)
        stages.append(replace(strain_stage(even, above, level), enter=enter))
    if request.formulation == "lengths":
        lengths = _length_stage(options, mesh, level)
        if len(levels) > 1:
            # The interpolated coarser image is close enough: no strain stage on this grid.
            lengths = replace(lengths, enter=stages.pop().enter)
        stages.append(lengths)
    elif request.formulation == "isometry":
        stages.append(_isometry_stage(options, mesh))
    elif request.formulation == "minimax":
        stages.append(_minimax_stage(options, mesh, level))
    elif options.norm == "l1":
        stages.append(strain_stage(options, mesh, level))
    last = len(levels) - 1
    stages = [with_own_terms(request, levels[min(k, last)], s) for k, s in enumerate(stages)]
    # On meshes that are not grids the last stage starts farther from the minimum.
    closer = 1.0 if levels[-1].grid_index is not None else 0.2
    tolerance, rising = closer * options.tolerance, 0
    if request.formulation == "minimax":
        # The energy is a high power of the largest strain.
        tolerance, rising = 0.5 * _POWERS[-1][0] * tolerance, len(stages[-1].continuation)
    stages[-1] = replace(stages[-1], iterations=options.iterations + rising, tolerance=tolerance)
    if request.formulation == "strain" and level > FAR_FROM_FLAT:
        stages = [*stages[:-1], *_unsqueezing(mesh, stages[-1])]
    return stages


def with_own_terms(request: Request[Options], mesh: Mesh, stage: Stage) -> Stage:
    """Add the user's own terms to a stage on a mesh, a flat image of which it computes."""
    if not request.terms:
        return stage
    own = per_component.objective(mesh, lambda one: request.own_items(one, stage.own_items))
    return replace(stage, own_items=[*stage.own_items, *own])


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


def strain_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    """Build the stage that minimises the strain, of the typical size `level`."""
    alone = not several(mesh)

    def make(own: Mesh) -> list[Weighted]:
        return _strain_terms(options, own, level if alone else _level(own))

    return _stage("strain", mesh, per_component.objective(mesh, make))


def _level(mesh: Mesh) -> float:
    """Compute the typical strain of one of several components."""
    return max(parametrization.begin(mesh).level, SMALLEST_LEVEL)


def _strain_terms(options: Options, mesh: Mesh, level: float) -> list[Weighted]:
    items = _fair(mesh, options.w_fairness)
    if options.norm == "l2":
        items += [Weighted(t, 1.0) for t in stretch.build(mesh)]
    elif options.norm == "l1":
        loss = stretch.TwoPowerLoss(level, knee=np.inf, eps=0.03)
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
    else:
        loss = stretch.TwoPowerLoss(level, knee=stretch.lowered(options.knee, np.float64(level)))
        items += [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]
        # `TwoPowerLoss` too costs level times the strain where strains are small.
        items.append(Weighted(edges.build(mesh), options.w_edges * level, Absolute(0.1 * level)))
    return items


def _length_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    # With several components: the mean of their cells' sizes, each in its own unit ball.
    if several(mesh):
        parts = [part.mesh for part in split(mesh)]
        size = float(np.mean([isometry.typical_length(p) / p.frame.scale for p in parts]))
    else:
        size = isometry.typical_length(mesh)
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


def _minimax_stage(options: Options, mesh: Mesh, level: float) -> Stage:
    scale = _PEAK * level
    terms = per_component.objective(mesh, partial(_minimax_terms, options, scale))
    losses = tuple(stretch.PowerLoss(scale, q) for q, count in _POWERS for _ in range(count))
    return replace(_stage("minimax", mesh, terms), continuation=losses, continued="strain")


def _minimax_terms(options: Options, scale: float, mesh: Mesh) -> list[Weighted]:
    loss = stretch.PowerLoss(scale, _POWERS[-1][0])
    items = _fair(mesh, options.w_fairness)
    return items + [Weighted(t, 1.0, loss) for t in stretch.build(mesh)]


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
        limits=[parametrization.orientation(parametrization.oriented_triangles(mesh), layout)],
    )


def refine(coarse: Mesh, fine: Mesh, coordinates: Array) -> Array:
    return parametrization.refine(coarse, fine, coordinates.reshape(-1, 2)).ravel()
