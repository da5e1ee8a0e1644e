"""What was asked of a search for seams, checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gso.errors import OptionError
from gso.executors import SERIAL, Executor
from gso.mesh import Mesh
from gso.quantities import as_positive
from gso.spelling import choices
from gso.verdict import Code

#: Largest strain where none is given: of a shape that stays, and of one that may change.
STAYS, CHANGES = 0.01, 0.001
#: Smallest neck, relative to the root of the area, unless given.
NECK = 0.1
#: Smallest neck of a piece of a shape that stays, relative to the root of the piece's area.
NARROWEST = 0.08


@dataclass(frozen=True)
class Effort:
    """How many solves a search may take.

    Attributes
    ----------
    divisions : int
        How often pieces that do not hold what is allowed are divided, before more pieces are tried.
    merges : int
        How many solves merge pieces that do.
    rounds : int
        How often the design's own pieces are solved, each time with more of them.
    budgets : int
        How many solves merge pieces, or move seams, where a budget does not hold.
    variants : int
        How many divisions are tried for each bound on the estimate, the best by number of pieces
        and seam first.
    laid : int
        How often each face is laid flat to find shorter seams of a shape that stays.
    """

    divisions: int
    merges: int
    rounds: int
    budgets: int
    variants: int
    laid: int


#: By name, the fastest first.
EFFORTS = {
    "draft": Effort(divisions=2, merges=3, rounds=2, budgets=4, variants=3, laid=0),
    "standard": Effort(divisions=3, merges=8, rounds=9, budgets=12, variants=6, laid=18),
    "best": Effort(divisions=4, merges=24, rounds=12, budgets=30, variants=12, laid=50),
}


def effort_named(name: str) -> Effort:
    """Return an effort by name.

    Raises
    ------
    OptionError
        There is none.
    """
    if name not in EFFORTS:
        raise OptionError(f"no effort {name!r}; {choices(name, EFFORTS)}")
    return EFFORTS[name]


@dataclass(frozen=True)
class PieceSettings:
    """Budgets and preferences of :func:`gso.pieces`."""

    max_strain: float
    max_deviation: float | None
    max_pieces: int | None
    seam: float | None
    darts: bool
    min_neck: float | None
    min_size: float | None
    max_size: tuple[float, float] | None
    say: Callable[[str], None]
    effort: Effort = EFFORTS["standard"]
    executor: Executor = SERIAL
    fewer_than: int | None = None

    def __post_init__(self) -> None:
        if self.seam is not None:
            as_positive(self.seam, "seam")
        if not callable(self.say):
            raise OptionError(f"callback is {self.say!r}; it must be a function of a text")
        for name in ("max_pieces", "fewer_than"):
            count = getattr(self, name)
            whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
            if count is not None and not (whole and count >= 1):
                raise OptionError(f"{name} is {count!r}; it must be a whole number from 1 up")
        size = self.max_size
        if size is not None and self.min_size is not None and self.min_size > max(size):
            raise OptionError(
                f"min_size is {self.min_size!r}, more than the length of a sheet; lower it"
            )

    @property
    def allowed(self) -> float:
        """The largest distance from the design; infinite if it has no bound."""
        return np.inf if self.max_deviation is None else self.max_deviation

    def value(self, pieces: int, seam: float) -> tuple[int, float, float]:
        """Rank pieces, lower is better: budgets first, then seam and number of pieces."""
        many = max(0, pieces - self.max_pieces) if self.max_pieces is not None else 0
        long = max(0.0, seam - self.seam) if self.seam is not None else 0.0
        # One piece fewer is worth a seam of half the root of the area.
        return many, long, seam + 0.5 * pieces

    @property
    def limits(self) -> dict[Code, float | None]:
        """What the pieces are judged by."""
        wide, long = (None, None) if self.max_size is None else sorted(self.max_size)
        return {
            Code.STRAIN: self.max_strain,
            Code.DEVIATION: self.max_deviation,
            Code.PIECES: self.max_pieces,
            Code.SEAM_LENGTH: self.seam,
            Code.NECK: self.min_neck,
            Code.TOO_SHORT: self.min_size,
            Code.TOO_LONG: long,
            Code.TOO_WIDE: wide,
        }


def too_large(mesh: Mesh, sheet: tuple[float, float]) -> bool:
    """Tell whether an edge is longer than the diagonal of a sheet, so that no cut helps."""
    return bool(mesh.edge_lengths.max(initial=0.0) > np.hypot(*sheet))
