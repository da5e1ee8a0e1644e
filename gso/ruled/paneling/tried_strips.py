"""Strips that were made in one way, and whether they are what was asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.result import Result
from gso.status import Status
from gso.verdict import Code, Reason

#: Distance relative to the diagonal at which strips need not be nearer.
_CLOSE = 1e-4
#: How many strips that are cut along creases count as one that runs across creases, and is folded
#: there.
FOLDED = 2


@dataclass(frozen=True)
class Tried:
    """A result, the reasons against it, and what it was before it was divided for a sheet.

    `creased` says that it is cut along the creases of the design, so that no strip is folded there.
    """

    result: Result
    reasons: tuple[Reason, ...]
    undivided: Result | None = None
    creased: bool = False

    @property
    def wide(self) -> Result:
        """The strips before they were made narrower and divided for the sheet."""
        return self.result if self.undivided is None else self.undivided

    @property
    def ended(self) -> bool:
        """Whether the callback ended the solve."""
        return self.result.status is Status.CANCELLED

    @property
    def holds(self) -> bool:
        """Whether it is what was asked for."""
        return not (self.reasons or self.result.status.is_failure)

    def order(self, *, few: bool) -> tuple[bool, bool, float, float]:
        """Sort key: what was asked for first, then what is neither folded nor crosses itself.

        Fewer strips before more if asked, then distances.
        """
        surface, count = self.result.ruled, 0.0
        if few and self.holds:
            count = self.count
        broken = not self.holds and (surface is None or not surface.sound)
        return not self.holds, broken, count, self.far

    @property
    def strips(self) -> int:
        """Number of strips."""
        surface = self.result.ruled
        return 0 if surface is None else surface.strips

    @property
    def count(self) -> float:
        """Number of strips, as it is compared with those that run across creases."""
        return self.strips / (FOLDED if self.creased else 1)

    @property
    def fewer(self) -> int:
        """The number of strips that others across the creases may have to be better."""
        return self.strips // FOLDED if self.creased else self.strips - 1

    @property
    def is_close(self) -> bool:
        """Whether it is so close to the design that nothing nearer is looked for."""
        return self.holds and self.far <= _CLOSE * self.result.design.diagonal

    @property
    def is_near(self) -> bool:
        """Whether only the sheet is too small for its parts, so that these are to be divided."""
        small = {Code.TOO_LONG, Code.TOO_WIDE}
        return {why.code for why in self.reasons} <= small

    @property
    def far(self) -> float:
        """The largest distance from the design; infinite without strips."""
        surface = self.result.ruled
        return np.inf if surface is None else surface.farthest
