"""Validation metrics of a net, on surfaces that it was not trained on."""

from __future__ import annotations

import numpy as np
import torch

from gso.net import tasks
from gso.net.models.base import Net
from gso.typing import Array


def mean_figures(task: str, befores: Array, results: Array) -> dict[str, float]:
    """Average the metrics of a task over surfaces (n, H, W, 3) and results (n, H, W, d)."""
    figures = tasks.get(task).figures
    rows = [figures(a, b) for a, b in zip(befores, results, strict=True)]
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


@torch.no_grad()
def applied(
    net: Net, surfaces: torch.Tensor, sigma: torch.Tensor | None = None, *, batch: int = 32
) -> Array:
    """Apply a net on its device to surfaces in the unit ball; return results (n, H, W, d)."""
    device = next(net.parameters()).device
    out = []
    for k in range(0, len(surfaces), batch):
        noise = None if sigma is None else sigma[k : k + batch].to(device)
        out.append(net(surfaces[k : k + batch].to(device), noise).double().cpu().numpy())
    return np.concatenate(out)
