"""Warm starts with settings of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.errors import OptionError
from gso.typing import MeshLike


@dataclass(frozen=True)
class Start:
    """A warm start for :func:`gso.tno.optimize`, with settings on how it is used.

    Attributes
    ----------
    points : Mesh, array_like or None
        As `x0`; None for the optimiser's own start.
    source : str
        Origin of the start, reported as the result's `warm_start`.
    guarded : bool
        "developable", "flatten": drop the start if its energy is above that of the
        optimiser's own start, or if it has inverted cells in a flat image. The result is then
        the same as without it.
    iterations : int, optional
        Largest number of iterations over all stages. With `points`, they are reserved for the
        last stage first.
    tolerance : float
        With `points`, stages stop when an iteration lowers the energy by less than this share
        of it, or than the options' tolerance where that is larger.
    remaining : float
        With or without `points`, the last stage stops when all further iterations together would
        lower the energy by less than this share of it, as the last two decreases foretell, or after
        one iteration a third of its decrease. A solve that converges slowly goes on for longer than
        with a `tolerance` alone.
    resolution : int, optional
        With `points` of a grid: vertices along the longer side of the grid for which they were
        made. Finer grids start from the design, moved as the coarser ones were. By default
        `points` have details of their own on every grid.
    solved : bool
        Whether `points` are the result of a solve at that resolution: no coarser grid is solved.

    Raises
    ------
    OptionError
        `iterations` or `resolution` is not a whole number of 0 or more, or `tolerance` or
        `remaining` is negative or no number.

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

    points: MeshLike | None = None
    source: str = "x0"
    guarded: bool = False
    iterations: int | None = None
    tolerance: float = 0.0
    remaining: float = 0.0
    resolution: int | None = None
    solved: bool = False

    def __post_init__(self) -> None:
        for name in ("tolerance", "remaining"):
            value = getattr(self, name)
            if not (isinstance(value, int | float | np.number) and value >= 0):
                raise OptionError(f"{name} is {value!r}; take a number, 0 or more")
        for name in ("iterations", "resolution"):
            most = getattr(self, name)
            if most is None:
                continue
            if isinstance(most, bool) or not isinstance(most, int | np.integer) or most < 0:
                raise OptionError(
                    f"{name} is {most!r}; take a whole number from 0 up, or None for no limit"
                )
