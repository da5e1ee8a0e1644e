"""The stages of many plans, solved together where their structure is the same."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from gso.parametrization.orientation import Orientation
from gso.pipeline.run import PlanState
from gso.solver import Minimum, Timings
from gso.status import Progress, Status
from gso.tasks.base import Plan, Stage
from gso.tno.batched.stage_batch import (
    CONVERGED,
    MAX_ITERATIONS,
    STALLED,
    StageBatch,
    StageMinima,
    Unbatchable,
    gather,
)
from gso.typing import Array

_STATUSES = {
    MAX_ITERATIONS: Status.MAX_ITERATIONS,
    CONVERGED: Status.CONVERGED,
    STALLED: Status.STALLED,
}

#: Minimises a stage of many surfaces.
Minimise = Callable[[StageBatch], StageMinima]


#: All of a plan that must be the same in a batch: arrays, and values that can be compared.
Structure: TypeAlias = "list[object]"


def structure(plan: Plan) -> Structure:
    """Return all of a plan that must be the same in a batch, to compare by :func:`same`.

    Raises
    ------
    Unbatchable
        There is nothing to solve, or something that batches do not have.
    """
    if not plan.stages or plan.spline is not None:
        raise Unbatchable
    parts = [part for stage in plan.stages for part in _describe(stage)]
    return [plan.fallback is None, *parts]


def same(one: Structure, other: Structure) -> bool:
    """Return whether two plans can be solved together."""
    return len(one) == len(other) and all(map(_equal, one, other))


def _equal(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return bool(one == other)


def _digest(described: Structure) -> bytes:
    digest = hashlib.blake2b()
    for part in described:
        if isinstance(part, np.ndarray):
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b";")
    return digest.digest()


def _describe(stage: Stage) -> Structure:
    """Return all of a stage that must be the same in a batch."""
    constrained = stage.imposed is not None and not stage.imposed.constraints.empty
    if stage.bounds is not None or stage.finished is not None or constrained:
        raise Unbatchable
    out: Structure = [stage.layout.blocks, stage.iterations, stage.tolerance, stage.continued]
    out += [type(loss) for loss in stage.continuation]
    for limit in stage.limits:
        if not isinstance(limit, Orientation):
            raise Unbatchable
        out += [limit.start, limit.corners.shape, limit.corners]
    for item in stage.own_items:
        term = item.term
        if term.refresh is not None or term.multipliers is not None:
            raise Unbatchable
        out += [term.name, item.active, item.quadratic, type(item.loss), len(term.constants)]
        out += [_name(term.residual), _name(term.vectors)]
        for block, index in term.stencil:
            out += [block, index.shape, index]
    return out


def _name(function: Callable[..., object] | None) -> str:
    """Return the full name of a function at the top level of a module.

    Raises
    ------
    Unbatchable
        It is no such function: those of two surfaces may differ in spite of the same name.
    """
    if function is None:
        return ""
    name = getattr(function, "__qualname__", "<")
    if "<" in name:
        raise Unbatchable
    return f"{function.__module__}.{name}"


def solve(
    plans: Sequence[Plan], method: str, backend: str, minimise: Minimise
) -> tuple[list[PlanState], list[int], Timings]:
    """Solve the stages of plans with one structure.

    Parameters
    ----------
    plans : sequence of Plan
    method : str
        Of the options.
    backend : str
        Name of the linear backend in the results.
    minimise : callable
        Minimises a stage.

    Returns
    -------
    states : list of PlanState
        The state of each plan after its last stage.
    iterations : list of int
        Iterations of each plan, over all stages.
    timings : Timings
        Seconds of all plans together.

    Raises
    ------
    Unbatchable
        The plans cannot be solved together.
    TooLarge
        They are too many for the memory of the device.
    """
    timings = Timings()
    coordinates: list[Array] = [plan.start for plan in plans]
    histories: list[list[Progress]] = [[] for _ in plans]
    iterations = np.zeros(len(plans), np.int64)
    count, key = len(plans[0].stages), _digest([method, *structure(plans[0])])
    for number in range(count):
        clock = time.perf_counter()
        stages = [plan.stages[number] for plan in plans]
        entered = coordinates
        coordinates = [s.enter(c) for s, c in zip(stages, coordinates, strict=True)]
        others = _fallbacks(plans) if number == count - 1 else None
        gathered = gather(stages, coordinates, method, key + bytes([number]), others)
        timings.setup += time.perf_counter() - clock
        solved = minimise(gathered)
        timings.add(solved.timings)
        coordinates = list(solved.points)
        found = _minima(solved, stages[0], (number, count), backend)
        for history, one in zip(histories, found, strict=True):
            history += one.history
        iterations += solved.iterations
    states = []
    for k, one in enumerate(found):
        one.history = histories[k]
        energies = [{name: float(e[k]) for name, e in at.items()} for at in solved.by_term]
        states.append(
            PlanState(stages[k], coordinates[k], entered[k], one, (energies[0], energies[-1]))
        )
    return states, iterations.tolist(), timings


def _fallbacks(plans: Sequence[Plan]) -> list[Array] | None:
    """Return the fallbacks of plans; None if they have none."""
    found = [plan.fallback for plan in plans if plan.fallback is not None]
    return found if len(found) == len(plans) else None


def _minima(
    solved: StageMinima, stage: Stage, place: tuple[int, int], backend: str
) -> list[Minimum]:
    """Convert the results of a stage to those of each surface."""
    out, energies, steps = [], solved.energies.tolist(), solved.steps.tolist()
    for k, last in enumerate(solved.iterations.tolist()):
        history = [
            Progress(*place, i, stage.iterations, energies[k][i], {}, steps[k][i], stage.name)
            for i in range(last + 1)
        ]
        status = _STATUSES[int(solved.code[k])]
        out.append(Minimum(solved.x[k], float(solved.energy[k]), status, last, backend, history))
    return out
