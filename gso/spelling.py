"""Checks of option names: the error for a misspelt one suggests the closest known name."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any, ClassVar, TypeVar, cast

from gso.errors import OptionError

F = TypeVar("F", bound=Callable[..., Any])

_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def nearest(name: Any, known: Iterable[str]) -> str | None:
    """Find the known name most similar to a given one, ignoring case; None if none is close.

    >>> nearest("Flaten", ["bend", "denoise", "flatten"])
    'flatten'
    """
    from difflib import get_close_matches

    lower = {k.lower(): k for k in known}
    found = get_close_matches(str(name).lower(), lower, n=1)
    return lower[found[0]] if found else None


def choices(name: Any, known: Iterable[str]) -> str:
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


def known_keywords(*others: Callable[..., Any]) -> Callable[[F], F]:
    """Decorate a function so that unknown keywords raise :class:`gso.OptionError`.

    Keywords are checked against the signature before the call; the message suggests the
    closest one. ``help()`` and type checkers still see the original signature.

    Parameters
    ----------
    *others : callable
        Functions that the decorated one passes its ``**keywords`` to; their keywords are
        accepted too.

    Examples
    --------
    >>> @known_keywords()
    ... def cut(mesh, *, depth=1.0):
    ...     return depth
    >>> cut("panel", dept=2.0)
    Traceback (most recent call last):
    gso.errors.OptionError: cut takes no 'dept'; did you mean 'depth'? There are mesh, depth
    """

    def decorate(function: F) -> F:
        takers: list[Callable[..., Any]] = [function, *others]
        known = list(dict.fromkeys(name for taker in takers for name in _names(taker)))
        where = function.__qualname__.removesuffix(".__init__")

        @wraps(function)
        def checked(*positional: Any, **keywords: Any) -> Any:
            check_keywords(where, keywords, known)
            return function(*positional, **keywords)

        return cast(F, checked)

    return decorate


class _Signature:
    """Signature of the dataclass's ``__init__``, which ``__new__`` would hide from ``help()``."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        whole = inspect.signature(owner.__init__)  # type: ignore[misc]
        return whole.replace(parameters=list(whole.parameters.values())[1:])


class _CheckedFields(type):
    """Metaclass that checks field names before an object is made, and translates old ones."""

    def __call__(cls, *positional: Any, **given: Any) -> Any:
        renamed: dict[str, str] = getattr(cls, "RENAMED", {})
        for old in renamed.keys() & given.keys():
            _warn_of(old, renamed[old])
            given[renamed[old]] = given.pop(old)
        if given:
            check_keywords(cls.__qualname__, given, _names(cls.__init__)[1:])  # type: ignore[misc]
        return super().__call__(*positional, **given)


class KnownFields(metaclass=_CheckedFields):
    """Base class of dataclasses in which an unknown field name raises :class:`gso.OptionError`.

    Fields that were renamed are still accepted and readable by the old names in `RENAMED`, with
    a `DeprecationWarning`.

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

    #: New names of fields by their old ones.
    RENAMED: ClassVar[dict[str, str]] = {}

    __signature__ = _Signature()

    def __getattr__(self, name: str) -> Any:
        if name in type(self).RENAMED:
            _warn_of(name, type(self).RENAMED[name])
            return getattr(self, type(self).RENAMED[name])
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


def _warn_of(old: str, new: str) -> None:
    warnings.warn(f"{old!r} is now called {new!r}", DeprecationWarning, stacklevel=3)


def _names(function: Callable[..., Any]) -> list[str]:
    """List the parameters that can be passed by keyword."""
    parameters = inspect.signature(function).parameters.values()
    return [p.name for p in parameters if p.kind in _NAMED]
