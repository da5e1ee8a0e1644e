"""Constraints that are terms are made to hold: the method of multipliers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gso.status import Status
from gso.tasks.base import Stage
from gso.tno.solver import Solution

Array = NDArray[np.float64]

#: Residual, in the unit ball, that is small enough.
ENOUGH = 1e-7
#: Most solves.
ROUNDS = 14
#: Share of the residual that a solve should leave; else the other terms weigh less from then
#: on, by the second number each time, down to the last.
_FAST, _SOFTER, _SOFTEST = 0.3, 0.2, 1e-6

#: ``solve(stage, coordinates) -> (coordinates, solution)``
Solve = Callable[[Stage, Array], tuple[Array, Solution]]


def tighten(
    stage: Stage, coordinates: Array, solution: Solution, solve: Solve
) -> tuple[Array, Solution]:
    """Repeat a stage, its targets moved by what is left, until its hard terms hold.

    Parameters
    ----------
    stage : Stage
        The one just solved.
    coordinates, solution : ndarray, Solution
        Where it ended, and how.
    solve : callable
        Solves a stage.

    Returns
    -------
    ndarray, Solution
        Where the solve ends now; the solution that of the stage itself, unless a later one
        was stopped.
    """
    hard = [i.term.multipliers for i in stage.items if i.term.multipliers is not None]
    if not hard:
        return coordinates, solution
    if solution.status is Status.CANCELLED:
        return coordinates, solution
    before, share, end = np.inf, 1.0, solution
    stage = replace(stage, eps=stage.eps[-1:])
    for _ in range(ROUNDS):
        left = max(m.push(coordinates) for m in hard)
        if left <= ENOUGH:
            break
        if left > _FAST * before and share > _SOFTEST:
            share *= _SOFTER
            for m in hard:
                m.scale(_SOFTER)
        before = left
        coordinates, solution = solve(_softer(stage, share), coordinates)
        if solution.status is Status.CANCELLED:
            end = solution
            break
    for m in hard:
        # The stage itself may go on from here, with its own weights.
        m.scale(1.0 / share)
    return coordinates, end


def _softer(stage: Stage, share: float) -> Stage:
    """The stage with less weight on all terms but the hard ones."""
    items = [
        i if i.term.multipliers is not None else replace(i, weight=share * i.weight)
        for i in stage.items
    ]
    return replace(stage, items=items)
