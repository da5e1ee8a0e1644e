"""Schedule of a run: phase, progress within the phase, and learning rate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from gso.net.training.config import Phase


class Place(NamedTuple):
    """Position in a run: number of the phase, phase, progress in it (0 to 1), learning rate."""

    number: int
    phase: Phase
    progress: float
    rate: float


def place(phases: Sequence[Phase], progress: float, warm_up: float = 0.01) -> Place:
    """Return the position in a run at a progress from 0 to 1.

    The learning rate rises from zero over the fraction `warm_up` of the run.

    >>> at = place([Phase(weights={"gc": 1.0}), Phase("energy", share=3.0, rate=0.5)], 0.25)
    >>> at.number, at.progress, at.rate
    (1, 0.0, 0.5)
    """
    total = sum(phase.share for phase in phases)
    begin = 0.0
    for number, phase in enumerate(phases):
        share = phase.share / total
        if progress < begin + share or number == len(phases) - 1:
            break
        begin += share
    within = min(max((progress - begin) / share, 0.0), 1.0)
    fall = 0.5 * (1.0 + math.cos(math.pi * within))
    rate = phase.final_rate + (phase.rate - phase.final_rate) * fall
    warm = min(1.0, (progress + 1e-4) / warm_up) if warm_up else 1.0
    return Place(number, phase, within, rate * warm)
