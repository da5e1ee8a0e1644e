"""Status of a solve, and progress reports."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field


class Status(enum.Enum):
    """Why a solve ended; the value is the message shown to the user."""

    CONVERGED = "converged: the energy no longer falls"
    ALREADY_GOOD = "the input already meets the tolerance and comes back untouched"
    TARGET_REACHED = "the target was reached"
    TARGET_MISSED = "the target could not be reached; the closest result is returned"
    CONSTRAINTS_MISSED = "not all constraints could be met; the notes name those that are not"
    MAX_ITERATIONS = "done: all iterations that the options allow were used"
    STALLED = "stopped: no step lowers the energy any further"
    CANCELLED = "stopped by the callback; the best iterate so far is returned"
    UNUSABLE = "not usable as what was asked for; the reasons say why and where"

    @property
    def converged(self) -> bool:
        """Whether the solve converged, reached its target, or had nothing to do."""
        return self in (Status.CONVERGED, Status.ALREADY_GOOD, Status.TARGET_REACHED)

    @property
    def is_failure(self) -> bool:
        """Whether the status alone makes the result unusable."""
        return self in (Status.CANCELLED, Status.TARGET_MISSED, Status.CONSTRAINTS_MISSED)

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True)
class Progress:
    """State of the solve that a callback gets after each iteration, iterate 0 included.

    Attributes
    ----------
    stage : int
        Index of the stage of a coarse-to-fine solve.
    stages : int
        Number of stages.
    iteration : int
        Iteration within the stage; 0 is the stage's start.
    iterations : int
        Largest number of iterations of the stage.
    energy : float
        Objective value (dimensionless).
    by_term : dict of str to float
        The objective by term; the values sum to `energy`.
    step : float
        Accepted step length, as a fraction of the full step.
    name : str
        Name of the stage: its grid, or its unknowns.
    """

    stage: int
    stages: int
    iteration: int
    iterations: int
    energy: float
    by_term: dict[str, float] = field(default_factory=dict)
    step: float = 1.0
    name: str = ""
