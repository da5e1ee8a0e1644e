"""What all executors have in common, and the one that works in this process."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass
from itertools import islice
from multiprocessing import parent_process
from typing import Generic, TypeVar

from gso.errors import GSOError, OptionError

T = TypeVar("T")
R = TypeVar("R")
Own = TypeVar("Own", bound="Executor")

#: The error of an item that ends its process.
DIED = "the worker process died; is there enough memory?"


@dataclass(frozen=True)
class Item(Generic[R]):
    """One finished item: its place in the input, and its result or its error."""

    index: int
    result: R | None = None
    error: str | None = None

    @property
    def ok(self) -> bool:
        """Whether there is no error."""
        return self.error is None


class Executor(ABC):
    """Calls functions somewhere, as the executors of :mod:`concurrent.futures` do.

    In other processes functions must be importable by name, or partials of such. An executor
    serves any number of calls, also at the same time.

    Attributes
    ----------
    workers : int
        Number of processes that work; 0 for this one alone.
    """

    workers: int

    @abstractmethod
    def submit(self, function: Callable[..., R], *given: object) -> Future[R]:
        """Schedule a call; an executor that is closed raises an OptionError."""

    def check_sent(self, option: str, functions: Iterable[object]) -> None:  # noqa: B027
        """Raise an OptionError that names an option if its functions cannot be sent to workers."""

    def interrupt(self) -> None:  # noqa: B027, there may be nothing to end
        """End the calls that are running."""

    def shutdown(self) -> None:  # noqa: B027, or to close
        """Close the executor, and end the calls that are not finished."""

    def __enter__(self: Own) -> Own:
        return self

    def __exit__(self, *raised: object) -> None:
        self.shutdown()

    def map(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Apply a function to items, and return the results in order; what it raises is raised.

        Examples
        --------
        >>> SERIAL.map(abs, [-1, 2])
        [1, 2]
        """
        return [f.result() for f in [self.submit(function, item) for item in items]]

    def as_completed(
        self, function: Callable[[T], R], items: Iterable[T]
    ) -> Generator[Item[R], None, None]:
        """Apply a function to items, and yield results as they finish.

        Parameters
        ----------
        function : callable
            Of one argument.
        items : iterable
            Read as workers become free, so that a generator of any length fits in memory.

        Yields
        ------
        Item
            In the order of completion. An exception, or the death of a worker, becomes the
            `error` of its item and does not end the others.

        Examples
        --------
        >>> [item.result for item in SERIAL.as_completed(abs, [-1, 2])]
        [1, 2]
        """
        numbered = enumerate(items)
        running: dict[Future[Item[R]], tuple[int, T]] = {}
        # Items whose worker died. Others may have taken the memory: they are repeated alone.
        lost: list[tuple[int, T]] = []
        try:
            while True:
                alone = bool(lost) and not running
                if alone:
                    begun = iter([lost.pop()])
                else:
                    # Two for each worker: none idles while the caller uses a result.
                    room = max(2 * self.workers, 1) - len(running)
                    begun = islice(numbered, 0 if lost else max(room, 0))
                for index, item in begun:
                    running[self.submit(_attempt, function, index, item)] = index, item
                if not running:
                    return
                for future in self._finished(running):
                    index, item = running.pop(future)
                    try:
                        done = future.result()
                    except BrokenExecutor:
                        if not alone:
                            lost.append((index, item))
                            continue
                        done = Item(index, error=DIED)
                    except Exception as error:  # such as a result that cannot be pickled
                        done = Item(index, error=_worded(error))
                    yield done
        finally:
            for future in running:
                future.cancel()
            if any(future.running() for future in running):
                self.interrupt()

    def _finished(self, running: Iterable[Future[R]]) -> set[Future[R]]:
        """Wait until some calls have finished, and return them."""
        return wait(running, return_when=FIRST_COMPLETED).done


class SerialExecutor(Executor):
    """Calls functions in this process, at once."""

    workers = 0

    def submit(self, function: Callable[..., R], *given: object) -> Future[R]:
        future: Future[R] = Future()
        try:
            future.set_result(function(*given))
        except Exception as error:
            future.set_exception(error)
        return future


#: For functions whose callers give no executor.
SERIAL = SerialExecutor()


def _attempt(function: Callable[[T], R], index: int, item: T) -> Item[R]:
    """Apply a function to an item; an exception becomes its error."""
    try:
        return Item(index, function(item))
    except Exception as error:  # one broken item must not end the others
        return Item(index, error=_worded(error))


def _worded(error: Exception) -> str:
    return str(error) if isinstance(error, GSOError) else f"{type(error).__name__}: {error}"


def check_workers(workers: object, least: int = 0) -> None:
    """Raise an OptionError if a number of workers is neither None nor `least` or more."""
    if workers is not None and (not isinstance(workers, int) or workers < least):
        raise OptionError(f"workers is {workers!r}; it must be a whole number of {least} or more")


def processors() -> int:
    """Return the number of processors that this process may use (its CPU affinity)."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def useful_workers(items: int) -> int:
    """Return the number of worker processes for some items: none for one, or inside a worker."""
    count = min(processors(), items)
    return count if count > 1 and parent_process() is None else 0
