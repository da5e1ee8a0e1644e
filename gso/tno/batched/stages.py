"""The stages of many plans, solved together where their structure is the same."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gso.parametrization.orientation import Orientation
from gso.status import Progress, Status
from gso.tasks.base import Plan, Stage
from gso.tno.batched import minimiser
from gso.tno.batched.minimiser import Minima, minimise
from gso.tno.batched.problem import Problem
from gso.tno.batched.terms import stacked_loss
from gso.tno.batched.unknowns import Unbatchable, Unknowns, columns
from gso.tno.run import Reached
from gso.tno.solver import Minimum, Timings
from gso.typing import Array

_STATUSES = {
    minimiser.MAX_ITERATIONS: Status.MAX_ITERATIONS,
    minimiser.CONVERGED: Status.CONVERGED,
    minimiser.STALLED: Status.STALLED,
}


def structure(plan: Plan) -> bytes:
    """Return a key that is the same for plans that can be solved together.

    Raises
    ------
    Unbatchable
        There is nothing to solve, or something that batches do not have.
    """
    if not plan.stages or plan.spline is not None or plan.convert is not None:
        raise Unbatchable
    digest = hashlib.blake2b()
    for stage in plan.stages:
        for part in _described(stage):
            digest.update(part if isinstance(part, bytes) else repr(part).encode())
            digest.update(b";")
    return digest.digest()


def _described(stage: Stage) -> list[Any]:
    """Return all of a stage that must be the same in a batch."""
    constrained = stage.imposed is not None and not stage.imposed.constraints.empty
    if stage.bounds is not None or stage.finished is not None or constrained:
        raise Unbatchable
    out: list[Any] = [stage.layout.blocks, stage.iterations, stage.tolerance, stage.continued]
    out += [type(loss) for loss in stage.continuation]
    for limit in stage.limits:
        if not isinstance(limit, Orientation):
            raise Unbatchable
        out += [limit.start, limit.corners.tobytes()]
    for item in stage.own_items:
        term = item.term
        if term.refresh is not None or term.multipliers is not None:
            raise Unbatchable
        out += [term.name, item.active, item.quadratic, type(item.loss), len(term.constants)]
        out += [_name(term.residual), _name(term.vectors)]
        for block, index in term.stencil:
            out += [block, index.shape, index.tobytes()]
    return out


def _name(function: Any) -> str:
    return "" if function is None else f"{function.__module__}.{function.__qualname__}"


def solve(
    plans: Sequence[Plan], method: str, device: torch.device
) -> tuple[list[Reached], list[int], Timings]:
    """Solve the stages of plans with one structure.

    Parameters
    ----------
    plans : sequence of Plan
    method : str
        Of the options.
    device : torch.device

    Returns
    -------
    reached : list of Reached
        The state of each plan after its last stage.
    iterations : list of int
        Iterations of each plan, over all stages.
    timings : Timings
        Seconds of all plans together.

    Raises
    ------
    Unbatchable
        The plans cannot be solved together.
    """
    timings = Timings()
    coordinates: list[Array] = [plan.start for plan in plans]
    histories: list[list[Progress]] = [[] for _ in plans]
    iterations = np.zeros(len(plans), np.int64)
    count = len(plans[0].stages)
    for number in range(count):
        clock = time.perf_counter()
        stages = [plan.stages[number] for plan in plans]
        entered = coordinates
        coordinates = [s.enter(c) for s, c in zip(stages, coordinates, strict=True)]
        problem, start, losses = stacked_problem(stages, coordinates, device)
        timings.setup += time.perf_counter() - clock
        first = stages[0]
        minima = minimise(
            problem,
            start,
            iterations=first.iterations,
            tolerance=first.tolerance,
            continuation=losses,
            continued=first.continued,
            method=method,
            timings=timings,
        )
        coordinates = list(problem.unknowns.points(minima.x).cpu().numpy().T.copy())
        found = _minima(minima, first, (number, count), f"blocks ({device})")
        for history, one in zip(histories, found, strict=True):
            history += one.history
        iterations += [one.iterations for one in found]
    reached = []
    for k, one in enumerate(found):
        one.history = histories[k]
        reached.append(Reached(stages[k], coordinates[k], entered[k], one))
    return reached, iterations.tolist(), timings


def stacked_problem(
    stages: Sequence[Stage], coordinates: Sequence[Array], device: torch.device
) -> tuple[Problem, Tensor, list[Any]]:
    """Return the problem of one stage of each surface, its start (n, B), and its continuation.

    Raises
    ------
    Unbatchable
        The surfaces cannot be solved together.
    """
    variables = [s.unknowns(c) for s, c in zip(stages, coordinates, strict=True)]
    items = [[item for item in s.own_items if item.active] for s in stages]
    first = stages[0]
    unknowns = Unknowns.stacked(variables, device)
    problem = Problem(items, first.layout, unknowns, first.limits, device)
    start = [v.project(c) for v, c in zip(variables, coordinates, strict=True)]
    by_iteration = zip(*(s.continuation for s in stages), strict=True)
    return problem, columns(start, device), [stacked_loss(each, device) for each in by_iteration]


def _minima(minima: Minima, stage: Stage, place: tuple[int, int], backend: str) -> list[Minimum]:
    """Convert the results of a stage to those of each surface."""
    energies, steps = (torch.stack(h).cpu().numpy() for h in (minima.energies, minima.steps))
    x, energy = minima.x.cpu().numpy().T.copy(), minima.energy.tolist()
    codes, done = minima.code.tolist(), minima.iterations.tolist()
    out = []
    for k, last in enumerate(done):
        history = [
            Progress(
                *place,
                i,
                stage.iterations,
                float(energies[i, k]),
                {},
                float(steps[i, k]),
                stage.name,
            )
            for i in range(last + 1)
        ]
        out.append(Minimum(x[k], energy[k], _STATUSES[codes[k]], last, backend, history))
    return out
