"""Validation metrics of a net, on surfaces that it was not trained on."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from gso import metrics
from gso.mesh import Mesh
from gso.typing import Array

#: The main validation metric of each task; lower is better.
SCORE = {"developable": "score", "flatten": "strain_mean", "denoise": "theta"}


def figures(task: str, before: Array, result: Array) -> dict[str, float]:
    """Compute metrics of one result; for "denoise" `before` is the surface without noise.

    "score" is the sum of 1 - K_A_r_worst, d_H and loss_gc_worst, each divided by the
    published value of Net-CF.
    """
    if task == "denoise":
        return {"theta": metrics.normal_angle(before, result)}
    if task == "flatten":
        mesh = Mesh.from_grid(before, weld=False)
        strain = metrics.principal_strains(before, result)
        return {
            "loss_iso_cell": metrics.loss_iso_cell(before, result),
            "edge_length_error": metrics.edge_length_error(mesh, result),
            "strain_mean": strain.mean,
            "strain_p99": strain.p99,
            "flipped_cells": float(metrics.flipped_cells(result, surface=before)),
        }
    found = {
        "loss_gc": metrics.loss_gc(result, scale=1.0),
        "loss_gc_worst": metrics.loss_gc_worst(result, scale=1.0),
        "loss_gc_half": metrics.loss_gc_half(result, scale=1.0),
        "K_A_r": metrics.K_A_r(before, result),
        "K_A_r_worst": metrics.K_A_r_worst(before, result),
        "d_H": metrics.d_H(before, result),
        "fairness_ratio": metrics.fairness_ratio(before, result),
    }
    left, curved = 1.0 - found["K_A_r_worst"], found["loss_gc_worst"]
    return found | {"score": left / 0.1232 + found["d_H"] / 0.517 + curved / 0.0291}


def mean_figures(task: str, befores: Array, results: Array) -> dict[str, float]:
    """Average :func:`figures` over surfaces; for "flatten" add the fraction without flips."""
    rows = [figures(task, a, b) for a, b in zip(befores, results, strict=True)]
    out = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    if task == "flatten":
        out["unflipped"] = float(np.mean([row["flipped_cells"] == 0 for row in rows]))
    return out


@torch.no_grad()
def applied(
    net: Any, surfaces: torch.Tensor, sigma: torch.Tensor | None = None, *, batch: int = 32
) -> Array:
    """Apply a net on its device to surfaces in the unit ball; return results (n, H, W, d)."""
    device = next(net.parameters()).device
    out = []
    for k in range(0, len(surfaces), batch):
        noise = None if sigma is None else sigma[k : k + batch].to(device)
        out.append(net(surfaces[k : k + batch].to(device), noise).double().cpu().numpy())
    return np.concatenate(out)
