"""Bounds on the joint solve of a design in pieces, by the weights of its energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.errors import OptionError
from gso.pipeline import strains_of
from gso.result import Result
from gso.status import Status
from gso.tasks import Options as BaseOptions

if TYPE_CHECKING:
    from gso.tasks.developable import Options

#: Factor between the weights that are tried, number of them in each direction, and number of
#: bisections after that.
_STEP, _STEPS, _BISECTIONS = 4.0, 3, 4


def within(
    pieces: Pieces, allowed: float, options: BaseOptions, solve: Callable[[Options], Result]
) -> Result:
    """Return the most developable result within a distance of the design.

    The weight of the curvature relative to that of the distance is as large as the bound allows,
    and not larger than it takes for patterns without strain.

    Parameters
    ----------
    pieces : Pieces
    allowed : float
        Largest distance, in both directions, in the design's unit.
    options : Options
    solve : callable
        Solves the pieces with given options.

    Returns
    -------
    Result
        The one with the least weight if none is within the distance.
    """
    # Imported here because it imports SciPy.
    from gso.tasks.developable import Options
    from gso.tasks.developable.options import DEVELOPABLE

    if not isinstance(options, Options):
        raise OptionError(
            "max_deviation of a design in pieces goes with the formulation 'curvature', or with "
            "gso.strips"
        )
    tried: dict[float, Result] = {}

    def good(power: float) -> bool:
        factor = _STEP ** abs(power)
        if power > 0:
            changed = replace(options, w_curvature=factor * options.w_curvature)
        else:
            # Less weight on the curvature alone would leave the fairness, which moves bends too.
            changed = replace(options, w_proximity=factor * options.w_proximity)
        tried[power] = solve(changed)
        return deviation(pieces, tried[power]) <= allowed

    def done(power: float) -> bool:
        stopped = tried[power].status is Status.CANCELLED
        return stopped or strains_of(tried[power].mesh).get("strain_max", np.inf) <= DEVELOPABLE

    low, high = 0.0, 0.0
    if good(0.0):
        while high < _STEPS and not done(high):
            low, high = high, high + 1.0
            if not good(high):
                break
        else:
            return tried[high]
    else:
        while low > -2 * _STEPS and tried[low].status is not Status.CANCELLED:
            low, high = low - 1.0, low
            if good(low):
                break
        else:
            return tried[low]
    for _ in range(_BISECTIONS):
        if done(low):
            break
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return tried[low]


def deviation(pieces: Pieces, result: Result) -> float:
    """Return the largest distance between the design and a result, in both directions."""
    shape = pieces if result.pieces is None else result.pieces
    return metrics.largest_distance(pieces.design, shape.design)
