"""Batches: surfaces are planned one by one, and plans of one structure are solved together."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from gso import tasks
from gso.constraints import Compiled
from gso.errors import ConvergenceWarning, GSOError, OptionError
from gso.linalg import blas_threads
from gso.pipeline.case import Case
from gso.pipeline.judgement import conclude
from gso.pipeline.run import Run
from gso.result import Result
from gso.tasks.base import Options, Plan
from gso.tasks.request import OwnTerms, Request
from gso.tno.batched import stage_groups
from gso.tno.batched.stage_batch import TooLarge, Unbatchable
from gso.tno.batched.stage_groups import Minimise, Structure
from gso.tno.optimize import check, optimize
from gso.typing import MeshLike


@dataclass(frozen=True)
class BatchRequest:
    """What is asked of a batch.

    Attributes
    ----------
    request : Request
        What every surface is solved for.
    device : str
        PyTorch's name of the device that minimises.
    """

    request: Request[Options]
    device: str


#: Formulations whose stages can be solved in batches, by task.
FORMULATIONS = {"developable": ("curvature",), "flatten": ("strain", "lengths")}


def check_batch(
    task: str = "developable",
    formulation: str | None = None,
    options: str | Options | None = None,
    device: str = "cpu",
    verdict: bool = False,
    terms: Sequence[OwnTerms] = (),
) -> BatchRequest:
    """Check what a batch is asked for, but for its device.

    Raises
    ------
    OptionError
        Something is unknown, or has no batched solve.
    """
    request = check(task, formulation, options, verdict=verdict, terms=terms)
    if request.formulation not in FORMULATIONS.get(task, ()):
        there = "; ".join(f"{name}: {', '.join(some)}" for name, some in FORMULATIONS.items())
        raise OptionError(
            f"task {task!r} with formulation {request.formulation!r} is not solved in batches "
            f"({there} are); use gso.tno.optimize_many"
        )
    return BatchRequest(request, str(device))


@dataclass
class _Planned:
    """One surface that has been planned, and the seconds that this took."""

    run: Run
    plan: Plan
    seconds: float


@dataclass
class _Group:
    """Surfaces whose stages have one structure, with their places among the designs."""

    structure: Structure
    indices: list[int]
    planned: list[_Planned]


def solve_batch(
    batch: BatchRequest, designs: Sequence[MeshLike], minimise: Minimise
) -> list[Result | GSOError]:
    """Solve designs in one batch for each structure that their stages have."""
    out: dict[int, Result | GSOError] = {}
    groups: list[_Group] = []
    with blas_threads(batch.request.options.threads):
        for index, given in enumerate(designs):
            with suppress(Unbatchable, GSOError):
                _add_to_group(groups, index, _plan(batch.request, given))
        for group in groups:
            with suppress(Unbatchable, GSOError):
                found = _solve_group(group.planned, batch, minimise)
                out |= zip(group.indices, found, strict=True)
        for index, given in enumerate(designs):
            if index not in out:
                # This also finds out which surface an error is about.
                out[index] = _solve_alone(batch.request, given)
    return [out[index] for index in range(len(designs))]


def _add_to_group(groups: list[_Group], index: int, planned: _Planned) -> None:
    """Add a surface to the group of its structure."""
    structure = stage_groups.structure(planned.plan)
    for group in groups:
        if stage_groups.same(group.structure, structure):
            group.indices.append(index)
            group.planned.append(planned)
            return
    groups.append(_Group(structure, [index], [planned]))


def _plan(request: Request[Options], given: MeshLike) -> _Planned:
    """Plan the solve of a surface."""
    from gso.io import as_mesh

    clock = time.perf_counter()
    design = as_mesh(given)
    if design.grid_index is None:
        raise Unbatchable
    run = Run(Case(request, design, Compiled(flat=tasks.get(request.task).flat)))
    plan = run.plan(run.case.solver_request)
    return _Planned(run, plan, time.perf_counter() - clock)


def _solve_alone(request: Request[Options], given: MeshLike) -> Result | GSOError:
    """Solve a surface by itself."""
    try:
        with warnings.catch_warnings():
            # The status says the same.
            warnings.simplefilter("ignore", ConvergenceWarning)
            return optimize(
                given,
                task=request.task,
                formulation=request.formulation,
                options=request.options,
                terms=request.terms,
                verdict=request.verdict,
            )
    except GSOError as error:
        return error


def _solve_group(group: list[_Planned], batch: BatchRequest, minimise: Minimise) -> list[Result]:
    """Solve surfaces whose stages have one structure, in halves where memory is short."""
    clock = time.perf_counter()
    plans, half = [planned.plan for planned in group], len(group) // 2
    try:
        states, iterations, timings = stage_groups.solve(
            plans, batch.request.options.method, f"blocks ({batch.device})", minimise
        )
    except TooLarge:
        if not half:
            # It is then solved by itself, on the processor.
            raise Unbatchable from None
        states = []
    if not states:
        return [
            result
            for part in (group[:half], group[half:])
            for result in _solve_group(part, batch, minimise)
        ]
    each = (time.perf_counter() - clock) / len(group)
    out = []
    for planned, state, count in zip(group, states, iterations, strict=True):
        clock = time.perf_counter()
        run = planned.run
        run.iterations, run.history = count, state.minimum.history
        run.timings = timings.scaled(1.0 / len(group))
        run.timings.setup += planned.seconds
        result = conclude(run, run.conclude(planned.plan, state))
        result.seconds["total"] = planned.seconds + each + time.perf_counter() - clock
        out.append(result)
    return out
