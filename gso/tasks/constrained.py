"""Stages that bring a start closer to its constraints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.constraints import Compiled
from gso.energy import Weighted, fairness, proximity
from gso.mesh import Mesh
from gso.tasks import per_component
from gso.tasks.base import Analysis, Stage
from gso.typing import Array
from gso.unknowns import Layout, free

#: Radius around a moved vertex within which others move along, in the unit ball.
_REACH = 0.3
#: Weights of the constraints in the successive stages that bring a start closer to them.
_DRAWN = (1.0, 30.0)


def approach(analysis: Analysis, points: Array, *, iterations: int = 10) -> Stage:
    """Plan the smallest and smoothest change of a surface (n, 3) that satisfies the constraints.

    It minimises the mean of ``|u|^2 + reach^4 |second derivative of u|^2`` over the displacement
    u, so that a moved vertex takes its neighbourhood along.
    """
    layout = Layout.of(len(points), "surface")
    return Stage(
        "approach",
        layout,
        per_component.objective(analysis.mesh, _smallest, points),
        lambda _: free(layout),
        iterations=iterations,
        imposed=analysis.imposed,
    )


def _smallest(mesh: Mesh, points: Array) -> list[Weighted]:
    """Build the terms that keep a mesh near points (n, 3) and its displacement smooth."""
    near = proximity.build(mesh.replaced(points), np.zeros_like(points))
    return [
        Weighted(near, 1.0),
        Weighted(fairness.build(mesh, reference=points), _REACH**4),
    ]


def gradual(constraints: Compiled, stage: Stage) -> list[Stage]:
    """Copy a stage, with all constraints soft and of growing weight, to approach them."""
    return [
        replace(stage, name="approach", own_items=[*stage.own_items, *_soft(constraints, weight)])
        for weight in _DRAWN
    ]


def _soft(c: Compiled, weight: float) -> list[Weighted]:
    """Build all but planarity constraints as terms of one weight, to approach them."""
    terms = (part.soft_term(c.block) for part in c.parts)
    return [Weighted(term, weight) for term in terms if term is not None]
