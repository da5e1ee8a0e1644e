"""Constraints from a JSON file."""

from __future__ import annotations

import json
from dataclasses import fields

from gso.constraints.base import Constraint
from gso.constraints.face_shape import FixedLengths, PlanarFaces
from gso.constraints.glue import Glue
from gso.constraints.on_curve import OnCurve, SlidingBoundary
from gso.constraints.positions import Fixed, FixedBoundary, Handle
from gso.constraints.ruling import Ruling
from gso.constraints.smooth import SmoothCurves
from gso.constraints.symmetry import SymmetryPlane
from gso.errors import OptionError
from gso.spelling import check_keywords, choices, nearest
from gso.typing import AnyPath

KINDS: dict[str, type[Constraint]] = {
    kind.__name__: kind
    for kind in (
        Fixed,
        FixedBoundary,
        FixedLengths,
        Glue,
        Handle,
        OnCurve,
        PlanarFaces,
        Ruling,
        SlidingBoundary,
        SmoothCurves,
        SymmetryPlane,
    )
}


def add(kind: type[Constraint]) -> None:
    """Register a constraint from outside the package, so that files can name it.

    Raises
    ------
    OptionError
        The name of the class is taken.
    """
    if kind.__name__ in KINDS:
        raise OptionError(f"{kind.__name__!r} is taken among the constraints; rename the class")
    KINDS[kind.__name__] = kind


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
    if not isinstance(entries, list):
        raise OptionError(f'{path} must hold a list, such as [{{"type": "FixedBoundary"}}]')
    return [_constraint(entry, f"{path}: entry {k}") for k, entry in enumerate(entries)]


def _constraint(entry: object, where: str) -> Constraint:
    if not isinstance(entry, dict) or not isinstance(entry.get("type"), str):
        # Name a field that looks like a misspelt "type".
        wrong = [repr(k) for k in entry if nearest(k, ["type"])] if isinstance(entry, dict) else []
        instead = f", not {wrong[0]}" if wrong else ""
        raise OptionError(f'{where} needs a "type"{instead}: {", ".join(KINDS)}')
    if entry["type"] not in KINDS:
        raise OptionError(
            f"{where}: there is no constraint {entry['type']!r}; {choices(entry['type'], KINDS)}"
        )
    kind = KINDS[entry["type"]]
    given = {name: value for name, value in entry.items() if name != "type"}
    known = [f.name for f in fields(kind)]  # type: ignore[arg-type]
    check_keywords(f"{where}: {kind.__name__}", given, known)
    try:
        return kind(**given)
    except TypeError as error:
        raise OptionError(f"{where}: {error}") from None
