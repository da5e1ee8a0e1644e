"""The server: requests are read while one of them runs, and run one after another."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Event, Lock, Thread

from gso.errors import ConvergenceWarning, GSOError
from gso.serving.methods import call
from gso.serving.progress_lines import Cancelled, ProgressLines
from gso.serving.protocol import LineError, Request, encoded, is_id, read_request
from gso.typing import Json

_log = logging.getLogger("gso")


class Server:
    r"""Answers requests, line by line.

    A request ``cancel`` is answered at once: it ends the request whose id is its parameter ``id``
    at the next progress line of it, or before it begins.

    Parameters
    ----------
    write : callable
        Called with each line of an answer, its end included; never by two threads at a time.

    Examples
    --------
    >>> lines = ['{"id": 1, "method": "describe"}', "what?"]
    >>> said = []
    >>> Server(said.append).run(lines)
    >>> sorted(said)[1]
    '{"id":null,"error":{"message":"line 2 is no JSON: ...","kind":"LineError","line":2}}\n'
    """

    def __init__(self, write: Callable[[str], None]):
        self._write, self._lock = write, Lock()
        self._running: dict[str | int, Event] = {}
        self._queue: SimpleQueue[Request | None] = SimpleQueue()

    def run(self, lines: Iterable[str | bytes]) -> None:
        """Answer all requests, until the lines end."""
        Thread(target=self._read, args=(lines,), daemon=True).start()
        while (request := self._queue.get()) is not None:
            self._answer(request)

    def _read(self, lines: Iterable[str | bytes]) -> None:
        """Read requests, and put them into the queue."""
        try:
            for number, line in enumerate(lines, 1):
                if line.strip():
                    self._take(line, number)
        finally:
            self._queue.put(None)

    def _take(self, line: str | bytes, number: int) -> None:
        try:
            request = read_request(line, number)
            if request.method == "cancel":
                self._say(request.id, result={"cancelled": self._cancel(request, number)})
                return
            if request.id in self._running:
                # Its answer must not be taken for that of the other one.
                what = f"has the id {request.id!r} of a request that runs; give another id"
                raise LineError(number, what)
        except LineError as error:
            self._say(error.id, error=_error(error) | {"line": error.line})
            return
        self._running[request.id] = Event()
        self._queue.put(request)

    def _cancel(self, request: Request, number: int) -> bool:
        """Cancel a request, and return whether it is there."""
        if set(request.params) != {"id"} or not is_id(request.params["id"]):
            raise LineError(number, 'has no "id" in its "params"; name what to cancel', request.id)
        event = self._running.get(request.params["id"])
        if event is not None:
            event.set()
        return event is not None

    def _answer(self, request: Request) -> None:
        """Run a request, and write its answer."""

        def tell(share: float | None, text: str) -> None:
            self._say(request.id, progress=share, text=text)

        progress = ProgressLines(tell, self._running[request.id])
        try:
            with _warned() as texts:
                result = call(request.method, request.params, progress)
            answer: Json = {"result": result | {"warnings": texts}}
        except Cancelled:
            answer = {"error": {"message": "cancelled, as asked for", "kind": "Cancelled"}}
        except GSOError as error:
            answer = {"error": _error(error)}
        except MemoryError:
            message = "not enough memory; give a coarser mesh"
            answer = {"error": {"message": message, "kind": "MemoryError"}}
        # A fault of the package must not end the requests that follow.
        except Exception as error:
            _log.exception("request %r failed", request.id)
            answer = {"error": _fault(error)}
        del self._running[request.id]
        try:
            self._say(request.id, **answer)
        except ValueError as error:
            self._say(request.id, error=_fault(error))

    def _say(self, id: str | int | None, **answer: object) -> None:
        line = encoded({"id": id, **answer})
        with self._lock:
            self._write(line)


def _error(error: GSOError) -> Json:
    return {"message": " ".join(str(error).split()), "kind": type(error).__name__}


def _fault(error: Exception) -> Json:
    """Return the error of a fault of the package, or of a value that no check expected."""
    return {
        "message": f"{type(error).__name__}: {error}; check the types of the parameters, and "
        "report it with the request if they are right",
        "kind": "Fault",
    }


@contextmanager
def _warned() -> Iterator[list[str]]:
    """Provide a list that gets the texts of warnings for the user."""
    texts: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        # The status in the answer says the same.
        warnings.simplefilter("ignore", ConvergenceWarning)
        yield texts
    texts += [str(w.message) for w in caught if issubclass(w.category, UserWarning)]
