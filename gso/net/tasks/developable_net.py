"""Surfaces with little Gaussian curvature near the design."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gso import metrics
from gso.metrics import SurfaceLike
from gso.net.tasks.base import NetTask
from gso.tasks import developable
from gso.tasks.developable.objective import TYPICAL_CURVATURE
from gso.typing import Array

if TYPE_CHECKING:
    from gso.net.training.config import Phase
    from gso.net.training.data import Batch
    from gso.net.training.phase_objective import Cost

#: Lower bound on a design's energy, by which that of results is divided.
_LEAST_ENERGY = 3e-5


def figures(design: Array, result: Array) -> dict[str, float]:
    """Compute metrics of a result.

    "score" is the sum of 1 - K_A_r_worst, d_H and loss_gc_worst, each divided by the
    published value of Net-CF.
    """
    found = {
        "loss_gc": metrics.loss_gc(result, scale=1.0),
        "loss_gc_worst": metrics.loss_gc_worst(result, scale=1.0),
        "loss_gc_half": metrics.loss_gc_half(result, scale=1.0),
        "K_A_r": metrics.K_A_r(design, result),
        "K_A_r_worst": metrics.K_A_r_worst(design, result),
        "d_H": metrics.d_H(design, result),
        "fairness_ratio": metrics.fairness_ratio(design, result),
    }
    left, curved = 1.0 - found["K_A_r_worst"], found["loss_gc_worst"]
    return found | {"score": left / 0.1232 + found["d_H"] / 0.517 + curved / 0.0291}


def energy(batch: Batch, phase: Phase, progress: float) -> Cost:
    """Return the optimiser's objective, relative to the designs' energies."""
    from gso.net.training.solver_energy import Developable

    weights: dict[str, Any] = dict(phase.weights)
    balance = weights.pop("balance", 0.5)
    whole = Developable(batch.compared, replace(developable.Options(), **weights))
    first, last = phase.eps
    eps = last * (first / last) ** max(1.0 - 2.0 * progress, 0.0)
    before = whole.at_start.clamp_min(_LEAST_ENERGY)
    typical = phase.weights.get("w_curvature", 1e-3) * TYPICAL_CURVATURE
    scale = before**balance * typical ** (1.0 - balance)
    return lambda result: {name: term / scale for name, term in whole.parts(result, eps).items()}


def harm(surface: SurfaceLike) -> tuple[float, ...]:
    """Return mean |K| in the worse split of the quads: in 1/length^2, and in the unit ball.

    A result that grows would lower the one alone, and one that shrinks the other.
    """
    curved = metrics.loss_gc_worst(surface, scale=1.0)
    return curved, curved * metrics.unit(surface) ** 2


TASK = NetTask(
    name="developable",
    components=3,
    default="developable",
    start="developable-start",
    score="score",
    figures=figures,
    terms=("in", "fair", "gc", "loss_gc", "k_left", "d_h", "fair_ratio", "label"),
    energy=energy,
    refines=True,
    harm=harm,
)
