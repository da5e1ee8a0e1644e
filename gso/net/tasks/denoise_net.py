"""Surfaces without the noise of the input."""

from __future__ import annotations

from gso import metrics
from gso.net.tasks.base import NetTask
from gso.typing import Array


def figures(design: Array, result: Array) -> dict[str, float]:
    """Compute the mean angle between the normals of a result and of the surface without noise."""
    return {"theta": metrics.normal_angle(design, result)}


TASK = NetTask(
    name="denoise",
    components=3,
    default="denoise",
    score="theta",
    figures=figures,
    terms=("in", "fair", "gc", "loss_gc"),
    noisy=True,
)
