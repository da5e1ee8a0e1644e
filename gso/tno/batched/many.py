"""Many surfaces in batches, in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from functools import partial
from multiprocessing import parent_process
from typing import Any

import numpy as np
import torch

from gso.errors import GSOError
from gso.parallel import Done, processors
from gso.result import Result
from gso.tno.batched import device
from gso.tno.batched.batches import BatchRequest, solve_batch
from gso.tno.batched.stage_batch import StageBatch, StageMinima
from gso.tno.batched.workers import BatchWorkers

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
    batch: BatchRequest, designs: Sequence[Any], workers: int | BatchWorkers | None = 0
) -> Iterator[Result | GSOError]:
    """Solve grids of one size, arrays (H, W, 3) or meshes; yield results or errors in order."""
    if not len(designs):
        return
    if batch.device.partition(":")[0] != "cpu":
        yield from _on_device(batch, designs, workers)
        return
    if workers is None:
        workers = _useful_workers(-(-len(designs) // _BATCH), _ENOUGH)
    if workers == 0:
        for k in range(0, len(designs), _BATCH):
            yield from _batch(batch, designs[k : k + _BATCH])
        return
    count = len(workers) if isinstance(workers, BatchWorkers) else workers
    # Smaller pieces where they leave no process without work.
    share = -(-len(designs) // (count * -(-len(designs) // (_BATCH * count))))
    pieces = [designs[k : k + share] for k in range(0, len(designs), share)]
    own = nullcontext(workers) if isinstance(workers, BatchWorkers) else BatchWorkers(count)
    with own as ready:
        yield from _in_order(ready.spread(partial(_measured, batch), pieces), share)


def _on_device(
    batch: BatchRequest, designs: Sequence[Any], workers: int | BatchWorkers | None
) -> Iterator[Result | GSOError]:
    """Solve designs on a graphics processor, planned by this process or by workers."""
    vertices = max(np.size(getattr(designs[0], "vertices", designs[0])) // 3, 1)
    most = max(_VERTICES // vertices, 1)
    if workers is None:
        workers = _useful_workers(len(designs), _GPU_ENOUGH)
    if workers == 0:
        together = min(most, _GPU_BATCH)
        for k in range(0, len(designs), together):
            yield from _batch(batch, designs[k : k + together])
        return
    own = BatchWorkers(workers) if isinstance(workers, int) else nullcontext(workers)
    with own as ready:
        # Two for each process: while some are minimised, others are planned.
        share = min(-(-len(designs) // (2 * len(ready))), _SHARE, most)
        pieces = [designs[k : k + share] for k in range(0, len(designs), share)]
        work = partial(solve_batch, batch)
        yield from _in_order(in_batches(ready, work, pieces, batch.device, vertices), share)


def in_batches(
    workers: BatchWorkers,
    function: Callable[..., Any],
    pieces: Sequence[Any],
    where: str,
    vertices: int,
    enough: float = 0.5,
) -> Generator[Done, None, None]:
    """Apply a function to pieces in processes, while this one minimises for them on a device.

    Parameters
    ----------
    workers, function, pieces, enough
        As for :meth:`BatchWorkers.spread`.
    where : str
        The device.
    vertices : int
        Number of vertices of a surface.
    """
    together, most = partial(device.solve, device=where), max(_MOST // vertices, 1)
    return workers.spread(function, pieces, together, most=most, enough=enough)


def _in_order(results: Generator[Done, None, None], share: int) -> Iterator[Result | GSOError]:
    """Yield the results of pieces of `share` surfaces, which finish in any order."""
    done: dict[int, Any] = {}
    shown = 0
    with closing(results):
        for one in results:
            if one.error is not None:
                raise GSOError(f"surfaces from {one.index * share} on: {one.error}")
            done[one.index] = one.value
            while shown in done:
                yield from done.pop(shown)
                shown += 1


def _batch(batch: BatchRequest, designs: Sequence[Any]) -> list[Result | GSOError]:
    """Solve designs in one batch in this process."""
    with _one_thread(batch.device):
        return solve_batch(batch, designs, partial(_minimised, batch.device))


def _minimised(where: str, gathered: StageBatch) -> StageMinima:
    return device.solve([gathered], where)[0]


def _measured(
    batch: BatchRequest, designs: Sequence[Any], *, minimise: Any
) -> list[Result | GSOError]:
    """Solve designs in a worker process, by itself, and compute their metrics there."""
    found = _batch(batch, designs)
    for result in found:
        if isinstance(result, Result):
            result.metrics  # noqa: B018
    return found


def _useful_workers(pieces: int, enough: int) -> int:
    """Return the number of worker processes that saves time, 0 inside a worker process."""
    if parent_process() is not None or pieces < enough:
        return 0
    return min(processors(), pieces)


@contextmanager
def _one_thread(where: str) -> Iterator[None]:
    """Use one thread on a processor: worker processes use the others."""
    before = torch.get_num_threads()
    if where.partition(":")[0] == "cpu":
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
