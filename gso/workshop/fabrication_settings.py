"""What is asked of a fabrication: how surfaces are made, and within which bounds."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from gso.errors import OptionError
from gso.quantities import Length, as_length, millimetres
from gso.recognition import bend_step_of
from gso.seams.options import CHANGES, STAYS
from gso.seams.seam_request import SeamRequest
from gso.spelling import choices
from gso.typing import Ints, Json

FORMULATIONS = ("ruled", "curvature", "isometry", "flatten")


@dataclass(frozen=True)
class FabricationSettings:
    """How designs become parts.

    Attributes
    ----------
    formulation : {"ruled", "curvature", "isometry", "flatten"}
        "ruled": exactly developable strips; "curvature" and "isometry": surfaces that are nearly
        developable; "flatten": the shape stays as it is.
    max_deviation : float or str
        Largest distance between design and result, both ways, as for :func:`gso.pieces`.
    max_strain : float or None
        Largest strain of the patterns; None: the default of :func:`gso.pieces`, see `strain`.
    max_strips : int
        Largest number of strips side by side of one piece.
    darts : bool
        Whether cuts may end inside a piece.
    max_size : (float, float) or None
        Length and width of a sheet, in the unit of the files.
    min_radius : float or None
        Smallest radius of a bend, in the unit of the files.
    unit : str
        Unit of the files.
    bend_step : float or str, optional
        Angle between bend lines of round faces, or distance of chords between them from the face,
        as for :func:`gso.recognition.recognise`.
    press : float, optional
        Thickness of a sheet that a tool folds, in the unit of the files: narrow cylinders are bent
        at one line.
    page : (float, float) or None
        Length and width of a page that parts of designs that keep their shape fit if they can, in
        the unit of the files.
    max_pieces : int or None
        Largest number of pieces of a design.
    min_neck, min_size : float or None
        Smallest width of a part at its narrowest place, and smallest length of a part, in the unit
        of the files.
    symmetric : bool
        Whether the seams of each design are to be symmetric.
    effort : {"draft", "standard", "best"}
        How long to search for seams.
    """

    formulation: str = "ruled"
    max_deviation: Length = "1%"
    max_strain: float | None = None
    max_strips: int = 64
    darts: bool = False
    max_size: tuple[float, float] | None = None
    min_radius: float | None = None
    unit: str = "mm"
    bend_step: Length | None = None
    press: float | None = None
    page: tuple[float, float] | None = None
    max_pieces: int | None = None
    min_neck: float | None = None
    min_size: float | None = None
    symmetric: bool = False
    effort: str = "standard"

    def __post_init__(self) -> None:
        if self.formulation not in FORMULATIONS:
            raise OptionError(
                f"no formulation {self.formulation!r}; {choices(self.formulation, FORMULATIONS)}"
            )
        self.distance(1.0)
        bend_step_of(self.bend_step, 1.0, self.unit)
        if not (isinstance(self.max_strips, int) and 1 <= self.max_strips <= 64):
            raise OptionError(f"max_strips is {self.max_strips!r}; it must be 1 to 64")
        if self.max_size is not None and (self.min_size or 0.0) > max(self.max_size):
            raise OptionError(
                f"min_size is {self.min_size!r}, more than the length of a sheet; lower it"
            )
        self.seams()

    def distance(self, diagonal: float) -> float:
        """Return the largest distance from a design with some diagonal, in its unit.

        >>> FabricationSettings(max_deviation="0.5%").distance(200.0)
        1.0
        """
        return as_length(self.max_deviation, "max_deviation", diagonal=diagonal, unit=self.unit)

    @property
    def sheet(self) -> tuple[float, float] | None:
        """Length and width of a sheet in millimetres."""
        if self.max_size is None:
            return None
        long, wide = (millimetres(self.unit) * side for side in self.max_size)
        return long, wide

    @property
    def strain(self) -> float:
        """The largest strain that is allowed."""
        default = STAYS if self.formulation == "flatten" else CHANGES
        return default if self.max_strain is None else self.max_strain

    def seams(self, along: Ints | None = None, avoid: Ints | None = None) -> SeamRequest:
        """Return what is asked of the seams of a design.

        Parameters
        ----------
        along : ndarray of int, (k, 2), optional
            Edges that they should follow.
        avoid : ndarray of int, (k,), optional
            Faces that they should keep away from.
        """
        places = {"along": along, "avoid": avoid}
        return SeamRequest(
            self.max_pieces,
            self.min_neck,
            self.min_size,
            self.symmetric,
            self.effort,
            **{name: ids for name, ids in places.items() if ids is not None},
        )

    def record(self) -> Json:
        """Return it as JSON-compatible values."""
        return asdict(self) | {"max_strain": self.strain}
