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
        Passed to :func:`gso.tno.optimize`, except `callback`, which stays here.

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
    from multiprocessing import get_context

    # Forking would copy the threads' locks of BLAS and PARDISO in an unknown state.
    pool = ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_prepare_worker
    )
    running: dict[Future[Item], int] = {}
    try:
        more = True
        while more or running:
            while more and len(running) < 2 * workers:
                entry = next(numbered, None)
                if entry is None:
                    more = False
                else:
                    running[pool.submit(_one, entry[0], entry[1], keywords)] = entry[0]
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                index = running.pop(future)
                try:
                    yield future.result()
                except BrokenProcessPool:
                    yield Item(index, None, "the worker process died; try fewer workers")
                    more = False
                except Exception as error:  # what cannot travel between processes
                    yield Item(index, None, f"{type(error).__name__}: {error}")
    finally:
        # Left early, by Ctrl-C or because the caller has seen enough: end what still runs.
        if running:
            for process in list(pool._processes.values()):
                process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
