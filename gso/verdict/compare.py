"""The only place that compares what was measured with a limit, and makes reasons of it."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.typing import Array, Ints
from gso.verdict.codes import Code
from gso.verdict.reason import Places, Reason, ordered


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured number, or one for each of several places.

    Attributes
    ----------
    value : float or ndarray, (k,)
    kind : str
        Kind of the places, as in :class:`Places`.
    ids : sequence of int or str
        The place of each value; of a single value all places that it is measured at.
    slack : float
        Rounding error of the values.
    """

    value: float | Array
    kind: str = ""
    ids: Sequence[int | str] | Ints = ()
    slack: float = 0.0

    @classmethod
    def count(cls, kind: str, ids: Sequence[int | str] | Ints) -> Measurement:
        """Return the number of places at which something is wrong."""
        return cls(float(len(ids)), kind, ids)


def compare(
    measured: Mapping[Code, Measurement | float], limits: Mapping[Code, ArrayLike | None]
) -> tuple[Reason, ...]:
    """Return a reason for each code with values beyond their bound, the most severe first.

    Parameters
    ----------
    measured : mapping of Code to Measurement or float
    limits : mapping of Code to float, array_like (k,) or None
        The bounds, one for all or one for each place; ``info.limit`` of the code where there is
        none. A code without any bound is not checked.

    Returns
    -------
    tuple of Reason
        With the worst value, and all places that are beyond the bound, the worst first.

    Examples
    --------
    >>> widths = Measurement(np.array([3.0, 0.5, 0.1]), "piece", ("A", "B", "C"))
    >>> why = compare({Code.NECK: widths, Code.PIECES: 3.0}, {Code.NECK: 1.0, Code.PIECES: 5})
    >>> [(reason.code.name, reason.value, reason.bound, str(reason.places)) for reason in why]
    [('NECK', 0.1, 1.0, 'pieces C, B')]
    """
    out = []
    for code in Code:
        bound = limits.get(code)
        bound = code.info.limit if bound is None else bound
        if code in measured and bound is not None:
            found = measured[code]
            given = found if isinstance(found, Measurement) else Measurement(float(found))
            out += _beyond(code, given, bound)
    return tuple(out)


def _beyond(code: Code, found: Measurement, limit: ArrayLike) -> list[Reason]:
    info = code.info
    values, bounds = np.broadcast_arrays(np.atleast_1d(found.value), np.asarray(limit, float))
    over = (bounds - values) if info.least else (values - bounds)
    # Not a number is beyond every bound.
    bad = np.flatnonzero(~(over <= info.tolerance * np.abs(bounds) + found.slack))
    if not bad.size:
        return []
    bad = bad[np.argsort(-over[bad], kind="stable")]
    ids = found.ids
    if np.ndim(found.value) and len(ids):
        ids = [ids[k] for k in bad.tolist()]
    worst = bad[0]
    where = Places(found.kind, tuple(x if isinstance(x, str) else int(x) for x in ids))
    return [Reason(code, float(values[worst]), float(bounds[worst]), where)]


def failure(code: Code, detail: str = "") -> Reason:
    """Return a reason for which nothing is measured: a stop, or an error with its message."""
    return Reason(code, detail=detail)


def merge(
    earlier: Sequence[Reason], later: Sequence[Reason], decided: Container[Code] = ()
) -> tuple[Reason, ...]:
    """Merge the reasons of a solve with those of a later measurement of the same design.

    Each code counts once, as the solve has it; those in `decided` as they were measured later.
    """
    kept = [reason for reason in earlier if reason.code not in decided]
    known = {reason.code for reason in kept}
    return ordered([*kept, *(reason for reason in later if reason.code not in known)])
