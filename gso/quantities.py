"""Lengths and strains as users write them: ``5``, ``"5mm"``, ``"0.5%"``; ``0.01``, ``"1%"``."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from numbers import Real
from typing import TypeAlias

from gso.errors import OptionError
from gso.spelling import choices

#: Units of length, in millimetres.
MILLIMETRES = {
    "mm": 1.0,
    "um": 1e-3,
    "cm": 10.0,
    "dm": 100.0,
    "m": 1000.0,
    "in": 25.4,
    "ft": 304.8,
    "yd": 914.4,
}

#: A length: a number in the mesh's unit, or a text such as "5", "5mm" or "0.5%".
Length: TypeAlias = "float | str"
#: A strain: a ratio such as 0.01, or a text such as "0.01" or "1%".
Strain: TypeAlias = "float | str"

#: Diagonals in millimetres beyond which a design is likely to have another unit: hardly anything is
#: folded that is as small as a nail, or as large as a stadium.
_TINY, _HUGE = 15.0, 5e5
#: Share of the diagonal from which on a distance is large.
_LARGE = 0.2
_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([a-z%]*)\s*", re.I)


def as_length(value: Length, name: str, *, diagonal: float, unit: str = "mm") -> float:
    """Return a positive length in the unit of a mesh.

    Parameters
    ----------
    value : float or str
        A number is in the mesh's unit. A text may have a unit, or a per cent sign: then it is
        a share of the diagonal of the mesh's bounding box.
    name : str
        The option, for errors.
    diagonal : float
        Diagonal of the bounding box, in the mesh's unit.
    unit : str
        Unit of the mesh's coordinates.

    Raises
    ------
    OptionError
        The value is no positive length, or its unit is not known.

    Examples
    --------
    >>> as_length(5, "max_deviation", diagonal=200.0)
    5.0
    >>> as_length("5mm", "max_deviation", diagonal=2.0, unit="m")
    0.005
    >>> as_length("0.5%", "max_deviation", diagonal=200.0)
    1.0
    """
    number, sign = _split(value)
    if sign == "%":
        number *= 0.01 * diagonal
    elif sign:
        number *= millimetres(sign, name) / millimetres(unit)
    if not 0.0 < number < math.inf:
        raise OptionError(
            f"{name} is {value!r}; it must be a positive length, such as 5, '5mm' or '0.5%' (of "
            "the diagonal)"
        )
    return number


def as_strain(value: Strain, name: str) -> float:
    """Return a positive strain as a ratio.

    Raises
    ------
    OptionError
        The value is no positive ratio.

    Examples
    --------
    >>> as_strain("1%", "max_strain"), as_strain(0.01, "max_strain")
    (0.01, 0.01)
    """
    number, sign = _split(value)
    if sign == "%":
        number *= 0.01
    if sign not in ("", "%") or not 0.0 < number < math.inf:
        raise OptionError(f"{name} is {value!r}; it must be a positive ratio, such as 0.01 or '1%'")
    return number


def as_positive(value: object, name: str, *, zero: bool = False) -> float:
    """Return a finite number above zero, or of zero or more.

    Raises
    ------
    OptionError
        It is not.

    Examples
    --------
    >>> as_positive(2, "spacing"), as_positive(0.0, "spacing", zero=True)
    (2.0, 0.0)
    """
    real = isinstance(value, Real) and not isinstance(value, bool)
    number = float(value) if real else math.nan  # type: ignore[arg-type]
    if 0.0 < number < math.inf or (zero and number == 0.0):
        return number
    what = "a number of 0 or more" if zero else "a positive number"
    raise OptionError(f"{name} is {value!r}; it must be {what}")


def millimetres(unit: str, name: str = "unit") -> float:
    """Return the length of a unit in millimetres; an OptionError if it is not known.

    >>> millimetres("in")
    25.4
    """
    if unit not in MILLIMETRES:
        raise OptionError(f"{name}: unknown unit {unit!r}; {choices(unit, MILLIMETRES)}")
    return MILLIMETRES[unit]


def size_notes(
    sides: Sequence[float], unit: str, distance: float | None = None, drawn: bool = True
) -> list[str]:
    """Say what is likely to be a wrong unit: a tiny or huge design, or a distance as large as it.

    Parameters
    ----------
    sides : sequence of float, (3,)
        Sides of the bounding box, in the unit.
    unit : str
    distance : float, optional
        Largest distance that is allowed, in the unit.
    drawn : bool
        Whether patterns are drawn in millimetres.

    Examples
    --------
    >>> print(*size_notes([4.0, 3.0, 1.2], "mm"))
    the design is 4 x 3 x 1.2 mm: name the unit of its coordinates (--unit) if that is another one
    >>> size_notes([4.0, 3.0, 1.2], "m", 2.0)
    ['max_deviation is 38.9 % of the diagonal of the design: 2 m of 5.14 m']
    """
    diagonal = math.hypot(*sides)
    said = []
    if drawn and not _TINY <= diagonal * millimetres(unit) <= _HUGE:
        box = " x ".join(f"{side:.3g}" for side in sides)
        said.append(
            f"the design is {box} {unit}: name the unit of its coordinates (--unit) if that is "
            "another one"
        )
    if distance is not None and distance > _LARGE * diagonal:
        share = 100.0 * distance / diagonal if diagonal else math.inf
        said.append(
            f"max_deviation is {share:.3g} % of the diagonal of the design: {distance:.3g} {unit} "
            f"of {diagonal:.3g} {unit}"
        )
    return said


def as_sheet(sheet: Sequence[Length] | None, unit: str) -> tuple[float, float] | None:
    """Return length and width of a sheet in the unit of a mesh; numbers are in millimetres.

    >>> as_sheet((3000, "1.5m"), "m")
    (3.0, 1.5)
    """
    if sheet is None:
        return None
    if isinstance(sheet, str) or not hasattr(sheet, "__len__") or len(sheet) != 2:
        raise OptionError(f"sheet is {sheet!r}; it must be length and width of a sheet")
    long, wide = (as_length(side, "sheet", diagonal=math.nan) / millimetres(unit) for side in sheet)
    return long, wide


def _split(value: object) -> tuple[float, str]:
    """Divide a value into its number, NaN if it has none, and its unit."""
    if isinstance(value, str):
        found = _TEXT.fullmatch(value)
        return (float(found[1]), found[2].lower()) if found else (math.nan, "")
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan, ""
    return float(value), ""
