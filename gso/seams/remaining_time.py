"""How long a search for pieces is likely to go on, by how long it took so far."""

from __future__ import annotations

import time
from collections.abc import Callable

from gso.wording import time_left

#: What the first solve of the design's own pieces is likely to take, and what follows the last,
#: over what a solve of pieces of the copy takes.
_DESIGN, _END = 2.0, 1.0
#: Share of the solves that may follow which do on average.
_LIKELY = 0.5


class RemainingTime:
    """Says what a search does, and for about how many seconds it is likely to go on.

    The search does not depend on the clock.

    Parameters
    ----------
    say : callable
        Called with what is being done, in words.
    clock : callable
        Returns seconds.
    """

    def __init__(
        self, say: Callable[[str], None], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._say, self._clock = say, clock
        # Of finished solves.
        self._of_copy: list[float] = []
        self._of_design: list[float] = []
        self._running: list[float] | None = None
        self._begun = 0.0

    def of_copy(self, said: str, possible: int) -> None:
        """Say that pieces of the copy are solved, after which so many such solves may follow."""
        self._begin(self._of_copy)
        if self._of_copy:
            seconds = _mean(self._of_copy)
            solves = 1.0 + _LIKELY * possible + _DESIGN + _END
            said += ", " + time_left(seconds * solves)
        self._say(said)

    def of_design(self, said: str, possible: int) -> None:
        """Say that the design's own pieces are solved, perhaps with so many more attempts."""
        self._begin(self._of_design)
        if self._of_copy:
            seconds = _mean(self._of_copy)
            own = _mean(self._of_design) if self._of_design else _DESIGN * seconds
            said += ", " + time_left(own * (1.0 + _LIKELY * possible) + _END * seconds)
        self._say(said)

    def _begin(self, solves: list[float]) -> None:
        """Note the time of the solve that ends, and that one begins."""
        now = self._clock()
        if self._running is not None:
            self._running.append(now - self._begun)
        self._running, self._begun = solves, now


def _mean(seconds: list[float]) -> float:
    return sum(seconds) / len(seconds)
