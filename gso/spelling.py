"""Misspelt options: every message names the nearest option that there is."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any, TypeVar, cast

from gso.status import OptionError

F = TypeVar("F", bound=Callable[..., Any])

_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def nearest(name: Any, known: Iterable[str]) -> str | None:
    """The known name that is most like a given one, whatever its case; None if none is.

    >>> nearest("Flaten", ["bend", "denoise", "flatten"])
    'flatten'
    """
    from difflib import get_close_matches

    lower = {k.lower(): k for k in known}
    found = get_close_matches(str(name).lower(), lower, n=1)
    return lower[found[0]] if found else None


def choices(name: Any, known: Iterable[str]) -> str:
    """The part of a message that says what there is instead of an unknown name.

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
    """Refuse keywords that a call does not take.

    Raises
    ------
    OptionError
        Names the first such keyword, and the nearest one that there is.

    Examples
    --------
    >>> check_keywords("optimize", ["max_deviatoin"], ["task", "max_deviation"])
    Traceback (most recent call last):
    gso.status.OptionError: optimize takes no 'max_deviatoin'; did you mean 'max_deviation'?
    There are task, max_deviation
    """
    names = list(known)
    for name in given:
        if name not in names:
            raise OptionError(f"{where} takes no {name!r}; {choices(name, names)}")


def known_keywords(*others: Callable[..., Any]) -> Callable[[F], F]:
    """Decorator: a misspelt keyword is an :class:`gso.OptionError` that names the nearest one.

    The check is made before the call, by the signature, which stays as it is for ``help()``
    and type checkers.

    Parameters
    ----------
    *others : callable
        Functions that the decorated one hands its ``**keywords`` to: theirs are known too.

    Examples
    --------
    >>> @known_keywords()
    ... def cut(mesh, *, depth=1.0):
    ...     return depth
    >>> cut("panel", dept=2.0)
    Traceback (most recent call last):
    gso.status.OptionError: cut takes no 'dept'; did you mean 'depth'? There are mesh, depth
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
    """That of the dataclass's own ``__init__``, which ``__new__`` would hide from ``help()``."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        whole = inspect.signature(owner.__init__)  # type: ignore[misc]
        return whole.replace(parameters=list(whole.parameters.values())[1:])


class KnownFields:
    """Base of dataclasses: a misspelt field is an :class:`gso.OptionError`.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Blade(KnownFields):
    ...     width: float = 1.0
    >>> Blade(widht=2.0)
    Traceback (most recent call last):
    gso.status.OptionError: Blade takes no 'widht'; did you mean 'width'? There are width
    """

    __signature__ = _Signature()

    def __new__(cls, *positional: Any, **given: Any) -> Any:
        """Check the names of the fields; values are checked by the class itself."""
        if given:
            check_keywords(cls.__qualname__, given, _names(cls.__init__)[1:])
        return super().__new__(cls)


def _names(function: Callable[..., Any]) -> list[str]:
    """Parameters that can be given by name."""
    parameters = inspect.signature(function).parameters.values()
    return [p.name for p in parameters if p.kind in _NAMED]
