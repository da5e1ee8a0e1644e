"""Settings of the flatten task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from gso.errors import OptionError
from gso.tasks.options import Options as BaseOptions


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the flatten task.

    Attributes
    ----------
    norm : {"mixed", "l2", "l1"}
        Cost of strain. "l2": its square (as rigid as possible). "l1": its absolute value, for
        the smallest mean at the price of a few large strains. "mixed": its absolute value, and
        a steep power for large strains; mean and peaks are both lower than with "l2". For
        ``lengths``, "mixed" is the same as "l1".
    w_edges : float
        ``strain`` with norm "mixed": weight of the relative change of the edges' lengths,
        relative to the strain of the corner triangles.
    knee : float
        ``strain`` with norm "mixed": multiple of the typical strain above which the steep power
        dominates; smaller numbers trade mean strain for smaller peaks.
    w_shear : float
        ``lengths``: weight of the squared shear. The lengths do not see some shear, by which
        neighbouring vertices could drift apart.
    w_fairness : float
        Weight of the mean squared second derivative of the flat image, in units of the
        surface's unit ball.
    w_mapping : float
        ``isometry``: weight of the regulariser of the mapping: the mean squared difference,
        between surface and image, of the inner products of second differences and edges.
    eps : float
        ``lengths``: length differences below this share of the cells' diagonals are penalised
        quadratically.
    coarse_size : int
        Largest side of the coarsest grid.
    relax_iterations : int
        Largest number of as-rigid-as-possible iterations before the first stage.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"iterations": 2, "tolerance": 5e-2},
        "balanced": {},
        "accurate": {"iterations": 100, "tolerance": 1e-8},
        "jiang2020": {"iterations": 60, "tolerance": 1e-4},
    }

    iterations: int = 40
    tolerance: float = 1e-2
    norm: str = "mixed"
    w_edges: float = 0.35
    knee: float = 2.2
    w_shear: float = 1e-2
    w_fairness: float = 0.0
    w_mapping: float = 0.03
    eps: float = 3e-4
    coarse_size: int = 40
    relax_iterations: int = 100

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.norm not in ("mixed", "l2", "l1"):
            raise OptionError(f"norm is {self.norm!r}; take 'mixed', 'l2' or 'l1'")
        if not (self.eps > 0 and self.knee > 0):
            raise OptionError("eps and knee must be positive")
        if self.coarse_size < 4:
            raise OptionError(f"coarse_size is {self.coarse_size}; it must be 4 or more")
