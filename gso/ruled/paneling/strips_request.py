"""What was asked of strips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from gso.constraints import Constraint
from gso.errors import OptionError
from gso.pipeline.start import Start
from gso.ruled.paneling.options import Options
from gso.solver import Callback
from gso.typing import Ints


def _no_edges() -> Ints:
    return np.empty((0, 2), np.int64)


def silent(said: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class Request:
    """What was asked of strips, in the design's unit.

    Attributes
    ----------
    options : Options
    max_deviation : float or None
        Largest distance from the design, both ways.
    max_strain : float
        Largest strain of pieces that no strips follow, which keep the pattern of the joint solve.
    sheet : (float, float) or None
        Length and width of a sheet that every part must fit on.
    kept : ndarray of int, (k, 2)
        Edges of the design that are cut in any case.
    constraints : sequence of Constraint
    start : Start
    verdict : bool
        Whether to judge the result.
    workers : int or None
        Number of processes for the pieces of a design; None for one for each processor.
    callback : callable or None
        Called after every iteration.
    say : callable
        Called with what is being done, in words.
    """

    options: Options
    max_deviation: float | None = None
    max_strain: float = 1e-3
    sheet: tuple[float, float] | None = None
    kept: Ints = field(default_factory=_no_edges)
    constraints: Sequence[Constraint] = ()
    start: Start = field(default_factory=lambda: Start(None))
    verdict: bool = True
    workers: int | None = 0
    callback: Callback | None = None
    say: Callable[[str], None] = silent

    @property
    def names_vertices(self) -> bool:
        """Whether it refers to vertices of the design."""
        return bool(len(self.kept) or self.constraints or self.start.points is not None)

    def __post_init__(self) -> None:
        for name in ("max_deviation", "max_strain"):
            value = getattr(self, name)
            good = isinstance(value, int | float | np.number) and 0 < value < np.inf
            if value is not None and (isinstance(value, bool) or not good):
                raise OptionError(f"{name} is {value!r}; it must be a positive number")
