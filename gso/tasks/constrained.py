"""Constraints in a stage: eliminated unknowns and additional terms."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from gso.constraints import Lengths, OnLines, OnPlane, Pins, Planar, Relations
from gso.energy import Weighted, curve, equation, fairness, length, planarity, position, proximity
from gso.energy.multipliers import STIFF, hardened
from gso.mesh import Mesh
from gso.tasks import per_component
from gso.tasks.base import Request, Stage
from gso.typing import Array
from gso.unknowns import Layout, Variables, free

#: Radius around a moved vertex within which others move along, in the unit ball.
_REACH = 0.3
#: Weights of the constraints in the successive stages that bring a start closer to them.
_DRAWN = (1.0, 30.0)


def hold(request: Request, variables: Variables) -> Variables:
    """Eliminate the hard linear constraints from the unknowns."""
    reduction = request.constraints.reduction
    if reduction is None:
        return variables
    layout = variables.layout
    start, _, _ = layout.where(request.constraints.block)
    return variables.following(*reduction.maps(start, layout.size))


def unknowns(request: Request, layout: Layout, coordinates: Array) -> Variables:
    """Build free coordinates with the hard linear constraints eliminated, for a stage."""
    return hold(request, free(layout))


def approach(request: Request, points: Array, *, iterations: int = 10) -> Stage:
    """Plan the smallest and smoothest change of a surface (n, 3) that satisfies the constraints.

    It minimises the mean of ``|u|^2 + reach^4 |second derivative of u|^2`` over the displacement
    u, so that a moved vertex takes its neighbourhood along.
    """
    layout = Layout.of(len(points), "surface")
    mesh = request.mesh
    items = per_component.objective(mesh, _smallest, points) + pulls(request)
    variables = partial(unknowns, request, layout)
    return Stage("approach", layout, items, variables, iterations=iterations)


def _smallest(mesh: Mesh, points: Array) -> list[Weighted]:
    """Build the terms that keep a mesh near points (n, 3) and its displacement smooth."""
    near = proximity.build(mesh.replaced(points), np.zeros_like(points))
    return [
        Weighted(near, 1.0),
        Weighted(fairness.build(mesh, reference=points), _REACH**4),
    ]


def drawing(request: Request, stage: Stage) -> list[Stage]:
    """Copy a stage, with all constraints soft and of growing weight, to approach them."""
    return [
        replace(stage, name="approach", items=stage.items + _drawn(request, weight))
        for weight in _DRAWN
    ]


def keeping(request: Request, stage: Stage) -> Stage:
    """Copy a stage of free coordinates, with the constraints imposed."""
    variables = partial(unknowns, request, stage.layout)
    return replace(stage, items=stage.items + pulls(request), variables=variables)


def _drawn(request: Request, weight: float) -> list[Weighted]:
    """Build all but planarity constraints as terms of one weight, to approach them."""
    c = request.constraints
    block = c.block
    out = []
    for p in c.parts:
        if isinstance(p, Pins):
            term = position.build(p.ids, p.positions, np.ones(len(p.ids)), block=block)
        elif isinstance(p, OnPlane | Relations):
            term = equation.build(p, block=block)
        elif isinstance(p, Lengths):
            term = length.build(p.pairs, p.lengths, block=block)
        elif isinstance(p, OnLines):
            term = curve.build(replace(p, weight=1.0), block=block)
        else:
            continue
        out.append(Weighted(term, weight))
    return out


def pulls(request: Request) -> list[Weighted]:
    """Build the terms of soft constraints and of hard non-linear ones, on the design's vertices.

    The constrained block must be the first of the stage's layout. Terms of hard constraints have
    `multipliers` (augmented Lagrangian): the last stage is repeated until they hold.
    """
    c = request.constraints
    block, dim = c.block, 2 if c.flat else 3
    out = []
    for hard in (False, True):
        factor = STIFF if hard else 1.0
        terms = []
        for p in c.of(Planar, hard=hard):
            terms.append(planarity.build(p.quads, weight=p.weight or 1.0))
        for e in c.of(Lengths, hard=hard):
            terms.append(length.build(e.pairs, e.lengths, block=block, weight=e.weight or 1.0))
        if hard:
            terms = [hardened(t, dim) for t in terms]
        terms += [curve.build(p, block=block) for p in c.of(OnLines, hard=hard)]
        out += [Weighted(t, factor) for t in terms]
    for pin in c.of(Pins, hard=False):
        weights = np.full(len(pin.ids), pin.weight)
        out.append(Weighted(position.build(pin.ids, pin.positions, weights, block=block), 1.0))
    return out
