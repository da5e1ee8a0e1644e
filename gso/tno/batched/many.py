"""Many surfaces in batches, in this process or in several."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from functools import partial

import numpy as np
import torch

from gso.errors import GSOError, OptionError
from gso.executors import Executor, Item, ProcessExecutor, open_executor
from gso.executors.base import processors, useful_workers
from gso.mesh import Mesh
from gso.result import Result
from gso.tno.batched import device
from gso.tno.batched.batches import BatchRequest, solve_batch
from gso.tno.batched.device_executor import DeviceExecutor, minimise_elsewhere
from gso.tno.batched.stage_batch import StageBatch, StageMinima
from gso.typing import Array

#: Surfaces solved together on a processor.
_BATCH = 16
#: Most surfaces and vertices that one process plans for a graphics processor at a time, and most
#: vertices that are minimised there together.
_SHARE, _VERTICES, _MOST = 64, 1 << 20, 1 << 22
#: Most surfaces solved on a graphics processor by the process that plans them.
_GPU_BATCH = 256
#: Number of pieces from which worker processes save time, and number of surfaces from which they
#: do where there is a graphics processor.
_ENOUGH, _GPU_ENOUGH = 4, 256


def solve_all(
    batch: BatchRequest,
    designs: Sequence[Mesh | Array],
    workers: int | None = 0,
    executor: Executor | None = None,
) -> Iterator[Result | GSOError]:
    """Solve grids of one size, arrays (H, W, 3) or meshes; yield results or errors in order."""
    count = len(designs)
    if not count:
        return
    first = designs[0]
    vertices = max(np.size(first.vertices if isinstance(first, Mesh) else first) // 3, 1)
    here = _on_processor(batch.device)
    most = _BATCH if here else max(_VERTICES // vertices, 1)
    own_terms = batch.request.terms
    if executor is None and workers is None and own_terms:
        # The user's functions may not be sent to other processes.
        workers = 0
    if executor is None and workers is None:
        parts, enough = (-(-count // most), _ENOUGH) if here else (count, _GPU_ENOUGH)
        workers = useful_workers(parts) if parts >= enough else 0
    if executor is None and workers == 0:
        together = min(most, _GPU_BATCH)
        for k in range(0, count, together):
            yield from _batch(batch, designs[k : k + together])
    elif here:
        opened = nullcontext(executor) if executor else open_executor(workers, main=bool(own_terms))
        with opened as ready:
            ready.check_sent("terms", own_terms)
            # Smaller pieces where they leave no process without work.
            own = max(ready.workers, 1)
            share = -(-count // (own * -(-count // (most * own))))
            pieces = [designs[k : k + share] for k in range(0, count, share)]
            yield from _in_order(ready.as_completed(partial(_measured, batch), pieces), share)
    else:
        with planners(batch.device, vertices, workers, executor, main=bool(own_terms)) as ready:
            ready.check_sent("terms", own_terms)
            share = min(-(-count // ready.workers), _SHARE, most)
            pieces = [designs[k : k + share] for k in range(0, count, share)]
            work = partial(solve_batch, batch, minimise=minimise_elsewhere)
            yield from _in_order(ready.as_completed(work, pieces), share)


@contextmanager
def planners(
    where: str,
    vertices: int,
    workers: int | None = None,
    executor: Executor | None = None,
    *,
    enough: float = 0.5,
    main: bool = False,
) -> Iterator[DeviceExecutor]:
    """Open an executor for which this process minimises on a device.

    Parameters
    ----------
    where : str
        The device.
    vertices : int
        Number of vertices of a surface.
    workers : int, optional
        Number of processes that work at a time; as many more wait for the device meanwhile.
    executor : ProcessExecutor, optional
        Processes to use instead.
    enough : float
        As for :class:`DeviceExecutor`.
    main : bool
        As for :class:`ProcessExecutor`, where there is no `executor`.
    """
    processes = executor or ProcessExecutor(2 * (workers or processors()), main=main)
    if not isinstance(processes, ProcessExecutor):
        raise OptionError("a graphics processor needs worker processes: give a ProcessExecutor")
    together, most = partial(device.solve, device=where), max(_MOST // vertices, 1)
    with (
        nullcontext() if executor else processes,
        DeviceExecutor(processes, together, most=most, enough=enough) as ready,
    ):
        yield ready


def _in_order(
    results: Generator[Item[list[Result | GSOError]], None, None], share: int
) -> Iterator[Result | GSOError]:
    """Yield the results of pieces of `share` surfaces, which finish in any order."""
    done: dict[int, list[Result | GSOError]] = {}
    shown = 0
    with closing(results):
        for one in results:
            if one.result is None:
                raise GSOError(f"surfaces from {one.index * share} on: {one.error}")
            done[one.index] = one.result
            while shown in done:
                yield from done.pop(shown)
                shown += 1


def _batch(batch: BatchRequest, designs: Sequence[Mesh | Array]) -> list[Result | GSOError]:
    """Solve designs in one batch in this process."""
    with _one_thread(batch.device):
        return solve_batch(batch, designs, partial(_minimise, batch.device))


def _minimise(where: str, gathered: StageBatch) -> StageMinima:
    return device.solve([gathered], where)[0]


def _measured(batch: BatchRequest, designs: Sequence[Mesh | Array]) -> list[Result | GSOError]:
    """Solve designs in a worker process, by itself, and compute their metrics there."""
    found = _batch(batch, designs)
    for result in found:
        if isinstance(result, Result):
            result.metrics  # noqa: B018
    return found


def _on_processor(where: str) -> bool:
    return where.partition(":")[0] == "cpu"


@contextmanager
def _one_thread(where: str) -> Iterator[None]:
    """Use one thread on a processor: worker processes use the others."""
    before = torch.get_num_threads()
    if _on_processor(where):
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
