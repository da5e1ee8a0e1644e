"""Many surfaces, over processes."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from gso.result import Result
from gso.status import ConvergenceWarning, GSOError


@dataclass(frozen=True)
class Item:
    """One surface of a batch: its place in the input, and its result or its error."""

    index: int
    result: Result | None
    error: str | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a result."""
        return self.result is not None


def _one(index: int, mesh: Any, keywords: dict[str, Any]) -> Item:
    from gso.tno.optimize import optimize

    try:
        result = optimize(mesh, **keywords)
        result.metrics  # noqa: B018 - computed here, where there is a processor for it
        return Item(index, result)
    except GSOError as error:
        return Item(index, None, str(error))
    except Exception as error:  # one broken surface must not end the batch
        return Item(index, None, f"{type(error).__name__}: {error}")


def _prepare_worker() -> None:
    """Leave Ctrl-C to the parent, and warnings to the status of the results."""
    import signal
    import warnings

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore", ConvergenceWarning)


def optimize_many(
    meshes: Iterable[Any], *, workers: int | None = None, **keywords: Any
) -> Iterator[Item]:
    """Optimise many surfaces in parallel processes, results as they finish.

    Parameters
    ----------
    meshes : iterable
        Anything :func:`gso.tno.optimize` takes; read as workers become free, so a
        generator of any length fits in memory.
    workers : int, optional
        Processes; the number of cores when not given, 0 for none (in this process).
    **keywords
        Passed to :func:`gso.tno.optimize`; a `callback` is left out.

    Yields
    ------
    Item
        In the order of completion; `index` says which input it belongs to. A surface
        that fails is reported in `error` and does not end the batch.

    Examples
    --------
    >>> import numpy as np, gso
    >>> flat = np.dstack([*np.mgrid[:4., :4.], np.zeros((4, 4))])
    >>> [item.index for item in gso.tno.optimize_many([flat], workers=0)]
    [0]
    """
    keywords.pop("callback", None)
    workers = (os.cpu_count() or 1) if workers is None else workers
    numbered = enumerate(meshes)
    if workers <= 0:
        for index, mesh in numbered:
            yield _one(index, mesh, keywords)
        return
    pool = _Pool(workers, keywords)
    try:
        more = True
        while more or pool.busy:
            while more and pool.has_room:
                entry = next(numbered, None)
                if entry is None:
                    more = False
                else:
                    pool.add(*entry)
            yield from pool.finished()
    finally:
        pool.close()


class _Pool:
    """Worker processes that are replaced when one dies.

    A death breaks all that was under way. Those surfaces are then worked on one at a
    time, so that the one that kills its worker is found and the others get their results.
    """

    def __init__(self, workers: int, keywords: dict[str, Any]):
        self.workers, self.keywords = workers, keywords
        self.running: dict[Future[Item], tuple[int, Any, bool]] = {}
        self.suspects: list[tuple[int, Any]] = []
        self._start()

    def _start(self) -> None:
        from multiprocessing import get_context

        # Forking would copy the threads' locks of BLAS and PARDISO in an unknown state.
        self.executor = ProcessPoolExecutor(
            self.workers, mp_context=get_context("spawn"), initializer=_prepare_worker
        )

    @property
    def busy(self) -> bool:
        return bool(self.running or self.suspects)

    @property
    def has_room(self) -> bool:
        return not self.suspects and len(self.running) < 2 * self.workers

    def add(self, index: int, mesh: Any, *, alone: bool = False) -> None:
        try:
            future = self.executor.submit(_one, index, mesh, self.keywords)
        except BrokenProcessPool:
            self._replace()
            self.suspects.append((index, mesh))
        else:
            self.running[future] = (index, mesh, alone)

    def finished(self) -> Iterator[Item]:
        """Wait for at least one surface."""
        if not self.running and self.suspects:
            self.add(*self.suspects.pop(), alone=True)
        done, _ = wait(self.running, return_when=FIRST_COMPLETED)
        for future in done:
            if future not in self.running:
                continue
            index, mesh, alone = self.running.pop(future)
            try:
                yield future.result()
            except BrokenProcessPool:
                if alone:
                    yield Item(index, None, "the worker process died; is there enough memory?")
                else:
                    self.suspects.append((index, mesh))
                self._replace()
            except Exception as error:  # what cannot travel between processes
                yield Item(index, None, f"{type(error).__name__}: {error}")

    def _replace(self) -> None:
        """Start anew; what was under way is under suspicion."""
        self.suspects += [(index, mesh) for index, mesh, _ in self.running.values()]
        self.running.clear()
        self.executor.shutdown(wait=False, cancel_futures=True)
        self._start()

    def close(self) -> None:
        """End; what still runs when it is left early, by Ctrl-C or a satisfied caller, too."""
        if self.running:
            for process in list(self.executor._processes.values()):
                process.terminate()
        self.executor.shutdown(wait=True, cancel_futures=True)
