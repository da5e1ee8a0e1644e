"""The metrics of strips."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.mesh import Mesh
from gso.ruled.ruled_surface import RuledSurface


def strip_metrics(design: Mesh, surface: RuledSurface) -> dict[str, float]:
    """Compute the metrics of strips near a design.

    They have no Gaussian curvature, so there is none here. Distances are measured all over both
    surfaces; each is the larger one of both directions.
    """
    true = surface.deviation or surface.distances(design)
    percent = 100.0 / design.diagonal
    flat, sheet = surface.pattern.flat, surface.pattern.surface(surface.mesh)
    turns = surface.creases.turns(surface.mesh.vertices)
    return surface.strains | {
        "distance_mean": percent * true.mean,
        "distance_max": percent * true.largest,
        "d_H": metrics.d_H(design, design.replaced(surface.moved)),
        "fold_max": float(metrics.dihedral_angles(surface.mesh).max(initial=0.0)),
        "flipped_cells": float(metrics.flips(sheet, flat)),
        "strips": float(surface.strips),
        "rulings": float(len(surface.rulings.edges)),
        "flats": float(np.count_nonzero(surface.flat)),
        "rulings_crossed": float(surface.crossed),
        "bend_radius_min": surface.rulings.smallest_radius,
        "crease_angle_max": float(np.degrees(surface.creases.largest_angle)),
        "crease_turn_max": float(np.degrees(turns.max(initial=0.0))),
    }
