"""Starts that somebody else made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gso.status import OptionError


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
        "developable", "flatten": it is dropped where its energy is above that of the start
        without it, or where it turns cells of a flat image over; the result is then the
        same as without it.
    iterations : int, optional
        Most iterations, over all stages; those of `points` go to the last stage first.
    tolerance : float
        Stop the stages that begin from `points` when an iteration lowers the energy by less
        than this share of it, where the options' own is smaller.

    Raises
    ------
    OptionError
        `iterations` is no number of iterations, or `tolerance` is negative or no number.

    Examples
    --------
    >>> import gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> saddle = np.stack([u, v, 0.3 * u * v], axis=-1)
    >>> guess = Start(2 * saddle, source="guess", guarded=True, iterations=5)
    >>> result = gso.tno.optimize(saddle, x0=guess)
    >>> result.warm_start, result.iterations <= 5
    ('cold', True)
    """

    points: Any
    source: str = "x0"
    guarded: bool = False
    iterations: int | None = None
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not (isinstance(self.tolerance, int | float | np.number) and self.tolerance >= 0):
            raise OptionError(f"tolerance is {self.tolerance!r}; take a number, 0 or more")
        most = self.iterations
        if most is None:
            return
        if isinstance(most, bool) or not isinstance(most, int | np.integer) or most < 0:
            raise OptionError(
                f"iterations is {most!r}; take a whole number from 0 up, or None for no limit"
            )
