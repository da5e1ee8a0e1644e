"""Progress on the error stream, shown only in a terminal.

All commands have one style: what is done, a bar where the amount of work is known, the time spent,
and about how long it goes on.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from typing import Any

from gso.status import Progress
from gso.wording import time_left

#: Seconds before a line appears.
PATIENCE = 1.0

#: With and without a bar.
_BAR = "{desc} {percentage:3.0f}%|{bar:24}| {elapsed}{postfix}"
_TEXT = "{desc}, {elapsed}{postfix}"


def watched() -> bool:
    """Tell whether the error stream is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


class Line:
    """A line of the terminal that shows progress. It is erased when it is closed.

    Parameters
    ----------
    total : float or None
        Amount of work; None if it is not known.
    """

    def __init__(self, total: float | None = None) -> None:
        self._total = total
        self._shown: Any = None
        self._start = time.monotonic()

    def show(self, what: str, done: float = 0.0, *notes: str, total: float | None = None) -> None:
        """Show what is being done, the amount of work that is done, and notes."""
        elapsed = time.monotonic() - self._start
        if not watched() or elapsed < PATIENCE:
            return
        self._total = self._total if total is None else total
        if self._shown is None:
            from tqdm import tqdm

            style = _TEXT if self._total is None else _BAR
            # With a delay the line is not drawn before its text is set.
            self._shown = tqdm(total=self._total, bar_format=style, leave=False, delay=1e-9)
            self._shown.start_t -= elapsed
        self._shown.total, self._shown.n = self._total, done
        self._shown.set_description_str(what, refresh=False)
        self._shown.set_postfix_str(", ".join(notes))

    def write(self, text: str, file: Any) -> None:
        """Print a text to a stream, above the line."""
        if self._shown is None:
            print(text, file=file)
        else:
            self._shown.write(text, file=file)

    def close(self) -> None:
        """Erase the line."""
        if self._shown is not None:
            self._shown.close()


@contextmanager
def iterations() -> Iterator[Callable[[Progress], None] | None]:
    """Provide a callback that shows the iterations of a solve, or None without a terminal."""
    if not watched():
        yield None
        return
    began = (-1, 0.0)

    def show(progress: Progress) -> None:
        nonlocal began
        now = time.monotonic()
        if progress.stage != began[0]:
            began = (progress.stage, now)
        notes = [f"energy {progress.energy:.4g}"]
        if progress.iteration:
            most = progress.iterations - progress.iteration
            seconds = most * (now - began[1]) / progress.iteration
            notes.append(f"{time_left(seconds, most=True)} in this stage")
        stage = f"stage {progress.stage + 1}/{progress.stages}"
        line.show(stage, progress.iteration, *notes, total=max(progress.iterations, 1))

    with closing(Line()) as line:
        yield show


@contextmanager
def words() -> Iterator[Callable[[str], None] | None]:
    """Provide a callback that shows what is being done, or None without a terminal."""
    if not watched():
        yield None
        return
    with closing(Line()) as line:
        yield line.show


@dataclass
class Counts:
    """Consecutive lines, one per kind of counted item, and the time spent on each.

    Attributes
    ----------
    spent : dict of str to (int, float)
        Number of items added and seconds spent, by kind of item.
    """

    spent: dict[str, tuple[int, float]] = field(default_factory=dict)
    _line: Line = field(default_factory=Line)
    _what: str = ""
    _first: int = 0
    _start: float = 0.0

    def tick(self, what: str, count: int, total: int) -> None:
        """Show that `count` of `total` items of the kind `what` are done."""
        if what != self._what:
            self.close()
            self._line = Line(total)
            self._what, self._first, self._start = what, count, time.perf_counter()
        added, seconds = count - self._first, time.perf_counter() - self._start
        self.spent[what] = (added, seconds)
        # From the mean speed since the start, because files of many surfaces finish in bursts.
        left = [time_left(seconds * (total - count) / added)] if added else []
        self._line.show(what, count, f"{count} of {total}", *left)

    def write(self, text: str, file: Any) -> None:
        """Print a text to a stream, above the line."""
        self._line.write(text, file)

    def close(self) -> None:
        """Erase the last line."""
        self._line.close()


@contextmanager
def share(what: str) -> Iterator[Callable[..., None]]:
    """Provide a callback that shows the fraction of `what` that is done, a text, and seconds left.

    Without the seconds they are estimated.
    """
    start = time.monotonic()
    first: float | None = None

    def show(done: float, text: str = "", left: float | None = None) -> None:
        nonlocal first
        first = done if first is None else first
        if left is None and done > first:
            left = (time.monotonic() - start) * (1.0 - done) / (done - first)
        said = [text] if text else []
        line.show(what, done, *said, *([] if left is None else [time_left(left)]))

    with closing(Line(1.0)) as line:
        yield show
