"""Enforcement of hard constraints that are terms, by the method of multipliers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gso.status import Status
from gso.tasks.base import Stage
from gso.tno.solver import Solution
from gso.typing import Array

#: Stopping threshold of the residual, in the unit ball.
ENOUGH = 1e-7
#: Largest number of solves.
ROUNDS = 14
#: Share of the residual that a solve may leave. If more is left, the weights of the other terms
#: are multiplied by the second number, until their common factor is at most the third.
_FAST, _SOFTER, _SOFTEST = 0.3, 0.2, 1e-6

#: ``solve(stage, coordinates) -> (coordinates, solution)``
Solve = Callable[[Stage, Array], tuple[Array, Solution]]


def tighten(
    stage: Stage, coordinates: Array, solution: Solution, solve: Solve
) -> tuple[Array, Solution]:
    """Repeat a stage, with targets shifted by the residuals, until its hard terms hold.

    Parameters
    ----------
    stage : Stage
        The stage just solved.
    coordinates, solution : ndarray, Solution
        Its final coordinates and its solution.
    solve : callable
        Solves a stage.

    Returns
    -------
    ndarray, Solution
        The final coordinates; the solution of the stage itself, or of a later solve that was
        cancelled.
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
        # The stage may continue from here, with its own weights.
        m.scale(1.0 / share)
    return coordinates, end


def _softer(stage: Stage, share: float) -> Stage:
    """Return the stage with the weights of all but the hard terms multiplied by `share`."""
    items = [
        i if i.term.multipliers is not None else replace(i, weight=share * i.weight)
        for i in stage.items
    ]
    return replace(stage, items=items)
