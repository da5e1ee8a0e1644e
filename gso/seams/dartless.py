"""The search for pieces without darts, of a shape that does not change."""

from __future__ import annotations

import numpy as np

from gso.seams.candidates import (
    Candidate,
    joined,
    measured,
    merged_value,
    pieces_of,
    ranked,
    without_darts,
)
from gso.seams.options import Wishes
from gso.seams.straight import straight
from gso.seams.tree import Ground

#: Ratio of the estimated to the measured strain of a first attempt, and the share of the allowed
#: strain that is aimed at.
_RATIO, _AIM = 1.17, 0.985
#: Number of attempts, and of merged pieces that are measured in each.
_ATTEMPTS, _MEASURED = 4, 3
#: Number of results that hold the strain after which the best of them is taken.
_ENOUGH = 3


def dartless(ground: Ground, wishes: Wishes) -> Candidate:
    """Merge patches in several ways, and take the best result that holds the strain.

    The bound of the estimate is adapted to what was measured.
    """
    found: list[Candidate] = []
    ratio = _RATIO
    for attempt in range(_ATTEMPTS):
        wishes.say(f"seams without darts, attempt {attempt + 1}")
        pool = without_darts(ground, ratio * wishes.max_strain)
        strains = []
        for some in sorted(pool, key=lambda one: merged_value(one, wishes))[:_MEASURED]:
            one = measured(ground, pieces_of(some), wishes.max_size, wishes.say)
            if one.strain <= wishes.max_strain and one.sound:
                one = _finished(ground, one, wishes)
            found.append(one)
            strains.append(one.strain)
        good = [one for one in found if one.strain <= wishes.max_strain and one.sound]
        if len(good) >= _ENOUGH or (good and attempt):
            return min(good, key=lambda one: ranked(one, wishes))
        middle = float(np.median(strains))
        ratio *= float(np.clip(_AIM * wishes.max_strain / max(middle, 1e-300), 0.5, 1.0))
        ratio *= 1.0 if len(good) else 0.98
    if good:
        return min(good, key=lambda one: ranked(one, wishes))
    return min(found, key=lambda one: (not one.sound, one.strain))


def _finished(ground: Ground, found: Candidate, wishes: Wishes) -> Candidate:
    """Join pieces that are too short to a neighbour, and straighten seams."""
    if wishes.min_size is not None:
        found = joined(ground, found, wishes.max_strain, np.inf, wishes, whole=True)
    return straight(ground, found, wishes)
