"""Worker processes that plan and conclude, while this process minimises on the device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import Any, cast

from gso.errors import OptionError
from gso.parallel import DIED, Done, attempt, nameless, prepare_worker, processors
from gso.tno.batched.exchange import receive, send
from gso.tno.batched.gathered import Gathered, Solved, TooLarge, Unbatchable

#: Minimises the stages of several workers, of one key, together.
Together = Callable[[Sequence[Gathered]], list[Solved]]


class BatchWorkers:
    """Processes that prepare surfaces for :func:`gso.tno.optimize_batch` on a graphics processor.

    Planning a surface takes much longer than its share of a solve on a graphics processor.
    So these processes plan, and this one minimises what several of them have planned together.
    They start in some seconds, and stay for further batches until they are closed.

    Parameters
    ----------
    count : int, optional
        Number of processes; two for each processor when not given. At most half of them plan at a
        time, while others wait for the device.

    Examples
    --------
    >>> import gso, numpy as np
    >>> bowl = np.dstack([*np.mgrid[-1:1:9j, -1:1:9j], np.zeros((9, 9))])
    >>> bowl[..., 2] = 0.1 * (bowl[..., 0] ** 2 + bowl[..., 1] ** 2)
    >>> with gso.tno.BatchWorkers(1) as workers:
    ...     results = gso.tno.optimize_batch([bowl, 2 * bowl], workers=workers)
    >>> len(results)
    2
    """

    def __init__(self, count: int | None = None):
        if count is not None and (not isinstance(count, int) or count < 1):
            raise OptionError(f"count is {count!r}; it must be a whole number of 1 or more")
        self._processes: dict[Connection, Any] = {}
        for _ in range(count or 2 * processors()):
            self._start()

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
        """Return the number of processes."""
        return len(self._processes)

    def close(self) -> None:
        """End the processes."""
        for connection in list(self._processes):
            self._end(connection)

    def _start(self) -> None:
        from multiprocessing import get_context

        context = get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(there,), daemon=True)
        with nameless():
            process.start()
        there.close()
        self._processes[here] = process

    def _end(self, connection: Connection) -> None:
        process = self._processes.pop(connection)
        connection.close()
        process.terminate()
        process.join()

    def spread(
        self,
        function: Callable[..., Any],
        pieces: Sequence[Any],
        together: Together,
        *,
        most: int,
        enough: float = 0.5,
    ) -> Iterator[Done]:
        """Apply a function to pieces in the processes, and yield results as they finish.

        Parameters
        ----------
        function : callable
            Called with a piece and `minimise`, which has this process minimise a stage; it must be
            importable by name, or a partial of one that is.
        pieces : sequence
        together : callable
            Minimises stages of one key here.
        most : int
            Largest number of surfaces to minimise together.
        enough : float
            Share of the processes for which it is called while others plan.

        Yields
        ------
        Done
            As by :func:`gso.parallel.spread`.
        """
        todo, lost = deque(range(len(pieces))), set[int]()
        busy = -(-len(self) // 2)
        given: dict[Connection, int] = {}
        waiting: dict[Connection, Gathered] = {}
        try:
            while todo or given:
                for connection in self._processes:
                    if connection not in given and todo and len(given) - len(waiting) < busy:
                        given[connection] = todo.popleft()
                        _told(connection, (function, given[connection], pieces[given[connection]]))
                planning = [c for c in given if c not in waiting]
                group = _group(waiting, most)
                if group and (not planning or len(group) >= max(enough * len(self), 1)):
                    parts = [waiting.pop(connection) for connection in group]
                    for connection, answer in zip(group, _minimised(parts, together), strict=True):
                        _told(connection, answer)
                    continue
                for connection in cast(list[Connection], wait(planning)):
                    index = given[connection]
                    try:
                        what, value = receive(connection)
                    except (EOFError, OSError):
                        self._replace(connection)
                        del given[connection]
                        if index in lost:
                            yield Done(index, error=DIED)
                        else:
                            # Another piece may have taken the memory.
                            lost.add(index)
                            todo.append(index)
                        continue
                    if what == "minimise":
                        waiting[connection] = value
                    else:
                        del given[connection]
                        yield value
        finally:
            # What is still in progress is not wanted any more.
            for connection in given:
                self._replace(connection)

    def _replace(self, connection: Connection) -> None:
        """Start another process in place of one."""
        self._end(connection)
        self._start()


def _told(connection: Connection, value: Any) -> None:
    """Send a value to a process, which may have died; then nothing can be received from it."""
    with suppress(OSError):
        send(connection, value)


def _group(waiting: dict[Connection, Gathered], most: int) -> list[Connection]:
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


def _minimised(parts: Sequence[Gathered], together: Together) -> list[Any]:
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
    # They are raised when the other process has ended.
    with suppress(EOFError, OSError):
        while True:
            function, index, piece = receive(connection)
            send(connection, ("done", attempt(partial(function, minimise=minimise), index, piece)))


def _elsewhere(connection: Connection, gathered: Gathered) -> Solved:
    """Have a stage minimised by the other process."""
    send(connection, ("minimise", gathered))
    answer = receive(connection)
    if isinstance(answer, Exception):
        raise answer
    return answer
