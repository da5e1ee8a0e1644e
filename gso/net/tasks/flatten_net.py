"""Flat images with little strain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso import metrics
from gso.mesh import Mesh
from gso.net.tasks.base import NetTask
from gso.tasks import flatten
from gso.typing import Array

if TYPE_CHECKING:
    from gso.net.training.config import Phase
    from gso.net.training.data import Batch
    from gso.net.training.phase_objective import Cost


def figures(design: Array, result: Array) -> dict[str, float]:
    """Compute metrics of a flat image; "unflipped" is 1 where no cell is flipped."""
    strain = metrics.principal_strains(design, result)
    flipped = metrics.flipped_cells(result, surface=design)
    return {
        "loss_iso_cell": metrics.loss_iso_cell(design, result),
        "edge_length_error": metrics.edge_length_error(Mesh.from_grid(design, weld=False), result),
        "strain_mean": strain.mean,
        "strain_p99": strain.p99,
        "flipped_cells": float(flipped),
        "unflipped": float(flipped == 0),
    }


def energy(batch: Batch, phase: Phase, progress: float) -> Cost:
    """Return the optimiser's objective."""
    from gso.net.training.solver_energy import Strain

    return Strain(batch.surface, flatten.Options()).parts


TASK = NetTask(
    name="flatten",
    components=2,
    default="flatten-strain",
    score="strain_mean",
    figures=figures,
    terms=("fair", "iso", "iso_w", "iso_cell", "iso_cell_w", "strain", "label"),
    energy=energy,
    displacement=0.03,
    # No `start`: the optimiser's own is within a few iterations of the minimum.
)
