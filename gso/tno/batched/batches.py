"""Batches: surfaces are planned one by one, and plans of one structure are solved together."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from gso import tasks
from gso.constraints import Compiled
from gso.errors import ConvergenceWarning, GSOError, OptionError
from gso.linalg import blas_threads
from gso.mesh import Mesh
from gso.pipeline.judgement import judged, requirements
from gso.pipeline.normalise import Canonical
from gso.pipeline.run import Run
from gso.pipeline.user_result import packed
from gso.result import Result
from gso.tasks.base import Options, Plan, Request
from gso.tno.batched import stage_groups
from gso.tno.batched.gathered import TooLarge, Unbatchable
from gso.tno.batched.stage_groups import Minimise
from gso.tno.optimize import check, optimize


@dataclass(frozen=True)
class Asked:
    """What every surface of a batch is solved for, with checked options."""

    task: str
    formulation: str
    options: Options
    device: str
    verdict: bool


#: Formulations whose stages can be solved in batches, by task.
FORMULATIONS = {"developable": ("curvature",), "flatten": ("strain", "lengths")}


def asked(
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    device: str = "cpu",
    verdict: bool = False,
) -> Asked:
    """Check what a batch is asked for, but for its device.

    Raises
    ------
    OptionError
        Something is unknown, or has no batched solve.
    """
    _, chosen, settings = check(task, formulation, options)
    if chosen not in FORMULATIONS.get(task, ()):
        there = "; ".join(f"{name}: {', '.join(some)}" for name, some in FORMULATIONS.items())
        raise OptionError(
            f"task {task!r} with formulation {chosen!r} is not solved in batches ({there} are); "
            "use gso.tno.optimize_many"
        )
    return Asked(task, chosen, settings, str(device), verdict)


@dataclass
class _Planned:
    """One surface that has been planned, and the seconds that this took."""

    design: Mesh
    frame: Canonical
    run: Run
    plan: Plan
    seconds: float


@dataclass
class _Group:
    """Surfaces whose stages have one structure, with their places among the designs."""

    structure: list[Any]
    indices: list[int]
    planned: list[_Planned]


def solve_batch(
    asked: Asked, designs: Sequence[Any], minimise: Minimise
) -> list[Result | GSOError]:
    """Solve designs in one batch for each structure that their stages have."""
    out: list[Any] = [None] * len(designs)
    groups: list[_Group] = []
    with blas_threads(asked.options.threads):
        for index, given in enumerate(designs):
            with suppress(Unbatchable, GSOError):
                _grouped(groups, index, _planned(asked, given))
        for group in groups:
            try:
                found = _solve_group(group.planned, asked, minimise)
            except (Unbatchable, GSOError):
                continue
            for index, result in zip(group.indices, found, strict=True):
                out[index] = result
        for index, given in enumerate(designs):
            if out[index] is None:
                # This also finds out which surface an error is about.
                out[index] = _solve_alone(asked, given)
    return out


def _grouped(groups: list[_Group], index: int, planned: _Planned) -> None:
    """Add a surface to the group of its structure."""
    structure = stage_groups.structure(planned.plan)
    for group in groups:
        if stage_groups.same(group.structure, structure):
            group.indices.append(index)
            group.planned.append(planned)
            return
    groups.append(_Group(structure, [index], [planned]))


def _planned(asked: Asked, given: Any) -> _Planned:
    """Plan the solve of a surface."""
    from gso.io import as_mesh

    clock = time.perf_counter()
    design = as_mesh(given)
    if design.grid_index is None:
        raise Unbatchable
    frame, module = Canonical(design), tasks.get(asked.task)
    flat = getattr(module, "BLOCK", "surface") == "flat"
    analysis = tasks.analyse(module, frame.mesh, Compiled(flat=flat))
    run = Run(module, analysis)
    request = Request(asked.options.in_unit(frame.frame.scale), asked.formulation)
    plan = module.plan(analysis, request)
    return _Planned(design, frame, run, plan, time.perf_counter() - clock)


def _solve_alone(asked: Asked, given: Any) -> Result | GSOError:
    """Solve a surface by itself."""
    try:
        with warnings.catch_warnings():
            # The status says the same.
            warnings.simplefilter("ignore", ConvergenceWarning)
            return optimize(
                given,
                task=asked.task,
                formulation=asked.formulation,
                options=asked.options,
                verdict=asked.verdict,
            )
    except GSOError as error:
        return error


def _solve_group(group: list[_Planned], asked: Asked, minimise: Minimise) -> list[Result]:
    """Solve surfaces whose stages have one structure, in halves where memory is short."""
    clock = time.perf_counter()
    plans, half = [planned.plan for planned in group], len(group) // 2
    try:
        reached, iterations, timings = stage_groups.solve(
            plans, asked.options.method, f"blocks ({asked.device})", minimise
        )
    except TooLarge:
        if not half:
            # It is then solved by itself, on the processor.
            raise Unbatchable from None
        reached = []
    if not reached:
        return [
            result
            for part in (group[:half], group[half:])
            for result in _solve_group(part, asked, minimise)
        ]
    each = (time.perf_counter() - clock) / len(group)
    out = []
    for planned, state, count in zip(group, reached, iterations, strict=True):
        clock = time.perf_counter()
        run = planned.run
        run.iterations, run.history = count, state.minimum.history
        for phase, seconds in timings.as_dict().items():
            setattr(run.timings, phase, seconds / len(group))
        run.timings.setup += planned.seconds
        solution = run.concluded(planned.plan, state)
        result = packed(asked.task, asked.formulation, planned.design, planned.frame, solution, run)
        if asked.verdict:
            scale = planned.frame.frame.scale
            result = judged(result, requirements(planned.frame.mesh, Compiled(), scale))
        result.seconds["total"] = planned.seconds + each + time.perf_counter() - clock
        out.append(result)
    return out
