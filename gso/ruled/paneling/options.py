"""Settings of strips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gso.errors import OptionError
from gso.tasks import Options as BaseOptions

#: The formulation of the developable task by which :func:`gso.tno.optimize` makes strips.
RULED = "ruled"
#: Largest number of strips that are tried.
MOST = 64
#: Surfaces whose normals give first rulings.
_STARTS = ("design", "curvature")


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of strips (:func:`gso.strips`); those of the solver are for the first surface.

    Attributes
    ----------
    strips : int, "auto" or None
        Number of strips side by side, which share crease curves and are separate parts of the
        pattern. "auto": as few as hold `max_deviation` and `max_crease`, at most `max_strips`.
        None: "auto" where there is such a bound, else 1.
    max_strips : int
        Largest number of strips that "auto" tries.
    rulings : int
        Number of rulings of a strip, some of them outside the outline.
    flats : bool
        Whether the strip may branch at flat triangles: a tree of strips, still one sheet. Only
        for a single strip.
    max_crease : float or None
        Largest angle at a crease between strips, in degrees.
    min_radius : float or None
        Smallest radius of the bends, in the unit of the mesh; a result with a smaller one is not
        usable.
    lines : bool
        Whether several strips may run along lines of the design, or of a grid laid over it, and a
        developable design may be kept without a largest distance: they are mostly nearer, but only
        others become smooth surfaces in CAD files.
    starts : tuple of str
        Surfaces whose normals give first rulings: "design", "curvature" (the design made
        developable by that formulation). The best result of all is kept. A warm start `x0`
        replaces "curvature".
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"starts": ("design",)},
        "balanced": {},
        "accurate": {"rulings": 65},
    }

    strips: int | str | None = None
    max_strips: int = MOST
    rulings: int = 33
    flats: bool = False
    max_crease: float | None = None
    min_radius: float | None = None
    lines: bool = True
    starts: tuple[str, ...] = _STARTS

    def __post_init__(self) -> None:
        strips = self.strips
        if isinstance(strips, str) or strips is None:
            if strips not in ("auto", None):
                raise OptionError(f"strips is {strips!r}; it must be a number, 'auto' or None")
        elif not (isinstance(strips, int | np.integer) and 1 <= strips <= MOST):
            raise OptionError(f"strips is {strips!r}; it must be 1 to {MOST}, 'auto' or None")
        if not 1 <= self.max_strips <= MOST:
            raise OptionError(f"max_strips is {self.max_strips}; it must be 1 to {MOST}")
        if self.flats and strips not in (1, None):
            raise OptionError(
                f"flats=True is for a single strip, but strips is {strips!r}; leave one of them out"
            )
        super().__post_init__()
        if not 5 <= self.rulings <= 513:
            raise OptionError(f"rulings is {self.rulings}; it must be 5 to 513")
        if not self.starts or set(self.starts) - set(_STARTS):
            raise OptionError(f"starts is {self.starts!r}; it must name some of {_STARTS}")

    @property
    def number(self) -> int | None:
        """The number of strips that was named; None if it is to be found where there is a bound.

        >>> Options(strips=4).number, Options(flats=True).number, Options().number
        (4, 1, None)
        """
        if self.flats:
            return 1
        return None if isinstance(self.strips, str) or self.strips is None else int(self.strips)
