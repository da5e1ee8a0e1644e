"""The tolerances of limits, and the measure of a target curvature."""

from __future__ import annotations

from gso import metrics
from gso.mesh import Mesh

#: Relative tolerance of the bounds.
TIGHT = 1e-6
#: Relative tolerance of a target curvature.
TARGET = 0.05


def asked_curvature(surface: Mesh, *, scale: float | None = None) -> float:
    """Return the curvature that the developable task is judged by, 1/size^2.

    This is the only place that chooses the function of :mod:`gso.metrics`.
    """
    return metrics.loss_gc_worst(surface, scale=scale)
