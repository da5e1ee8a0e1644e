"""Notes on strips that can be made, but that a workshop should look at before."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso.result import Result, StripsResult
from gso.ruled.strip_metrics import smallest_part
from gso.typing import Array
from gso.verdict import Code
from gso.wording import length

#: Angle of a fold and of a crease, in degrees, that a note is made of.
_SHARP, _STEEP = 45.0, 90.0
#: Radius of a bend, relative to the design's size, and share of the area of a part, in %.
_TIGHT, _SMALL = 1e-3, 0.4


class Advice(NamedTuple):
    """The unit of lengths in notes, and what to do.

    Attributes
    ----------
    unit : str
        Name of the unit; empty for that of the design.
    gentle, tight, steep : str
        What to do about sharp folds, tight bends and steep creases.
    """

    unit: str = ""
    gentle: str = "more strips, or min_radius, bend it more gently"
    tight: str = "give min_radius if that cannot be bent"
    steep: str = "more strips, or max_crease, lower that"


_ADVICE = Advice()


def shop_notes(result: Result) -> tuple[str, ...]:
    """Return notes on pleats, sharp folds and creases, tight bends and small parts of strips.

    Nothing for designs that are kept as they are: their folds, bends and parts are meant.
    """
    if not isinstance(result, StripsResult) or result.ruled.strain is not None:
        return ()
    pleated = result.ruled.pleated and Code.PLEATED not in {why.code for why in result.reasons}
    rulings, steep = result.ruled.rulings, float(np.degrees(result.ruled.creases.largest_angle))
    small = smallest_part(result.ruled.pattern)
    notes = said(rulings.angles, rulings.radii, result.design.size, steep, small)
    if not pleated:
        return notes
    return (
        f"strips are pleated: their bends go up and down in turn by {result.ruled.pleat_max:.0f} "
        "degrees where the design does not; more strips lower that",
        *notes,
    )


def said(
    angles: Array,
    radii: Array,
    size: float,
    steep: float,
    small: float,
    advice: Advice = _ADVICE,
) -> tuple[str, ...]:
    """Say what is sharp, tight, steep or small.

    Parameters
    ----------
    angles, radii : ndarray, (b,)
        Angles of bends in radians, and their radii.
    size : float
        The design's size, in the unit of the radii.
    steep : float
        Largest angle between strips, in degrees.
    small : float
        Area of the smallest part, in % of all.
    advice : Advice, optional
    """
    notes = []
    sharp = np.degrees(np.abs(angles))
    if (folded := int((sharp > _SHARP).sum())) > 0:
        where = "one ruling" if folded == 1 else f"{folded} rulings, each on its own"
        notes.append(
            f"the surface folds by up to {sharp.max():.0f} degrees at {where}; {advice.gentle}"
        )
    tight = int((radii < _TIGHT * size).sum())
    if tight:
        bends = "one bend is" if tight == 1 else f"{tight} bends are"
        least = f"{length(float(radii.min()))} {advice.unit}".strip()
        notes.append(
            f"{bends} tighter than {100 * _TIGHT:g} % of the design's size, with radii from "
            f"{least}; {advice.tight}"
        )
    if steep > _STEEP:
        notes.append(f"strips meet at up to {steep:.0f} degrees; {advice.steep}")
    if small < _SMALL:
        notes.append(f"the smallest part has only {small:.2g} % of the area of all")
    return tuple(notes)
