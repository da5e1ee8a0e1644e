"""What is asked of a fabrication: how surfaces are made, and within which bounds."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gso.errors import OptionError
from gso.spelling import choices

FORMULATIONS = ("ruled", "curvature", "isometry", "flatten")


@dataclass(frozen=True)
class Ask:
    """How designs become parts.

    Attributes
    ----------
    formulation : {"ruled", "curvature", "isometry", "flatten"}
        "ruled": exactly developable strips; "curvature" and "isometry": surfaces that are nearly
        developable; "flatten": the shape stays as it is.
    max_deviation : float or str
        Largest distance from the design, in the unit of the files, or such as "0.5%" of its
        diagonal.
    max_strain : float
        Largest strain of the patterns (99th percentile).
    max_strips : int
        Largest number of strips side by side of one piece.
    darts : bool
        Whether cuts may end inside a piece.
    max_size : (float, float) or None
        Length and width of a sheet, in the unit of the files.
    min_radius : float or None
        Smallest radius of a bend, in the unit of the files.
    """

    formulation: str = "ruled"
    max_deviation: float | str = "1%"
    max_strain: float = 1e-3
    max_strips: int = 8
    darts: bool = False
    max_size: tuple[float, float] | None = None
    min_radius: float | None = None

    def __post_init__(self) -> None:
        if self.formulation not in FORMULATIONS:
            raise OptionError(
                f"no formulation {self.formulation!r}; {choices(self.formulation, FORMULATIONS)}"
            )
        self.distance(1.0)
        for name in ("max_strain", "min_radius"):
            value = getattr(self, name)
            if value is not None and not (
                isinstance(value, int | float | np.number) and 0 < value < np.inf
            ):
                raise OptionError(f"{name} is {value!r}; it must be a positive number")
        if not (isinstance(self.max_strips, int) and 1 <= self.max_strips <= 64):
            raise OptionError(f"max_strips is {self.max_strips!r}; it must be 1 to 64")

    def distance(self, diagonal: float) -> float:
        """Return the largest distance from a design with some diagonal.

        >>> Ask(max_deviation="0.5%").distance(200.0)
        1.0
        """
        given, share = self.max_deviation, 1.0
        if isinstance(given, str) and given.strip().endswith("%"):
            given, share = given.strip()[:-1], 0.01 * diagonal
        try:
            out = float(given) * share
        except (TypeError, ValueError):
            out = np.nan
        if isinstance(given, bool) or not 0 < out < np.inf:
            raise OptionError(
                f"max_deviation is {self.max_deviation!r}; it must be a positive length, or such "
                'as "0.5%" of the diagonal'
            )
        return out

    def record(self) -> dict[str, Any]:
        """Return it as JSON-compatible values."""
        return asdict(self)
