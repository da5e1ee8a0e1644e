"""Requirements on a result, and the tolerances and measures they are checked with."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from gso import metrics

#: Relative tolerance of the bounds.
TIGHT = 1e-6
#: Relative tolerance of a target curvature.
TARGET = 0.05


@dataclass(frozen=True)
class Asked:
    """Requirements on a result beyond those of its task.

    Attributes
    ----------
    max_deviation : float or None
        Largest allowed distance from the design, in its unit.
    max_strain : float or None
        Largest allowed principal strain of the pattern.
    target_curvature : float or None
        Mean absolute curvature to reach, 1/size^2.
    moved : float
        Largest violation of a constraint by the design, in its unit: 0 if the design satisfies
        all constraints, infinite if a violation cannot be expressed as a length.
    """

    max_deviation: float | None = None
    max_strain: float | None = None
    target_curvature: float | None = None
    moved: float = 0.0

    @property
    def limits(self) -> dict[str, float]:
        """The limits that were given, by name."""
        given = asdict(self)
        return {k: float(v) for k, v in given.items() if k != "moved" and v is not None}


def asked_curvature(surface: Any, *, scale: float | None = None) -> float:
    """Return the curvature that the developable task is judged by, 1/size^2.

    This is the only place that chooses the function of :mod:`gso.metrics`.
    """
    return metrics.loss_gc_worst(surface, scale=scale)
