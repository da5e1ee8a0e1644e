"""Checks of the terms that users write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gso.energy import Term, Weighted
from gso.errors import OptionError


def check_own_term(item: Weighted, rows: Mapping[str, int]) -> None:
    """Raise an error unless a weighted term fits the coordinates.

    Its residual is not evaluated; the solver does that.

    Parameters
    ----------
    item : Weighted
    rows : mapping of str to int
        Number of rows of each block of coordinates.

    Raises
    ------
    OptionError
        What is wrong with the term's weight or arrays, and what they must be.

    Examples
    --------
    >>> rise = Term("rise", lambda points, _: (points[0][2],), (("surface", [[7]]),), [1.0])
    >>> check_own_term(Weighted(rise, 0.1), {"surface": 4})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    gso.errors.OptionError: terms: 'rise' names row 7 of 'surface', which has 4 rows; choose ...
    """
    term, weight = item.term, item.weight
    if not isinstance(term, Term):
        raise OptionError(f"terms: {kind(term)} is no gso.energy.Term")
    said = f"terms: {term.name!r}"
    number = isinstance(weight, int | float | np.number) and not isinstance(weight, bool)
    if not (number and 0.0 <= weight < np.inf):
        raise OptionError(f"{said} has the weight {weight!r}; it must be a number of 0 or more")
    weights = _numbers(term.weights, f"{said}: weights")
    if weights.ndim != 1 or not (np.isfinite(weights) & (weights >= 0.0)).all():
        raise OptionError(
            f"{said}: weights must be finite numbers of 0 or more, (e,), one for each element; "
            f"their shape is {weights.shape}"
        )
    count = len(weights)
    constants = _numbers(term.constants, f"{said}: constants")
    if constants.size and (constants.ndim != 2 or constants.shape[1] != count):
        raise OptionError(
            f"{said}: constants have the shape {constants.shape}; it must be (c, {count}), a "
            "column for each element"
        )
    if not np.isfinite(constants).all():
        raise OptionError(f"{said}: constants must be finite")
    for block, index in term.stencil:
        _check_rows(said, block, _numbers(index, f"{said}: stencil"), count, rows)


def _check_rows(said: str, block: str, index: Any, count: int, rows: Mapping[str, int]) -> None:
    if block not in rows:
        known = ", ".join(repr(name) for name in rows)
        raise OptionError(f"{said}: there is no block {block!r} in this task; there is {known}")
    if index.ndim != 2 or len(index) != count or index.dtype.kind not in "iu":
        raise OptionError(
            f"{said}: the rows of {block!r} have the shape {index.shape} and the type "
            f"{index.dtype}; they must be whole numbers, ({count}, k), k for each element"
        )
    wrong = index[(index < 0) | (index >= rows[block])]
    if wrong.size:
        raise OptionError(
            f"{said} names row {int(wrong[0])} of {block!r}, which has {rows[block]} rows; choose "
            "rows by the mesh that is given, which may be a coarser copy of the design"
        )


def _numbers(values: Any, said: str) -> Any:
    try:
        found = np.asarray(values)
    except ValueError:
        found = np.empty(0, object)
    if found.dtype.kind not in "iufb":
        raise OptionError(f"{said} must be an array of numbers")
    return found


def kind(value: object) -> str:
    """Name a value by its type where it is no number or text, whose words would be long."""
    short = isinstance(value, int | float | str | type(None))
    return repr(value) if short else f"an object of {type(value).__name__}"
