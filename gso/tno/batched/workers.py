"""Worker processes that plan and conclude, while this process minimises on the device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, wait
from threading import Lock
from types import TracebackType
from typing import Any, cast

from gso.errors import OptionError
from gso.parallel import DIED, Done, attempt, nameless, prepare_worker, processors
from gso.tno.batched.exchange import Ended, receive, send
from gso.tno.batched.stage_batch import StageBatch, StageMinima, TooLarge, Unbatchable

#: Minimises the stages of several workers, of one key, together.
Together = Callable[[Sequence[StageBatch]], list[StageMinima]]


class BatchWorkers:
    """Processes for many calls of :func:`gso.tno.optimize_batch`.

    With a graphics processor they plan: that takes much longer than the share of a surface in a
    solve there. This process minimises what several of them have planned. On a processor they
    solve whole batches. They start when they are needed, in some seconds, and stay until they are
    closed.

    Parameters
    ----------
    count : int, optional
        Number of processes that work at a time; one for each processor when not given. With a
        graphics processor as many more wait for it meanwhile.

    Raises
    ------
    OptionError
        The number is none, or the workers are used when they are closed or busy.

    Examples
    --------
    >>> import gso, numpy as np
    >>> bowl = np.dstack([*np.mgrid[-1:1:9j, -1:1:9j], np.zeros((9, 9))])
    >>> bowl[..., 2] = 0.1 * (bowl[..., 0] ** 2 + bowl[..., 1] ** 2)
    >>> with gso.tno.BatchWorkers(1) as workers:
    ...     once = gso.tno.optimize_batch([bowl, 2 * bowl], workers=workers)
    ...     again = gso.tno.optimize_batch([3 * bowl], workers=workers)
    >>> len(once), len(again)
    (2, 1)
    """

    def __init__(self, count: int | None = None):
        if count is not None and (not isinstance(count, int) or count < 1):
            raise OptionError(f"count is {count!r}; it must be a whole number of 1 or more")
        self._count = count or processors()
        self._processes: dict[Connection, Any] = {}
        #: What each process that has work is given: the number of a piece.
        self._given: dict[Connection, int] = {}
        self._closed, self._used = False, Lock()

    def __enter__(self) -> BatchWorkers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __len__(self) -> int:
        """Return the number of processes that work at a time."""
        return self._count

    def close(self) -> None:
        """End the processes."""
        self._closed = True
        self._end(list(self._processes))

    def _start(self) -> Connection:
        from multiprocessing import get_context

        context = get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(there,), daemon=True)
        with nameless():
            process.start()
        there.close()
        self._processes[here] = process
        return here

    def _end(self, connections: Sequence[Connection]) -> None:
        """End processes; others start in their place when they are needed."""
        for connection in connections:
            if connection in self._processes:
                self._processes[connection].terminate()
        for connection in connections:
            process = self._processes.pop(connection, None)
            self._given.pop(connection, None)
            if process is not None:
                connection.close()
                process.join()

    def _idle(self, most: int) -> Connection | None:
        """Return a process without work; None if all of `most` have some."""
        for connection in self._processes:
            if connection not in self._given:
                return connection
        return self._start() if len(self._processes) < most else None

    def spread(
        self,
        function: Callable[..., Any],
        pieces: Sequence[Any],
        together: Together | None = None,
        *,
        most: int = 1,
        enough: float = 0.5,
    ) -> Generator[Done, None, None]:
        """Apply a function to pieces in the processes, and yield results as they finish.

        Parameters
        ----------
        function : callable
            Called with a piece and `minimise`, which has this process minimise a stage; it must be
            importable by name, or a partial of one that is.
        pieces : sequence
            What the function is applied to.
        together : callable, optional
            Minimises stages of one key here; not given where the function minimises by itself.
        most : int
            Largest number of surfaces to minimise together.
        enough : float
            Share of the processes that must wait before `together` is called, while others work.

        Yields
        ------
        Done
            As by :func:`gso.parallel.spread`.

        Raises
        ------
        OptionError
            The workers are closed, or busy with another call.
        """
        if self._closed:
            raise OptionError("these BatchWorkers are closed; make others")
        if not self._used.acquire(blocking=False):
            raise OptionError("these BatchWorkers are busy; make others for another thread")
        try:
            # Of a call that was not ended properly.
            self._end(list(self._given))
            yield from self._spread(function, pieces, together, most, enough)
        finally:
            self._end(list(self._given))
            self._used.release()

    def _spread(
        self,
        function: Callable[..., Any],
        pieces: Sequence[Any],
        together: Together | None,
        most: int,
        enough: float,
    ) -> Generator[Done, None, None]:
        given, waiting = self._given, dict[Connection, StageBatch]()
        todo, lost = deque(range(len(pieces))), deque[int]()
        alone = False
        processes = self._count if together is None else 2 * self._count
        while todo or lost or given:
            while (lost and not given) or (
                todo and not lost and not alone and len(given) - len(waiting) < self._count
            ):
                connection = self._idle(processes)
                if connection is None:
                    break
                alone = bool(lost)
                index = given[connection] = lost.popleft() if lost else todo.popleft()
                # A process that has died is found out below.
                with suppress(Ended):
                    send(connection, (function, index, pieces[index]))
            working = [c for c in given if c not in waiting]
            group = _group(waiting, most)
            if (
                group
                and together is not None
                and (not working or len(group) >= max(enough * processes, 1))
            ):
                parts = [waiting.pop(connection) for connection in group]
                for connection, answer in zip(group, _minimised(parts, together), strict=True):
                    with suppress(Ended):
                        send(connection, answer)
                continue
            for connection in cast(list[Connection], wait(working)):
                try:
                    what, value = receive(connection)
                except Ended:
                    index = given[connection]
                    self._end([connection])
                    if alone:
                        alone = False
                        yield Done(index, error=DIED)
                    else:
                        # Another piece may have taken the memory: this one is repeated alone.
                        lost.append(index)
                    continue
                if what == "minimise":
                    waiting[connection] = value
                else:
                    del given[connection]
                    alone = False
                    yield value


def _group(waiting: dict[Connection, StageBatch], most: int) -> list[Connection]:
    """Choose processes whose stages have one key, and that have the most surfaces."""
    by_key: dict[bytes, list[Connection]] = {}
    for connection, gathered in waiting.items():
        by_key.setdefault(gathered.key, []).append(connection)
    best: list[Connection] = []
    surfaces = 0
    for group in by_key.values():
        # The first one is taken however large it is.
        total, some = len(waiting[group[0]]), group[:1]
        for connection in group[1:]:
            if total + len(waiting[connection]) <= most:
                total += len(waiting[connection])
                some.append(connection)
        if total > surfaces:
            best, surfaces = some, total
    return best


def _minimised(parts: Sequence[StageBatch], together: Together) -> list[Any]:
    """Minimise parts together, in halves where memory is short; return results or exceptions."""
    try:
        return list(together(parts))
    except (Unbatchable, TooLarge) as error:
        if len(parts) == 1:
            return [error]
    half = len(parts) // 2
    return [x for some in (parts[:half], parts[half:]) for x in _minimised(some, together)]


def _work(connection: Connection) -> None:
    """Work until the connection ends, and have stages minimised by the other process."""
    prepare_worker()
    minimise = partial(_elsewhere, connection)
    with suppress(Ended):
        while True:
            function, index, piece = receive(connection)
            done = attempt(partial(function, minimise=minimise), index, piece)
            try:
                send(connection, ("done", done))
            except Ended:
                raise
            except Exception as error:  # such as a value that cannot be pickled
                failed = Done(index, error=f"{type(error).__name__}: {error}")
                send(connection, ("done", failed))


def _elsewhere(connection: Connection, gathered: StageBatch) -> StageMinima:
    """Have a stage minimised by the other process."""
    send(connection, ("minimise", gathered))
    answer: StageMinima | Exception = receive(connection)
    if isinstance(answer, Exception):
        raise answer
    return answer
