"""The objective of a phase of training."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import torch
from torch import Tensor, nn

from gso.net.models.base import Net
from gso.net.models.grid_geometry import planes
from gso.net.tasks import NetTask
from gso.net.training import training_losses
from gso.net.training.config import Phase
from gso.net.training.data import Batch

#: Lower bound on the size of a label's displacement, by which the misfit is divided.
_LEAST = 3e-3

#: Loss (B,) of results (B, H, W, d): the weighted terms by name, or their sum.
Cost = Callable[[Tensor], Mapping[str, Tensor] | Tensor]
Term = Callable[[Tensor, Tensor], Tensor]


class Objective(nn.Module):
    """A net and its loss as one module, as DistributedDataParallel needs it."""

    def __init__(self, net: Net):
        super().__init__()
        self.net = net

    def forward(
        self, batch: Batch, phase: Phase, progress: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Compute the mean loss of a batch, and its weighted terms, as constants.

        `progress` runs from 0 to 1 within the phase.
        """
        start = self.net.initial_geometry(batch.surface)
        if phase.unrolled:
            moved = self.net.displacements(batch.surface, batch.sigma, unrolled=True)
        else:
            # Steps train the passes in turn; earlier passes only compute the last one's input.
            passes = 1 + batch.step % self.net.passes
            moved = self.net.displacements(batch.surface, batch.sigma, passes=passes)
        cost = _COSTS[phase.loss](self.net.kind, batch, start, phase, progress)
        found = cost(start + moved)
        if isinstance(found, Tensor):
            found = {phase.loss: found}
        terms = {name: term.mean() for name, term in found.items()}
        whole = torch.stack(list(found.values())).sum(0).mean()
        return whole, {name: term.detach() for name, term in terms.items()}


def _published(task: NetTask, batch: Batch, start: Tensor, phase: Phase, progress: float) -> Cost:
    weights = dict(phase.weights)
    if "in" in weights:
        weights["in"] *= math.exp(-phase.decay * progress)
    terms = _TERMS
    if phase.labelled:
        label = _label_distance(task, batch, start)
        terms = terms | {"label": lambda result, _: label(result)}
    used = [(name, weight, terms[name]) for name, weight in weights.items() if weight]

    def cost(result: Tensor) -> dict[str, Tensor]:
        return {name: weight * term(result, batch.compared) for name, weight, term in used}

    return cost


def _weighted(term: Callable[..., Tensor]) -> Term:
    """Return a term of flat images with the weights of Eq. 13."""
    return lambda flat, surface: term(surface, flat, training_losses.iso_weights(surface))


#: Terms of the loss "published", as functions of results and of the surfaces compared with.
_TERMS: dict[str, Term] = {
    "in": training_losses.inside,
    "fair": lambda result, _: training_losses.fair(result),
    "fair_ratio": training_losses.fair_ratio,
    "gc": lambda result, _: training_losses.gc(result),
    "loss_gc": lambda result, _: training_losses.loss_gc(result),
    "k_left": training_losses.k_left,
    "d_h": training_losses.d_h,
    "iso": lambda flat, surface: training_losses.iso(surface, flat),
    "iso_w": _weighted(training_losses.iso),
    "iso_cell": lambda flat, surface: training_losses.iso_cell(surface, flat),
    "iso_cell_w": _weighted(training_losses.iso_cell),
    "strain": lambda flat, surface: training_losses.strain(surface, flat),
}


def _label(task: NetTask, batch: Batch, start: Tensor, phase: Phase, progress: float) -> Cost:
    return _label_distance(task, batch, start)


def _label_distance(task: NetTask, batch: Batch, start: Tensor) -> Callable[[Tensor], Tensor]:
    """Return the root-mean-square distance to the label, divided by that of the start."""
    if batch.target is None:
        raise ValueError("a batch without labels")
    target = aligned(batch.target, start) if task.flat else batch.target
    size = (target - start).square().sum(dim=-1).mean(dim=(1, 2))

    def cost(result: Tensor) -> Tensor:
        miss = (result - target).square().sum(dim=-1).mean(dim=(1, 2))
        return ((miss + 1e-10) / (size + _LEAST**2)).sqrt()

    return cost


def _energy(task: NetTask, batch: Batch, start: Tensor, phase: Phase, progress: float) -> Cost:
    if task.energy is None:
        raise ValueError(f"task {task.name!r} has no energy")
    return task.energy(batch, phase, progress)


def _clean(task: NetTask, batch: Batch, start: Tensor, phase: Phase, progress: float) -> Cost:
    if batch.target is None or batch.sigma is None:
        raise ValueError("a batch without clean surfaces")
    target, sigma = batch.target, batch.sigma
    exact = planes(target)
    factor = phase.weights.get("angle", 0.1)

    def cost(result: Tensor) -> dict[str, Tensor]:
        miss = (result - target).square().sum(dim=-1).mean(dim=(1, 2))
        angle = torch.rad2deg(training_losses.normal_angles(exact, planes(result)))
        return {"distance": (miss + 1e-12).sqrt() / sigma, "angle": factor * angle}

    return cost


_COSTS = {"published": _published, "label": _label, "energy": _energy, "clean": _clean}


def aligned(flat: Tensor, start: Tensor) -> Tensor:
    """Align flat images (B, H, W, 2) to `start` by the best rigid motion or reflection."""
    a, b = (x - x.mean(dim=(1, 2), keepdim=True) for x in (flat, start))
    middle = start.mean(dim=(1, 2), keepdim=True)
    u, _, vt = torch.linalg.svd(torch.einsum("bhwi,bhwj->bij", a, b))
    return torch.einsum("bhwi,bij->bhwj", a, u @ vt) + middle
