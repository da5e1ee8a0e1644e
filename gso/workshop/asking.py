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
    max_deviation : float or None
        Largest distance from the design, in the unit of the files; 1 % of its diagonal when None.
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
    max_deviation: float | None = None
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
        for name in ("max_deviation", "max_strain", "min_radius"):
            value = getattr(self, name)
            if value is not None and not (
                isinstance(value, int | float | np.number) and 0 < value < np.inf
            ):
                raise OptionError(f"{name} is {value!r}; it must be a positive number")
        if not (isinstance(self.max_strips, int) and 1 <= self.max_strips <= 64):
            raise OptionError(f"max_strips is {self.max_strips!r}; it must be 1 to 64")

    def record(self) -> dict[str, Any]:
        """Return it as JSON-compatible values."""
        return asdict(self)
