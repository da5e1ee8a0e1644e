"""Names of designs and parts that can be names of files, all different."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable


def spelled(name: str) -> str:
    """Return a name that can be part of a file's name.

    >>> spelled("left wing/2"), spelled("..")
    ('left_wing_2', 'design')
    """
    whole = unicodedata.normalize("NFC", name)
    kept = "".join(c if c.isalnum() or c in "-_." else "_" for c in whole)
    return kept.strip(".") or "design"


def different(names: Iterable[str]) -> list[str]:
    """Number names that occur again; those that differ in case only count as the same.

    >>> different(["a", "A", "a-2"])
    ['a', 'A-2', 'a-2-2']
    """
    taken: set[str] = set()
    out = []
    for base in names:
        name, number = base, 2
        while name.casefold() in taken:
            name, number = f"{base}-{number}", number + 1
        taken.add(name.casefold())
        out.append(name)
    return out
