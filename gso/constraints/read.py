"""Constraints from a JSON file."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

import numpy as np

from gso.constraints.base import Constraint
from gso.errors import OptionError
from gso.spelling import check_keywords, choices, nearest
from gso.typing import AnyPath, Json

#: Constraints from outside the package.
_ADDED: list[type[Constraint]] = []


def kinds() -> dict[str, type[Constraint]]:
    """Return the constraints of this package and those that were added, by name."""
    here = __name__.rpartition(".")[0]
    own = [kind for kind in Constraint.__subclasses__() if kind.__module__.startswith(f"{here}.")]
    return {kind.__name__: kind for kind in sorted([*own, *_ADDED], key=lambda k: k.__name__)}


def add(kind: type[Constraint]) -> None:
    """Register a constraint from outside the package, so that files can name it.

    Raises
    ------
    OptionError
        The name of the class is taken.
    """
    if kind.__name__ in kinds():
        raise OptionError(f"{kind.__name__!r} is taken among the constraints; rename the class")
    _ADDED.append(kind)


def record_of(constraint: Constraint) -> Json:
    """Return a constraint as an entry of such a file.

    >>> from gso.constraints import Handle
    >>> record_of(Handle([0], np.zeros((1, 3)), weight=2.0))
    {'type': 'Handle', 'ids': [0], 'positions': [[0.0, 0.0, 0.0]], 'weight': 2.0}
    """
    named = {f.name: getattr(constraint, f.name) for f in fields(constraint)}  # type: ignore[arg-type]
    return {"type": type(constraint).__name__, **{k: _plain(v) for k, v in named.items()}}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def read_constraints(path: AnyPath) -> list[Constraint]:
    """Read a list of constraints.

    Parameters
    ----------
    path : path
        JSON: a list of objects, each with the ``type`` of a constraint, such as
        ``{"type": "Handle", "ids": [0], "positions": [[0, 0, 1]]}``, and its parameters.

    Raises
    ------
    OptionError
        The file cannot be read, or an entry is no constraint.
    """
    try:
        with open(path, encoding="utf-8") as file:
            entries = json.load(file)
    except OSError as error:
        raise OptionError(f"{path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise OptionError(f"{path} is no JSON: {error}") from None
    return from_records(entries, str(path))


def from_records(entries: object, where: str = "constraints") -> list[Constraint]:
    """Return the constraints that a list of records describes, such as those of a file.

    Parameters
    ----------
    entries : list of dict
        As :func:`record_of` returns them.
    where : str
        What messages call the list.

    Raises
    ------
    OptionError
        It is no list, or an entry is no constraint.

    Examples
    --------
    >>> from_records([{"type": "FixedBoundary"}])
    [FixedBoundary()]
    """
    if not isinstance(entries, list):
        raise OptionError(f'{where} must hold a list, such as [{{"type": "FixedBoundary"}}]')
    return [_constraint(entry, f"{where}: entry {k}") for k, entry in enumerate(entries)]


def _constraint(entry: object, where: str) -> Constraint:
    there = kinds()
    if not isinstance(entry, dict) or not isinstance(entry.get("type"), str):
        # Name a field that looks like a misspelt "type".
        wrong = [repr(k) for k in entry if nearest(k, ["type"])] if isinstance(entry, dict) else []
        instead = f", not {wrong[0]}" if wrong else ""
        raise OptionError(f'{where} needs a "type"{instead}: {", ".join(there)}')
    if entry["type"] not in there:
        raise OptionError(
            f"{where}: there is no constraint {entry['type']!r}; {choices(entry['type'], there)}"
        )
    kind = there[entry["type"]]
    given = {name: value for name, value in entry.items() if name != "type"}
    known = [f.name for f in fields(kind)]  # type: ignore[arg-type]
    check_keywords(f"{where}: {kind.__name__}", given, known)
    try:
        return kind(**given)
    except TypeError as error:
        raise OptionError(f"{where}: {error}") from None
