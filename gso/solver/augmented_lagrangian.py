"""Enforcement of hard constraints that are terms, by the method of multipliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gso.energy import Weighted
from gso.solver.minimiser import Minimum
from gso.status import Status
from gso.typing import Array
from gso.unknowns import Layout

#: Stopping threshold of the residual, in the unit ball.
TOLERANCE = 1e-7
#: Largest number of solves.
ROUNDS = 14
#: Share of the residual that a solve may leave. If more is left, the weights of the other terms
#: are multiplied by the second number, until their common factor is at most the third.
_FAST, _SOFTER, _SOFTEST = 0.3, 0.2, 1e-6

#: ``solve(items, coordinates) -> (coordinates, solution)``: minimise the weighted terms.
Solve = Callable[[Sequence[Weighted], Array], tuple[Array, Minimum]]


def tighten(
    items: Sequence[Weighted],
    layout: Layout,
    coordinates: Array,
    solution: Minimum,
    solve: Solve,
) -> tuple[Array, Minimum]:
    """Repeat a solve, with targets shifted by the residuals, until its hard terms hold.

    Parameters
    ----------
    items : sequence of Weighted
        The terms just minimised; those with `multipliers` are hard.
    layout : Layout
        The coordinates.
    coordinates, solution : ndarray, Minimum
        The final coordinates and the solution of that solve.
    solve : callable
        Minimises terms from given coordinates.

    Returns
    -------
    ndarray, Minimum
        The final coordinates; the given solution, or that of a later solve that was cancelled.
    """
    hard = [i.term.multipliers for i in items if i.term.multipliers is not None]
    if not hard or solution.status is Status.CANCELLED:
        return coordinates, solution
    before, share, end = np.inf, 1.0, solution
    for _ in range(ROUNDS):
        left = max(m.update(layout.split(coordinates)) for m in hard)
        if left <= TOLERANCE:
            break
        if left > _FAST * before and share > _SOFTEST:
            share *= _SOFTER
            for m in hard:
                m.scale(_SOFTER)
        before = left
        coordinates, solution = solve(_softer(items, share), coordinates)
        if solution.status is Status.CANCELLED:
            end = solution
            break
    for m in hard:
        # The solve may continue from here, with its own weights.
        m.scale(1.0 / share)
    return coordinates, end


def _softer(items: Sequence[Weighted], share: float) -> list[Weighted]:
    """Return the terms with the weights of all but the hard ones multiplied by `share`."""
    return [
        i if i.term.multipliers is not None else replace(i, weight=share * i.weight) for i in items
    ]
