"""How long a search for pieces is likely to go on, by how long it took so far."""

from __future__ import annotations

import time
from collections.abc import Callable

from gso.seams.options import Effort

#: What a solve of the design's own pieces takes, and laying them flat in the end, over a solve of
#: pieces of the copy.
DESIGN, _END = 3.0, 1.0
#: Shares of the solves that an effort allows which a search takes on average.
_WAYS, _DIVISIONS, _MERGES = 0.5, 0.6, 0.4


class RemainingTime:
    """Says what a search does, and for about how many seconds it is likely to go on.

    Amounts of work are in solves of pieces of the copy. The search does not depend on the clock.

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
        self._start = clock()
        self._done = self._current = 0.0

    def begin(self, said: str, work: float, after: float) -> None:
        """Say what begins.

        Parameters
        ----------
        said : str
        work : float
            What it is likely to take.
        after : float
            What is likely to follow.
        """
        self._done += self._current
        self._current = work
        if self._done > 0.0:
            per_solve = (self._clock() - self._start) / self._done
            said += f", about {_rounded(per_solve * (work + after))} s left"
        self._say(said)


def after_ways(effort: Effort, left: int) -> float:
    """Return the work that follows a division, where so many others could be tried before it."""
    return _WAYS * left + after_divisions(effort, effort.divisions)


def after_divisions(effort: Effort, left: int) -> float:
    """Return the work that follows where regions may be divided so many times more."""
    return _DIVISIONS * left + after_merges(effort.merges)


def after_merges(left: int) -> float:
    """Return the work that follows where regions may be merged so many times more."""
    return _MERGES * left + DESIGN + _END


def after_design() -> float:
    """Return the work that follows a solve of the design's own pieces."""
    return _END


def _rounded(seconds: float) -> int:
    """Round seconds, from ten on to fives."""
    return round(seconds) if seconds < 10.0 else 5 * round(seconds / 5.0)
