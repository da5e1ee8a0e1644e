"""Batches: surfaces are planned one by one, and plans of one structure are solved together."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import parent_process
from typing import Any

import numpy as np
import torch

from gso import tasks
from gso.constraints import Compiled
from gso.errors import ConvergenceWarning, GSOError
from gso.linalg import blas_threads
from gso.mesh import Mesh
from gso.parallel import processors, spread
from gso.result import Result
from gso.tasks.base import Plan, Request
from gso.tno.batched import stages
from gso.tno.batched.asked import Asked
from gso.tno.batched.problem import forget
from gso.tno.batched.unknowns import Unbatchable
from gso.tno.judged import judged, requirements
from gso.tno.normalise import Canonical
from gso.tno.optimize import optimize
from gso.tno.packed import packed
from gso.tno.run import Run

#: Surfaces solved together on a processor, and most surfaces and vertices of them together on a
#: graphics processor.
_BATCH, _GPU_BATCH, _GPU_VERTICES = 16, 256, 1 << 20
#: Number of pieces from which worker processes save time.
_ENOUGH = 4


def solve_all(
    asked: Asked, designs: Sequence[Any], workers: int | None = 0
) -> Iterator[Result | GSOError]:
    """Solve grids of one size, arrays (H, W, 3) or meshes; yield results or errors in order."""
    if not len(designs):
        return
    there = asked.device.partition(":")[0] != "cpu"
    together = _BATCH
    if there:
        vertices = np.size(getattr(designs[0], "vertices", designs[0])) // 3
        together = max(min(_GPU_VERTICES // max(vertices, 1), _GPU_BATCH), 1)
    pieces = [designs[k : k + together] for k in range(0, len(designs), together)]
    if workers is None:
        workers = _useful_workers(len(pieces))
    if workers <= 0 or there:
        for piece in pieces:
            yield from _solve_batch(asked, piece)
        return
    # Smaller pieces where they leave no process without work.
    share = -(-len(designs) // (workers * -(-len(pieces) // workers)))
    pieces = [designs[k : k + share] for k in range(0, len(designs), share)]
    done: dict[int, Any] = {}
    work = partial(_measured, asked)
    with closing(spread(work, pieces, workers=min(workers, len(pieces)), caller=False)) as results:
        for one in results:
            if one.error is not None:
                raise GSOError(f"surfaces from {one.index * share} on: {one.error}")
            done[one.index] = one.value
    for k in range(len(pieces)):
        yield from done.pop(k)


def _measured(asked: Asked, designs: Sequence[Any]) -> list[Result | GSOError]:
    """Solve designs in a worker process, and compute their metrics there."""
    found = _solve_batch(asked, designs)
    for result in found:
        if isinstance(result, Result):
            result.metrics  # noqa: B018
    return found


def _useful_workers(pieces: int) -> int:
    """Return the number of worker processes that saves time, 0 inside a worker process."""
    if parent_process() is not None or pieces < _ENOUGH:
        return 0
    return min(processors(), pieces)


@dataclass
class _Planned:
    """One surface that has been planned, and the seconds that this took."""

    design: Mesh
    frame: Canonical
    run: Run
    plan: Plan
    seconds: float


def _solve_batch(asked: Asked, designs: Sequence[Any]) -> list[Result | GSOError]:
    """Solve designs in one batch for each structure that their stages have."""
    out: list[Any] = [None] * len(designs)
    groups: dict[bytes, list[tuple[int, _Planned]]] = {}
    with _one_thread(asked.device), blas_threads(asked.options.threads):
        for index, given in enumerate(designs):
            try:
                planned = _planned(asked, given)
                groups.setdefault(stages.structure(planned.plan), []).append((index, planned))
            except (Unbatchable, GSOError):
                pass
        for group in groups.values():
            try:
                found = _solve_group([planned for _, planned in group], asked)
            except (Unbatchable, GSOError):
                continue
            for (index, _), result in zip(group, found, strict=True):
                out[index] = result
        for index, given in enumerate(designs):
            if out[index] is None:
                # This also finds out which surface an error is about.
                out[index] = _solve_alone(asked, given)
    return out


@contextmanager
def _one_thread(device: str) -> Iterator[None]:
    """Use one thread on a processor: worker processes use the others."""
    before = torch.get_num_threads()
    if device.partition(":")[0] == "cpu":
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


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


def _solve_group(group: list[_Planned], asked: Asked) -> list[Result]:
    """Solve surfaces whose stages have one structure, in halves where memory is short."""
    clock = time.perf_counter()
    plans, half = [planned.plan for planned in group], len(group) // 2
    try:
        reached, iterations, timings = stages.solve(
            plans, asked.options.method, torch.device(asked.device)
        )
    except torch.cuda.OutOfMemoryError:
        if not half:
            # It is then solved by itself, on the processor.
            raise Unbatchable from None
        reached = []
    if not reached:
        # Outside the handler, which would keep the tensors alive.
        forget()
        torch.cuda.empty_cache()
        return _solve_group(group[:half], asked) + _solve_group(group[half:], asked)
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
