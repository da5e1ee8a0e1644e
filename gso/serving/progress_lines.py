"""Progress of a request, and its cancellation."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event

from gso.status import Progress

#: Smallest number of seconds between two lines.
_PAUSE = 0.1


class Cancelled(BaseException):
    """A request is cancelled; no code that handles errors of one item may go on with the next."""


class ProgressLines:
    """What is being done, as lines that are not too many.

    Parameters
    ----------
    tell : callable
        Called with the share that is done, None if that is not known, and a text.
    cancelled : Event
        Set when the request is cancelled.
    """

    def __init__(self, tell: Callable[[float | None, str], None], cancelled: Event):
        self._tell, self._cancelled = tell, cancelled
        self._last = -1.0

    def say(self, text: str) -> None:
        """Tell what is being done.

        Raises
        ------
        Cancelled
            The request is cancelled.
        """
        self._line(None, text)

    def step(self, progress: Progress) -> None:
        """Tell how far a solve is.

        Raises
        ------
        Cancelled
            The request is cancelled.
        """
        stage = progress.iteration / max(progress.iterations, 1)
        share = (progress.stage + stage) / max(progress.stages, 1)
        self._line(share, progress.name or f"stage {progress.stage + 1} of {progress.stages}")

    def check(self) -> None:
        """Raise :class:`Cancelled` if the request is cancelled."""
        if self._cancelled.is_set():
            raise Cancelled

    def _line(self, share: float | None, text: str) -> None:
        self.check()
        now = time.monotonic()
        if now - self._last >= _PAUSE:
            self._last = now
            self._tell(share, text)
