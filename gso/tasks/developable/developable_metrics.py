"""The metrics of developable surfaces and of their flat images."""

from __future__ import annotations

import numpy as np

from gso import metrics as measure
from gso.mesh import Mesh
from gso.typing import Array


def flat_metrics(surface: Mesh, flat: Array) -> dict[str, float]:
    """Compute how well a flat image (n, 2) preserves the lengths of its surface."""
    strain = measure.principal_strains(surface, flat)
    out = {
        "isometry_energy": measure.isometry_energy(surface, flat),
        "parallelogram_strain": float(measure.parallelogram_strain(surface, flat).mean()),
        "loss_iso_cell": measure.loss_iso_cell(surface, flat),
        "edge_length_error": measure.edge_length_error(surface, flat),
        "strain_mean": strain.mean,
        "strain_p99": strain.p99,
        "flipped_cells": float(measure.flips(surface, flat)),
    }
    return {name: value for name, value in out.items() if not np.isnan(value)}


def curvature_metrics(before: Mesh, after: Mesh, scale: float) -> dict[str, float]:
    """Compute the curvature and planarity metrics that are defined for two surfaces."""
    found = {
        "loss_gc_before": measure.loss_gc(before, scale=scale),
        "loss_gc": measure.loss_gc(after, scale=scale),
        "loss_gc_worst_before": measure.loss_gc_worst(before, scale=scale),
        "loss_gc_worst": measure.loss_gc_worst(after, scale=scale),
        "loss_gc_image": measure.loss_gc_image(after, scale=scale),
        "loss_gc_half": measure.loss_gc_half(after, scale=scale),
        "mean_abs_K_before": measure.mean_abs_K(before, scale=scale),
        "mean_abs_K": measure.mean_abs_K(after, scale=scale),
    }
    if not before.is_triangles:
        gap = measure.nonplanarity(after)
        found |= {
            "nonplanarity_mean": float(gap.mean()),
            "nonplanarity_max": float(gap.max()),
            "nonplanarity_max_before": float(measure.nonplanarity(before).max()),
        }
    return {name: value for name, value in found.items() if not np.isnan(value)}


def metrics(before: Mesh, after: Mesh, flat: Array | None, scale: float) -> dict[str, float]:
    """Compute the published and the corrected metrics; units: :data:`gso.metrics.INFO`."""
    true = measure.surface_distance(before, after)
    percent = 100.0 / before.diagonal
    out = curvature_metrics(before, after, scale) | {
        "K_A_r": measure.K_A_r(before, after),
        "K_A_r_worst": measure.K_A_r_worst(before, after),
        "d_H": measure.d_H(before, after),
        "distance_mean": percent * 0.5 * (true.there_mean + true.back_mean),
        "distance_max": percent * true.largest,
        "fairness_ratio": measure.fairness_ratio(before, after),
        "fold_max_before": float(measure.dihedral_angles(before).max(initial=0.0)),
        "fold_max": float(measure.dihedral_angles(after).max(initial=0.0)),
    }
    same = np.array_equal(before.faces, after.faces)
    if same:
        out["edge_ratio_min"] = float(np.nanmin(measure.edge_ratios(before, after)))
    if same and before.boundary_loops:
        loops = measure.loop_ratios(before, after)
        out |= {"loop_ratio_min": float(loops.min()), "loop_ratio_max": float(loops.max())}
    return out if flat is None else out | flat_metrics(after, flat)
