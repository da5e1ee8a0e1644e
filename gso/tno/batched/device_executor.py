"""An executor: worker processes prepare stages, and this process minimises them on a device."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from threading import Condition
from typing import Any, cast

from gso.executors import Executor, ProcessExecutor
from gso.executors.base import R
from gso.executors.process_pool import ask
from gso.tno.batched.stage_batch import StageBatch, StageMinima, TooLarge, Unbatchable

#: Minimises the stages of several calls, of one key, together.
Together = Callable[[Sequence[StageBatch]], list[StageMinima]]


def minimise_elsewhere(gathered: StageBatch) -> StageMinima:
    """Have a stage minimised, in a call of a :class:`DeviceExecutor`."""
    return cast(StageMinima, ask(gathered))


class DeviceExecutor(Executor):
    """Calls functions in worker processes, and minimises stages for them in this one.

    Planning a surface takes much longer than its share of a solve on a graphics processor. Half of
    the workers begin to plan at a time, while the stages of the others wait for the device. The
    thread that iterates over the results of :meth:`as_completed` minimises.

    Parameters
    ----------
    processes : ProcessExecutor
        The workers, which stay open. Their functions call :func:`minimise_elsewhere`.
    together : callable
        Minimises stages of one key.
    most : int
        Largest number of surfaces to minimise together.
    enough : float
        Share of the workers that must wait before `together` is called, while others work.
    """

    def __init__(
        self,
        processes: ProcessExecutor,
        together: Together,
        *,
        most: int = 1,
        enough: float = 0.5,
    ):
        self.workers, self._processes, self._together = processes.workers, processes, together
        self._most, self._enough = most, enough * processes.workers
        #: Number of workers that do not wait, and the stages of those that do.
        self._working, self._waiting = 0, dict[Future[StageMinima], StageBatch]()
        self._changed, self._closed = Condition(), False
        self._woken: Future[None] = Future()

    def submit(self, function: Callable[..., R], *given: object) -> Future[R]:
        return self._processes.schedule(self._call, function, *given)

    def check_sent(self, option: str, functions: Iterable[object]) -> None:
        self._processes.check_sent(option, functions)

    def interrupt(self) -> None:
        self.shutdown()
        self._processes.interrupt()

    def shutdown(self) -> None:
        with self._changed:
            self._closed = True
            for solved in self._waiting:
                solved.cancel()
            self._changed.notify_all()

    def _call(self, function: Callable[..., R], *given: object) -> R:
        """Call a function in a worker, in a thread that waits for it."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or 2 * self._working < self.workers)
            self._check()
            self._working += 1
        try:
            return self._processes.call(function, *given, answer=self._minimise)
        finally:
            with self._changed:
                self._leave()

    def _minimise(self, gathered: StageBatch) -> StageMinima:
        """Have a stage minimised by the thread that waits for the results of all calls."""
        solved: Future[StageMinima] = Future()
        with self._changed:
            self._check()
            self._waiting[solved] = gathered
            self._leave()
        return solved.result()

    def _check(self) -> None:
        if self._closed:
            raise CancelledError

    def _leave(self) -> None:
        """Count a worker less that does not wait, and wake the threads that this concerns."""
        self._working -= 1
        self._changed.notify_all()
        if not self._woken.done():
            self._woken.set_result(None)

    def _finished(self, running: Iterable[Future[R]]) -> set[Future[R]]:
        """Minimise until some calls have finished, and return them."""
        while True:
            with self._changed:
                self._woken, group = Future(), self._group()
            if done := {future for future in running if future.done()}:
                return done
            if not group:
                events: list[Future[Any]] = [*running, self._woken]
                wait(events, return_when=FIRST_COMPLETED)
                continue
            answers = _minimise_all([self._waiting[solved] for solved in group], self._together)
            with self._changed:
                self._working += len(group)
                for solved, answer in zip(group, answers, strict=True):
                    del self._waiting[solved]
                    if isinstance(answer, Exception):
                        solved.set_exception(answer)
                    else:
                        solved.set_result(answer)

    def _group(self) -> list[Future[StageMinima]]:
        """Choose the stages of one key that have the most surfaces; none while too few wait."""
        by_key: dict[bytes, list[Future[StageMinima]]] = {}
        for solved, gathered in self._waiting.items():
            by_key.setdefault(gathered.key, []).append(solved)
        best: list[Future[StageMinima]] = []
        surfaces = 0
        for some in by_key.values():
            # The first one is taken however large it is.
            group, total = some[:1], len(self._waiting[some[0]])
            for solved in some[1:]:
                if total + len(self._waiting[solved]) <= self._most:
                    total += len(self._waiting[solved])
                    group.append(solved)
            if total > surfaces:
                best, surfaces = group, total
        return best if not self._working or len(best) >= self._enough else []


def _minimise_all(parts: Sequence[StageBatch], together: Together) -> list[StageMinima | Exception]:
    """Minimise parts together, in halves where memory is short; return results or exceptions."""
    try:
        return list(together(parts))
    except (Unbatchable, TooLarge) as error:
        if len(parts) == 1:
            return [error]
    half = len(parts) // 2
    return [x for some in (parts[:half], parts[half:]) for x in _minimise_all(some, together)]
