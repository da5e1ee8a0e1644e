"""Checks that are specific to a task."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from gso import metrics
from gso.verdict.asked import TARGET, TIGHT, Asked, asked_curvature
from gso.wording import length, percent, places, sentence

if TYPE_CHECKING:
    from gso.result import Result

#: Relative change of curvature or roughness from which on it counts as better or worse.
_SAME = 0.01
#: Strain from which on no pattern fits a face: it is squeezed to a line, doubled or inverted.
_WHOLE = 0.99
#: Strain of an exactly developable surface: rounding errors.
_EXACT = 1e-9
#: Distance from the design, relative to the diagonal of its bounding box, beyond which a result is
#: refused whatever limit was given. Displacement that constraints require is added.
_FAR = 0.5
#: The same for ruled surfaces, where more strips are the remedy.
_RULED = 0.1


def developable(result: Result, asked: Asked) -> Iterator[str]:
    """Check that curvature decreased, and that deviation and pattern strain are within limits.

    The measured values are stored in the result's details under "verdict".
    """
    design, mesh = result.design, result.mesh
    scale = metrics.unit(design)
    deviation = metrics.largest_distance(design, mesh)
    after = asked_curvature(mesh, scale=scale)
    strain = None
    found = {"deviation": deviation, **asked.limits}
    if result.pattern is not None:
        surface = result.pattern.surface(mesh)
        strains = np.nan_to_num(metrics.face_strains(surface, result.pattern.flat))
        strain = found["strain_max"] = float(strains.max())
    # Imported here, as it imports scipy.
    from gso.tasks.developable.options import DEVELOPABLE

    allowed = asked.max_strain
    if allowed is None and asked.max_deviation is not None:
        allowed = DEVELOPABLE
    if allowed is not None:
        found["allowed"] = allowed * (1.0 + TIGHT)
    result.details = {**result.details, "verdict": found}
    yield from _limits(design.diagonal, deviation, asked)
    if "allowed" in found:
        if strain is not None and not strain <= found["allowed"]:
            yield sentence(found)
        elif strain is None and asked.max_strain is not None:
            yield (
                "the largest strain is not known: the surface must be cut open before it can be "
                "laid out"
            )
    if strain is not None and strain >= _WHOLE:
        bad = np.flatnonzero(strains >= _WHOLE)
        yield (
            f"no pattern fits the surface: its lengths would change by {percent(strain)} at "
            f"{places('face', bad)}"
        )
    target = asked.target_curvature
    if target is not None and not after <= target * (1.0 + TARGET):
        yield f"mean |K| is {after:.3g}, above the target of {target:.3g}"
    # Imported here, as it imports scipy.
    from gso.tasks.developable import Options

    if asked.moved > 0 or after <= max(Options().developable_below, target or 0.0):
        return
    before = asked_curvature(design, scale=scale)
    if after > (1.0 + _SAME) * before:
        yield f"mean |K| is {after:.3g}, worse than the {before:.3g} of the input"
    elif after > (1.0 - _SAME) * before and not (strain is not None and strain <= DEVELOPABLE):
        yield f"nothing was done: mean |K| is {after:.3g}, as in the input"


def ruled(result: Result, asked: Asked) -> Iterator[str]:
    """Check that no rulings cross, and that the deviation is within its limit.

    The measured values are stored in the result's details under "verdict".
    """
    surface = result.ruled
    if surface is None:
        return
    far = surface.deviation or surface.distances(result.design)
    deviation = max(far.there_max, far.back_max)
    found = {"deviation": deviation, **asked.limits, "strain_max": 0.0}
    if result.pattern is not None:
        strains = metrics.face_strains(result.pattern.surface(result.mesh), result.pattern.flat)
        found["strain_max"] = float(np.nan_to_num(strains).max())
    if asked.max_strain is not None or asked.max_deviation is not None:
        found["allowed"] = asked.max_strain or _EXACT
    result.details = {**result.details, "verdict": found}
    if surface.crossed:
        yield f"{surface.crossed} pairs of successive rulings cross"
    yield from _limits(result.design.diagonal, deviation, asked, _RULED)


def _limits(diagonal: float, deviation: float, asked: Asked, far: float = _FAR) -> Iterator[str]:
    """Check the distance to the design, where no limit was given by a share of the diagonal."""
    most = asked.max_deviation
    # Far from the origin, distances are only known up to the rounding of the coordinates.
    if most is not None and deviation > most * (1.0 + TIGHT) + 1e-12 * diagonal:
        yield f"the result is {length(deviation)} away from the input, more than {most:g}"
    elif deviation > far * diagonal + asked.moved:
        share = percent(deviation / diagonal)
        yield f"the result is {length(deviation)} away from the input, {share} of its diagonal"


def denoise(result: Result, asked: Asked) -> Iterator[str]:
    """Check that the result is not rougher than the input."""
    ratio = metrics.fairness_ratio(result.design, result.mesh)
    if not asked.moved and ratio > 1.0 + _SAME:
        yield f"the result is {ratio:.3g} times as rough as the input"


#: Checks by task; other tasks only have the checks of surface and pattern.
TASKS: dict[str, Callable[[Result, Asked], Iterator[str]]] = {
    "developable": developable,
    "denoise": denoise,
}
