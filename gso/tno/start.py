"""Starts that somebody else made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Start:
    """A start for :func:`gso.tno.optimize`, and what is to be thought of it.

    Attributes
    ----------
    points : Mesh, array or None
        As `x0`; None leaves it to the optimiser.
    source : str
        Where it is from, for the result's `warm_start`.
    guarded : bool
        It is dropped where its energy is above that of the start without it, where it turns
        cells over, or where it is not finite; the result is then the same as without it.
    iterations : int, optional
        Most iterations, over all stages.
    """

    points: Any
    source: str = "x0"
    guarded: bool = False
    iterations: int | None = None
