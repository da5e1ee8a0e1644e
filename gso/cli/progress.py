"""Progress bars on the error stream, shown only in a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from gso.status import Progress

#: Seconds before the bar of a single solve appears.
PATIENCE = 1.0


def watched() -> bool:
    """Tell whether the error stream is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def iterations() -> Iterator[Callable[[Progress], None] | None]:
    """Provide a callback that shows the iterations of a solve, or None without a terminal."""
    if not watched():
        yield None
        return
    start = time.monotonic()
    bars: list[Any] = []
    began = (-1, start)

    def show(progress: Progress) -> None:
        nonlocal began
        now = time.monotonic()
        if progress.stage != began[0]:
            began = (progress.stage, now)
        if now - start < PATIENCE:
            return
        stage = f"stage {progress.stage + 1}/{progress.stages}"
        if not bars:
            from tqdm import tqdm

            line = "{desc}: {percentage:3.0f}%|{bar}| {n_fmt}/{total_fmt} [{elapsed}{postfix}]"
            total = progress.iterations
            bars.append(tqdm(desc=stage, total=total, bar_format=line, leave=False))
        bar = bars[0]
        bar.total, bar.n = progress.iterations, progress.iteration
        bar.set_description_str(stage, refresh=False)
        said = f"energy {progress.energy:.4g}"
        if progress.iteration:
            left = progress.iterations - progress.iteration
            seconds = left * (now - began[1]) / progress.iteration
            said += f", at most {seconds:.0f} s left in this stage"
        bar.set_postfix_str(said)

    try:
        yield show
    finally:
        for bar in bars:
            bar.close()


@contextmanager
def words() -> Iterator[Callable[[str], None] | None]:
    """Provide a callback that shows what is being done, or None without a terminal."""
    if not watched():
        yield None
        return
    from tqdm import tqdm

    with tqdm(bar_format="{desc} [{elapsed}]", leave=False) as bar:
        yield bar.set_description_str


def files(count: int) -> Any:
    """Return a bar over files, a context with `update(n)` and `write(line, file=...)`."""
    from tqdm import tqdm

    return tqdm(total=count, disable=not watched(), leave=False, unit="file")


@dataclass
class Counts:
    """Consecutive progress bars, one per kind of counted item, and the time spent on each.

    Attributes
    ----------
    spent : dict of str to (int, float)
        Number of items added and seconds spent, by kind of item.
    """

    spent: dict[str, tuple[int, float]] = field(default_factory=dict)
    _bar: Any = None
    _what: str = ""
    _first: int = 0
    _start: float = 0.0

    def tick(self, what: str, count: int, total: int) -> None:
        """Show that `count` of `total` items of the kind `what` are done."""
        if what != self._what:
            from tqdm import tqdm

            self.close()
            # Estimate the remaining time from the mean speed since the start, because files
            # of many surfaces finish in bursts.
            self._bar = tqdm(
                desc=what,
                total=total,
                initial=count,
                smoothing=0,
                disable=not watched(),
            )
            self._what, self._first, self._start = what, count, time.perf_counter()
        self._bar.update(count - self._bar.n if not self._bar.disable else 0)
        self.spent[what] = (count - self._first, time.perf_counter() - self._start)

    def close(self) -> None:
        """Close the last bar."""
        if self._bar is not None:
            self._bar.close()


@contextmanager
def share() -> Iterator[Callable[[float, str], None]]:
    """Provide a callback that shows the completed fraction of a task and a text."""
    from tqdm import tqdm

    line = "{percentage:5.1f}%|{bar}| [{elapsed}{postfix}]"
    with tqdm(total=1.0, disable=not watched(), bar_format=line) as bar:

        def show(done: float, text: str) -> None:
            bar.n = done
            bar.set_postfix_str(text)

        yield show
