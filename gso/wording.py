"""Places, lengths and shares in words."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence

_log = logging.getLogger("gso")

#: Largest number of places that a reason lists.
_NAMED = 6


def places(what: str, ids: Sequence[int | str]) -> str:
    """Format a list of elements by number or name; only the first few are listed.

    >>> places("face", [3]), places("vertex", range(8))
    ('face 3', 'vertices 0, 1, 2, 3, 4, 5 and 2 more')
    """
    several = "vertices" if what == "vertex" else f"{what}s"
    return f"{several if len(ids) > 1 else what} {listed(ids)}"


def listed(names: Sequence[int | str], most: int = _NAMED) -> str:
    """List the first few numbers or names, and say how many others there are.

    >>> listed(["a", "b"]), listed(range(5), 3)
    ('a, b', '0, 1, 2 and 2 more')
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + more


def length(value: float, unit: str = "", digits: int = 3) -> str:
    """Format a measured length with some digits, and its unit if given.

    >>> length(20.0, "mm"), length(0.5), length(0.0123456), length(1234.5)
    ('20.0 mm', '0.500', '0.0123', '1230')
    """
    if value == 0 or not math.isfinite(value):
        text = f"{value:g}"
    elif not 1e-4 <= abs(value) < 1e6:
        text = f"{value:.{digits - 1}e}"
    else:
        rounded = float(f"{value:.{digits}g}")
        text = f"{rounded:.{max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)}f}"
    return f"{text} {unit}" if unit else text


def percent(value: float, digits: int = 3) -> str:
    """Format a measured ratio as a percentage with some digits.

    >>> percent(0.01741), percent(0.58), percent(1e-8)
    ('1.74 %', '58.0 %', '0 %')
    """
    shown = 100.0 * value
    return f"{length(shown if shown >= 1e-4 else 0.0, '', digits)} %"


def time_left(seconds: float, most: bool = False) -> str:
    """Say about how long, or with `most` at most how long, something goes on.

    >>> time_left(3.4), time_left(42.0), time_left(1500.0), time_left(9000.0, most=True)
    ('about 3 s left', 'about 40 s left', 'about 25 min left', 'at most 2.5 h left')
    """
    if seconds < 10.0:
        text = f"{seconds:.0f} s"
    elif seconds < 600.0:
        text = f"{5 * round(seconds / 5.0)} s"
    else:
        minutes = seconds / 60.0
        text = f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"
    return f"{'at most' if most else 'about'} {text} left"


def logged(callback: Callable[[str], None] | None) -> Callable[[str], None]:
    """Return a function that says what is being done: to a callback, and to the log "gso".

    >>> logged(print)("seams along edges")
    seams along edges
    """

    def say(text: str) -> None:
        _log.info(text)
        if callback is not None:
            callback(text)

    return say
