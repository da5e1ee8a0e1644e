"""How parts are finished for cutting and joining; lengths in millimetres."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.quantities import as_positive
from gso.spelling import choices
from gso.typing import Json
from gso.workshop.thickness import Thickness

SIDES = ("outside", "inside")
#: Difference of thicknesses that are the same, relative to them.
_SAME = 0.01


@dataclass(frozen=True)
class Finish:
    """How parts are finished.

    Attributes
    ----------
    kerf : float
        Width that the cutter removes; outlines are moved outwards by half of it.
    allowance : float
        Width that is added about the outline, for sewing, glueing or welding.
    notches : float or None
        Distance of the notches along seams; None for none.
    registration : (float, float) or None
        Diameter of registration holes beside the notches, and their distance from the seam.
    tabs : float or None
        Width of tabs along one side of each seam, for paper.
    seam_overlap, seam_flange : float or None
        Width of a strip along one side of each seam of designs that keep their shape: along smooth
        seams a part overlaps the other one, and along seams with an angle it has a flange, which
        is folded by that angle. None for none.
    numbers : {"inside", "outside"} or None
        Where the numbers of seams stand: in the parts, or on tabs and outside the outlines. None:
        on tabs and, beside the other side, in the parts, if there are tabs and no notches.
    labels : float or None
        Height of the texts; None for none.
    grain : bool
        Whether the grain runs along the part's length.
    face : {"outside", "inside"}
        The face that is up; patterns of the inside are mirrored.
    thickness : Thickness or None
        The sheet's thickness, in millimetres. Solids of sheet metal have their own.
    k_factor : float
        K-factor of solids, unless there is a thickness.
    bend_table : array_like, (k, 2), or None
        Bend deductions of solids, unless there is a thickness; as those of :class:`Thickness`.
    """

    kerf: float = 0.0
    allowance: float = 0.0
    notches: float | None = 50.0
    registration: tuple[float, float] | None = None
    tabs: float | None = None
    seam_overlap: float | None = None
    seam_flange: float | None = None
    numbers: str | None = None
    labels: float | None = 6.0
    grain: bool = False
    face: str = "outside"
    thickness: Thickness | None = None
    k_factor: float = 0.5
    bend_table: ArrayLike | None = None

    def __post_init__(self) -> None:
        lengths = ("kerf", "allowance", "notches", "tabs", "seam_overlap", "seam_flange", "labels")
        for name in lengths:
            value = getattr(self, name)
            if value is not None:
                as_positive(value, name, zero=name in ("kerf", "allowance"))
        if self.registration is not None:
            pair = np.asarray(self.registration, float)
            if pair.shape != (2,) or not ((pair > 0) & np.isfinite(pair)).all():
                raise OptionError(
                    f"registration is {self.registration!r}; it must be the diameter of holes and "
                    "their distance from the seam"
                )
            if pair[0] <= self.kerf:
                raise OptionError(
                    f"registration holes of {pair[0]:g} mm are no wider than the kerf of "
                    f"{self.kerf:g} mm; take a larger diameter"
                )
        Thickness(1.0, self.k_factor, table=self.bend_table)
        for name, given in (("face", self.face), ("numbers", self.numbers or SIDES[0])):
            if given not in SIDES:
                raise OptionError(f"no {name} {given!r}; {choices(given, SIDES)}")
        if (self.tabs is not None) + (self.allowance > 0) + (self.seam_strip > 0) > 1:
            raise OptionError(
                "tabs, allowance, and overlap or flange of seams exclude each other; leave out all "
                "but one of them"
            )

    @property
    def seam_strip(self) -> float:
        """The largest width of strips along seams; 0 for none."""
        return max(self.seam_overlap or 0.0, self.seam_flange or 0.0)

    def of_solid(self, sheet: float) -> Finish:
        """Return the finish of a solid of some thickness in millimetres.

        Its surface is one side of the sheet, seen from outside.

        Raises
        ------
        OptionError
            Another thickness is asked for.

        Examples
        --------
        >>> Finish(k_factor=0.4).of_solid(2.0).thickness.k
        0.4
        """
        asked = self.thickness
        if asked is None:
            asked = Thickness(sheet, self.k_factor, table=self.bend_table)
        if abs(asked.sheet - sheet) > _SAME * sheet:
            raise OptionError(
                f"the solid is {sheet:.6g} mm thick, not {asked.sheet:g} mm; leave out the "
                "thickness"
            )
        return replace(self, thickness=replace(asked, sheet=sheet, face="outside"))

    def pressed(self, scale: float) -> float | None:
        """Return the thickness of a sheet that a tool folds, in the design's unit; else None."""
        sheet = self.thickness
        if sheet is None or (sheet.radius is None and sheet.table is None):
            return None
        return sheet.sheet / scale

    def room(self, sheet: tuple[float, float], scale: float) -> tuple[float, float]:
        """Return how large patterns may be for a sheet in millimetres, in the design's unit.

        Allowance, tabs, strips along seams and half of the kerf are added about a pattern.

        >>> Finish(kerf=2.0, allowance=9.0).room((1020.0, 520.0), 1000.0)
        (1.0, 0.5)
        """
        about = 2.0 * (self.allowance + (self.tabs or 0.0) + self.seam_strip) + self.kerf
        long, wide = (float(side) - about for side in sheet)
        if min(long, wide) <= 0:
            raise OptionError(
                f"{about:g} mm are added about each part, which leaves nothing of the sheet; take "
                "larger sheets"
            )
        return long / scale, wide / scale

    def record(self) -> Json:
        """Return it as JSON-compatible values."""
        out = asdict(self)
        if self.thickness is not None and self.thickness.table is not None:
            out["thickness"]["table"] = np.asarray(self.thickness.table, float).tolist()
        if self.bend_table is not None:
            out["bend_table"] = np.asarray(self.bend_table, float).tolist()
        return out
