"""What is asked of strips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from gso.constraints import Constraint
from gso.ruled.paneling.along import Along
from gso.ruled.paneling.options import Options
from gso.seams.options import CHANGES
from gso.seams.seam_request import SeamRequest
from gso.solver import Callback
from gso.solver.minimiser import says_no
from gso.status import Progress
from gso.tasks import Limits
from gso.tasks.start import Start
from gso.typing import Ints


def _no_edges() -> Ints:
    return np.empty((0, 2), np.int64)


def silent(said: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class StripsRequest:
    """What is asked of strips, in the design's unit.

    Attributes
    ----------
    options : Options
    limits : Limits
        The strain is that of pieces that no strips follow.
    sheet : (float, float) or None
        Length and width of a sheet that every part must fit on.
    kept : ndarray of int, (k, 2)
        Edges of the design that are cut in any case.
    constraints : sequence of Constraint
    start : Start
    along : Along or None
        What strips are to run along.
    seams : SeamRequest
        What is asked of the seams of pieces.
    verdict : bool
        Whether to judge the result.
    as_it_is : bool
        Whether a design that is developable as it is may be kept.
    workers : int or None
        Number of processes for the pieces of a design; None for one for each processor.
    callback : callable or None
        Called after every iteration.
    say : callable
        Called with what is being done, in words.
    """

    options: Options
    limits: Limits = field(default_factory=Limits)
    sheet: tuple[float, float] | None = None
    kept: Ints = field(default_factory=_no_edges)
    constraints: Sequence[Constraint] = ()
    start: Start = field(default_factory=Start)
    along: Along | None = None
    seams: SeamRequest = field(default_factory=SeamRequest)
    verdict: bool = True
    as_it_is: bool = True
    workers: int | None = 0
    callback: Callback | None = None
    say: Callable[[str], None] = silent

    @property
    def max_deviation(self) -> float | None:
        """Largest distance from the design, both ways."""
        return self.limits.max_deviation

    @property
    def is_counted(self) -> bool:
        """Whether as few strips are looked for as hold a bound."""
        options = self.options
        bounded = self.max_deviation is not None or options.max_crease is not None
        return bounded and options.number is None

    @property
    def max_strain(self) -> float:
        """Largest strain of pieces that no strips follow, which keep their joint pattern."""
        given = self.limits.max_strain
        return CHANGES if given is None else given

    def goes_on(self, progress: Progress) -> bool:
        """Tell the callback about progress, and return whether it does not end the solve."""
        return self.callback is None or not says_no(self.callback(progress))

    @property
    def may_be_cut(self) -> bool:
        """Whether a design may be cut into pieces that are to be found."""
        named = self.options.number is not None or self.constraints or self.along is not None
        return self.max_deviation is not None and not named

    @property
    def may_leave_pieces(self) -> bool:
        """Whether pieces that no strips follow may keep the pattern of the joint solve."""
        return self.options.number is None and self.max_deviation is not None

    @property
    def may_keep_design(self) -> bool:
        """Whether nothing is asked for that a design which is developable as it is may not have."""
        options = self.options
        named = options.number is not None or options.max_crease is not None
        named = named or self.along is not None
        return self.as_it_is and not (named or self.constraints or self.start.points is not None)

    @property
    def names_vertices(self) -> bool:
        """Whether it refers to vertices of the design."""
        named = len(self.kept) or self.constraints or self.seams.preferences
        return bool(named or self.start.points is not None)


def own_names(preferences: Sequence[str]) -> list[str]:
    """Return the names that preferences of the search for pieces have here."""
    return ["seams_along" if name == "along" else name for name in preferences]
