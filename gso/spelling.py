"""Checks of option names: the error for a misspelt one suggests the closest known name."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import TypeVar

from gso.errors import OptionError

K = TypeVar("K", bound="KnownFields")


def nearest(name: object, known: Iterable[str]) -> str | None:
    """Find the known name most similar to a given one, ignoring case; None if none is close.

    >>> nearest("Flaten", ["bend", "denoise", "flatten"])
    'flatten'
    """
    from difflib import get_close_matches

    lower = {k.lower(): k for k in known}
    found = get_close_matches(str(name).lower(), lower, n=1)
    return lower[found[0]] if found else None


def choices(name: object, known: Iterable[str]) -> str:
    """Format the part of a message that lists the known names, after an unknown one.

    >>> choices("blanced", ["fast", "balanced"])
    "did you mean 'balanced'? There are fast, balanced"
    >>> choices("thorough", ["fast", "balanced"])
    'there are fast, balanced'
    """
    names = list(known)
    close = nearest(name, names)
    there = f"here are {', '.join(names) or 'none'}"
    return f"t{there}" if close is None else f"did you mean {close!r}? T{there}"


def check_keywords(where: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse keywords that a call does not accept.

    Raises
    ------
    OptionError
        A keyword is unknown. The message names the first such keyword and the closest known
        one.

    Examples
    --------
    >>> check_keywords("optimize", ["max_deviatoin"], ["task", "max_deviation"])
    Traceback (most recent call last):
    gso.errors.OptionError: optimize takes no 'max_deviatoin'; did you mean 'max_deviation'?
    There are task, max_deviation
    """
    names = list(known)
    for name in given:
        if name not in names:
            raise OptionError(f"{where} takes no {name!r}; {choices(name, names)}")


class _Signature:
    """Signature of the dataclass's ``__init__``, which ``__new__`` would hide from ``help()``."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        whole = inspect.signature(owner.__init__)  # type: ignore[misc]
        return whole.replace(parameters=list(whole.parameters.values())[1:])


class KnownFields:
    """Base class of dataclasses in which an unknown field name raises :class:`gso.OptionError`.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Blade(KnownFields):
    ...     width: float = 1.0
    >>> Blade(widht=2.0)
    Traceback (most recent call last):
    gso.errors.OptionError: Blade takes no 'widht'; did you mean 'width'? There are width
    """

    __signature__ = _Signature()

    def __new__(cls: type[K], *positional: object, **given: object) -> K:
        """Check the names before the object is made."""
        if given:
            check_keywords(cls.__qualname__, given, inspect.signature(cls).parameters)
        return super().__new__(cls)
