"""What was asked for, and by what it is measured."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from gso import metrics

#: Share by which a bound may be passed.
TIGHT = 1e-6
#: Largest strain up to which a surface counts as developable where only a distance was asked for.
DEVELOPABLE = 5e-3
#: Share by which a target of the curvature may be missed.
TARGET = 0.05


@dataclass(frozen=True)
class Asked:
    """What a result must keep to, beside its task.

    Attributes
    ----------
    max_deviation : float or None
        Largest distance from the design, in its unit.
    max_strain : float or None
        Largest principal strain of the pattern.
    target_curvature : float or None
        Mean absolute curvature to reach, 1/size^2.
    moved : float
        Farthest that a constraint takes a vertex of the design, in its unit: 0 where the
        design itself keeps them all. Infinite where that has no length.
    """

    max_deviation: float | None = None
    max_strain: float | None = None
    target_curvature: float | None = None
    moved: float = 0.0

    @property
    def limits(self) -> dict[str, float]:
        """The numbers that were asked for, by name."""
        given = asdict(self)
        return {k: float(v) for k, v in given.items() if k != "moved" and v is not None}


def asked_curvature(surface: Any, *, scale: float | None = None) -> float:
    """The curvature that the developable task is judged by, 1/size^2.

    The one place that says which of :mod:`gso.metrics` it is.
    """
    return metrics.loss_gc_worst(surface, scale=scale)
