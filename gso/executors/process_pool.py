"""Worker processes of this machine, which may die."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from multiprocessing.pool import ExceptionWithTraceback  # type: ignore[attr-defined]
from multiprocessing.util import Finalize
from threading import Lock, Thread
from types import ModuleType
from typing import Any

from gso.errors import ConvergenceWarning, OptionError
from gso.executors.base import Executor, R, T, check_workers, processors
from gso.executors.exchange import Ended, receive, send, unsendable

#: What a message is: the result of a call, what it raised, or a request in its course.
_RESULT, _RAISED, _ASKED = range(3)
#: Held while the main script is hidden.
_HIDING = Lock()
#: In a worker, the connection to the process whose calls it has.
_caller: Connection


class ProcessExecutor(Executor):
    """Worker processes, which start when they are needed and stay until they are closed.

    They start in some seconds. A thread of this process waits for each of them. One that dies is
    replaced, and its item is repeated.

    Parameters
    ----------
    workers : int, optional
        Number of processes; one for each processor when not given.
    main : bool
        Whether workers import the caller's script, which may define functions and classes that
        they need. The script then needs a guard ``if __name__ == "__main__"``.

    Raises
    ------
    OptionError
        The number is none, or the executor is used when it is closed.

    Examples
    --------
    >>> with ProcessExecutor(1) as executor:
    ...     once = executor.map(abs, [-1, 2])
    ...     again = sorted(item.result for item in executor.as_completed(abs, [-3, 4]))
    >>> once, again
    ([1, 2], [3, 4])
    """

    def __init__(self, workers: int | None = None, *, main: bool = False):
        check_workers(workers, 1)
        self.workers, self._main, self._closed = workers or processors(), main, False
        self._threads = ThreadPoolExecutor(self.workers)
        self._processes: dict[Connection, SpawnProcess] = {}
        self._idle: list[Connection] = []
        self._changing = Lock()
        # Processes that nobody has ended would keep this one from exiting.
        Finalize(self, _terminate, (self._processes,), exitpriority=1)

    def submit(self, function: Callable[..., R], *given: object) -> Future[R]:
        return self.schedule(self.call, function, *given)

    def schedule(self, job: Callable[..., R], *given: object) -> Future[R]:
        """Schedule a job of a thread of this process, which makes one :meth:`call`."""
        if self._closed:
            raise OptionError("this executor is closed; make another")
        return self._threads.submit(job, *given)

    def call(
        self,
        function: Callable[..., R],
        *given: object,
        answer: Callable[[Any], object] | None = None,
    ) -> R:
        """Call a function in a worker, and return its result.

        Parameters
        ----------
        function : callable
        *given
            Its arguments.
        answer : callable, optional
            Answers the requests that the function makes by :func:`ask`.

        Raises
        ------
        Ended
            The worker died.
        """
        worker = self._worker()
        try:
            send(worker, (function, given))
            while (said := receive(worker))[0] == _ASKED:
                _reply(worker, answer, said[1])
        except Exception:
            _terminate({worker: self._processes.pop(worker)})
            raise
        self._idle.append(worker)
        result: R = _value(*said)
        return result

    def _worker(self) -> Connection:
        """Return a worker that has no call, or start one."""
        with self._changing:
            if self._closed:
                raise Ended
            if self._idle:
                return self._idle.pop()
            # Forking would copy the threads' locks of BLAS and PARDISO in an unknown state.
            context = get_context("spawn")
            here, there = context.Pipe()
            process = context.Process(target=_work, args=(there,))
            with nullcontext() if self._main else _hidden_main():
                process.start()
            there.close()
            self._processes[here] = process
            return here

    def map(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Apply a function to items, and return the results in order.

        This process does the work that no worker has begun, and that of one which dies.
        """
        futures = {k: self.submit(function, items[k]) for k in range(1, len(items))}
        own = {0: function(items[0])} if items else {}
        own |= {k: function(items[k]) for k in reversed(futures) if futures[k].cancel()}
        for k in sorted(futures.keys() - own.keys()):
            try:
                own[k] = futures[k].result()
            except BrokenExecutor:
                own[k] = function(items[k])
        return [own[k] for k in range(len(items))]

    def check_sent(self, option: str, functions: Iterable[object]) -> None:
        for function in functions:
            if why := unsendable(function):
                raise OptionError(
                    f"{option}: {function!r} cannot be sent to worker processes ({why}); define it "
                    "at the top level of a module, or take workers=0"
                )

    def interrupt(self) -> None:
        with self._changing:
            for worker, process in list(self._processes.items()):
                if worker not in self._idle:
                    process.terminate()

    def shutdown(self) -> None:
        self._closed = True
        self.interrupt()
        self._threads.shutdown(cancel_futures=True)
        _terminate(self._processes)


def ask(request: object) -> Any:
    """Ask the process that has made this call, which answers as :meth:`ProcessExecutor.call` says.

    What the answer raises is raised here.
    """
    send(_caller, (_ASKED, request))
    return _value(*receive(_caller))


def _value(kind: int, value: Any) -> Any:
    if kind == _RAISED:
        raise value
    return value


def _reply(connection: Connection, function: Any, *given: object) -> None:
    """Send the result of a function, or what it raises."""
    try:
        said: tuple[int, object] = _RESULT, function(*given)
    except Exception as error:
        said = _RAISED, ExceptionWithTraceback(error, error.__traceback__)
    try:
        send(connection, said)
    except Ended:
        raise
    except Exception as error:  # it cannot be pickled
        send(connection, (_RAISED, error))


def _work(connection: Connection) -> None:
    """Work in a process until the connection ends."""
    global _caller
    _caller = connection
    # Ctrl-C is left to the parent, and warnings to the results' status.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore", ConvergenceWarning)
    Thread(target=_follow, daemon=True).start()
    with suppress(Ended):
        while True:
            _reply(connection, _called, connection)


def _called(connection: Connection) -> object:
    function, given = receive(connection)
    return function(*given)


def _follow() -> None:
    """End when the parent does: a killed one cannot stop its workers."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _terminate(processes: dict[Connection, SpawnProcess]) -> None:
    for process in processes.values():
        process.terminate()
    for process in processes.values():
        process.join()
    processes.clear()


@contextmanager
def _hidden_main() -> Iterator[None]:
    """Hide the main script, so that processes started meanwhile do not import it."""
    with _HIDING:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main
