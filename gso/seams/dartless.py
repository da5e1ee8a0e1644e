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
from gso.seams.measured_search import improved
from gso.seams.options import PieceSettings
from gso.seams.straight import straight
from gso.seams.tree import Ground

#: Ratio of the estimated to the measured strain of a first attempt, and the share of the allowed
#: strain that is aimed at.
_RATIO, _AIM = 1.17, 0.985
#: Number of attempts, and of merged pieces that are measured in each.
_ATTEMPTS, _MEASURED = 4, 3
#: Number of results that hold the strain after which the best of them is taken.
_ENOUGH = 3


def dartless(ground: Ground, settings: PieceSettings) -> Candidate:
    """Merge patches in several ways, and improve the best result by what is measured.

    The bound of the estimate is adapted to what was measured.
    """
    best = _merged(ground, settings)
    better = improved(ground, best.pieces, settings)
    if better is not None:
        best = better
    holds = best.strain <= settings.max_strain and best.sound
    return straight(ground, best, settings) if holds else best


def _merged(ground: Ground, settings: PieceSettings) -> Candidate:
    """Merge patches in several ways; return the best result that holds the strain."""
    found: list[Candidate] = []
    ratio = _RATIO
    for attempt in range(_ATTEMPTS):
        settings.say(f"seams without darts, attempt {attempt + 1}")
        pool = without_darts(ground, ratio * settings.max_strain)
        strains = []
        for some in sorted(pool, key=lambda one: merged_value(one, settings))[:_MEASURED]:
            one = measured(ground, pieces_of(some), settings.max_size, settings.say)
            if settings.min_size is not None and one.strain <= settings.max_strain and one.sound:
                one = joined(ground, one, settings.max_strain, np.inf, settings, whole=True)
            found.append(one)
            strains.append(one.strain)
        good = [one for one in found if one.strain <= settings.max_strain and one.sound]
        if len(good) >= _ENOUGH or (good and attempt):
            break
        middle = float(np.median(strains))
        ratio *= float(np.clip(_AIM * settings.max_strain / max(middle, 1e-300), 0.5, 1.0))
        ratio *= 1.0 if len(good) else 0.98
    if good:
        return min(good, key=lambda one: ranked(one, settings))
    return min(found, key=lambda one: (not one.sound, one.strain))
