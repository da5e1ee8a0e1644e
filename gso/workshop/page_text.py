"""Words, numbers and addresses of the page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from gso.typing import Json
from gso.workshop.part import Part
from gso.workshop.writers import strokes

#: Least number but 0 that is written.
_LEAST = 0.001
_UNITS = {"mm2": "mm²", "mm": "mm"}


def mm(value: float | None) -> str:
    """Return a length in millimetres that the page can show in inches, too.

    >>> mm(12.345), mm(None)
    ('<span data-mm="12.345">12.3</span>', '-')
    """
    return "-" if value is None else f'<span data-mm="{value:.7g}">{value:.1f}</span>'


def mm2(value: float) -> str:
    """Return an area in square millimetres that the page can show in square inches, too."""
    return f'<span data-mm2="{value:.7g}">{value:.0f}</span>'


def number(value: float | None) -> str:
    """Return a number with three digits.

    >>> number(12.345), number(1e-9), number(None)
    ('12.3', '&lt; 0.001', '-')
    """
    if value is None:
        return "-"
    return f"{value:.3g}" if value >= _LEAST or value == 0.0 else f"&lt; {_LEAST:g}"


def small_mm(value: float | None) -> str:
    """Return a small length in millimetres, such as a distance, with three digits."""
    if value is None:
        return "-"
    return f'<span data-mm="{value:.7g}" data-digits="3">{number(value)}</span>'


def head(words: str) -> str:
    """Return the heading of a column; a unit at its end changes with the unit of the page.

    >>> head("length mm")
    'length <span data-unit="mm">mm</span>'
    """
    name, _, unit = words.rpartition(" ")
    if name and unit in _UNITS:
        return f'{escape(name)} <span data-unit="{unit}">{_UNITS[unit]}</span>'
    return escape(words)


def guided(part: Part) -> str:
    """Say how straight the guide lines of a part are; empty without any."""
    if not part.guides:
        return ""
    angle = np.degrees(max(guide.angle for guide in part.guides))
    return f"; no bends, guide lines up to {angle:.2g} degrees from straight"


def drawn_as(certificate: Json) -> dict[str, str]:
    """Return for the name of each panel that of the part that it is drawn as."""
    return {
        entry["name"]: entry["same_as"] or entry["name"]
        for record in certificate["designs"]
        for entry in record.get("parts", ())
    }


def addresses(certificate: Json, parts: Sequence[Part]) -> Callable[[str], str]:
    """Return a function that gives the place on the page of the part that a panel is made as.

    It is empty for what is no panel.
    """
    names = [part.name for part in parts]
    own = dict(zip(names, strokes.identifiers(parts), strict=True))
    every = {name: f"#part-{own[same]}" for name, same in drawn_as(certificate).items()}
    return lambda name: every.get(name, "")
