"""Work spread over worker processes, which may die."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from gso.errors import ConvergenceWarning, GSOError

#: The error of a piece of work that ends its process.
DIED = "the worker process died; is there enough memory?"


@dataclass(frozen=True)
class Done:
    """The result of one piece of work: its place in the input, and its value or its error."""

    index: int
    value: Any = None
    error: str | None = None


def spread(
    function: Callable[[Any], Any],
    pieces: Iterable[Any],
    *,
    workers: int | None = None,
    caller: bool = True,
) -> Generator[Done, None, None]:
    """Apply a function to many pieces in parallel processes, and yield results as they finish.

    Parameters
    ----------
    function : callable
        Of one argument; it must be importable by name, or a partial of one that is.
    pieces : iterable
        Read as workers become free, so a generator of any length fits in memory.
    workers : int, optional
        Number of worker processes; :func:`processors` when not given, 0 to work in this one.
    caller : bool
        Whether workers import the caller's script, which may define `function`. If not, the
        script needs no guard ``if __name__ == "__main__"``.

    Yields
    ------
    Done
        In the order of completion. An exception, or the death of a worker, becomes the
        `error` of its piece and does not end the rest.

    Examples
    --------
    >>> [done.value for done in spread(abs, [-1, 2], workers=0)]
    [1, 2]
    """
    workers = processors() if workers is None else workers
    numbered = enumerate(pieces)
    if workers <= 0:
        for index, piece in numbered:
            yield attempt(function, index, piece)
        return
    pool = _Pool(workers, function, caller)
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


#: Applies a function to items, and returns the results in order.
Each = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]


def here(function: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
    """Apply a function to items in this process."""
    return [function(item) for item in items]


@contextmanager
def helpers(workers: int | None) -> Iterator[Each]:
    """Keep processes for several rounds of work, of which this process does its share.

    Parameters
    ----------
    workers : int, optional
        Number of processes with this one; one for each processor when not given, and 0 or 1 for
        this one alone.

    Yields
    ------
    each : callable
        Applies a function of one argument, importable by name or a partial of one that is, to
        items, and returns the results in order. What a function raises is raised here.

    Examples
    --------
    >>> with helpers(0) as each:
    ...     each(abs, [-1, 2])
    [1, 2]
    """
    from multiprocessing import get_context

    count = processors() if workers is None else max(workers, 1)
    if count == 1:
        yield here
        return
    executor = ProcessPoolExecutor(
        count - 1, mp_context=get_context("spawn"), initializer=prepare_worker
    )

    def each(function: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
        futures = []
        try:
            with nameless():
                futures += [executor.submit(function, item) for item in items[1:]]
        except BrokenProcessPool:
            return here(function, items)
        own = {0: function(items[0])} if items else {}
        for k in range(len(futures), 0, -1):
            if futures[k - 1].cancel():
                own[k] = function(items[k])
        out = []
        for k, item in enumerate(items):
            try:
                out.append(own[k] if k in own else futures[k - 1].result())
            except BrokenProcessPool:
                out.append(function(item))
        return out

    try:
        yield each
    finally:
        executor.shutdown(cancel_futures=True)


def processors() -> int:
    """Return the number of processors that this process may use (its CPU affinity)."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


@contextmanager
def nameless() -> Iterator[None]:
    """Hide the main script, so that processes started meanwhile do not import it."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def attempt(function: Callable[[Any], Any], index: int, piece: Any) -> Done:
    """Apply a function to a piece of work; an exception becomes the error of the result."""
    try:
        return Done(index, function(piece))
    except GSOError as error:
        return Done(index, error=str(error))
    except Exception as error:  # one broken piece must not end the others
        return Done(index, error=f"{type(error).__name__}: {error}")


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent and warnings to the results' status; end when the parent does."""
    import signal
    import threading
    import warnings
    from multiprocessing import parent_process
    from multiprocessing.connection import wait as wait_for

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore", ConvergenceWarning)
    parent = parent_process()

    def follow() -> None:
        # A killed parent cannot stop its workers: they would wait for work for ever.
        if parent is not None:
            wait_for([parent.sentinel])
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Pool:
    """Worker processes that are replaced when one dies.

    The death of one worker loses all pieces in progress. They are repeated one at a time, so
    that the piece that kills its worker is found and the others get their results.
    """

    def __init__(self, workers: int, function: Callable[[Any], Any], caller: bool):
        self.workers, self.function, self.caller = workers, function, caller
        self.running: dict[Future[Done], tuple[int, Any, bool]] = {}
        self.suspects: list[tuple[int, Any]] = []
        self._start()

    def _start(self) -> None:
        from multiprocessing import get_context

        # Forking would copy the threads' locks of BLAS and PARDISO in an unknown state.
        self.executor = ProcessPoolExecutor(
            self.workers, mp_context=get_context("spawn"), initializer=prepare_worker
        )

    @property
    def busy(self) -> bool:
        return bool(self.running or self.suspects)

    @property
    def has_room(self) -> bool:
        return not self.suspects and len(self.running) < 2 * self.workers

    def add(self, index: int, piece: Any, *, alone: bool = False) -> None:
        try:
            # The executor starts workers on submission.
            with nullcontext() if self.caller else nameless():
                future = self.executor.submit(attempt, self.function, index, piece)
        except BrokenProcessPool:
            self._replace()
            self.suspects.append((index, piece))
        else:
            self.running[future] = (index, piece, alone)

    def finished(self) -> Iterator[Done]:
        """Wait for at least one piece."""
        if not self.running and self.suspects:
            self.add(*self.suspects.pop(), alone=True)
        done, _ = wait(self.running, return_when=FIRST_COMPLETED)
        for future in done:
            if future not in self.running:
                continue
            index, piece, alone = self.running.pop(future)
            try:
                yield future.result()
            except BrokenProcessPool:
                if alone:
                    yield Done(index, error=DIED)
                else:
                    self.suspects.append((index, piece))
                self._replace()
            except Exception as error:  # such as a value that cannot be pickled
                yield Done(index, error=f"{type(error).__name__}: {error}")

    def _replace(self) -> None:
        """Start new workers; the pieces in progress become suspects."""
        self.suspects += [(index, piece) for index, piece, _ in self.running.values()]
        self.running.clear()
        self.executor.shutdown(wait=False, cancel_futures=True)
        self._start()

    def close(self) -> None:
        """Shut down, and terminate workers still running after Ctrl-C or an early exit."""
        if self.running:
            for process in list(self.executor._processes.values()):
                process.terminate()
        self.executor.shutdown(wait=True, cancel_futures=True)
