"""Whether a design is noisy, by its curvature."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.seams.potential import Potential

#: Ratio of the absolute curvature to that after smoothing from which on a design may be noisy.
_FALLS = 3.0
#: Correlation of the curvature of neighbours up to which it is noise: that of white noise is
#: about -0.2, that of a coarse smooth surface above 0.5.
_ALIKE = 0.2


def noise(mesh: Mesh, potential: Potential) -> str:
    """Say so if a design is noisy; empty if it is not.

    Then smoothing over some edges removes most of its curvature, and neighbours differ in it.
    """
    inner = ~mesh.half_edges.boundary_vertex & (potential.area > 0)
    raw = float(np.abs(potential.curvature[inner]).sum())
    left = float(np.abs(potential.smoothed()[inner]).sum())
    if raw <= _FALLS * max(left, 1.0):
        return ""
    density = np.where(inner, potential.curvature / np.maximum(potential.area, 1e-300), 0.0)
    a, b = mesh.edges[inner[mesh.edges].all(axis=1)].T
    weight = np.sqrt(potential.area[a] * potential.area[b])
    square = 0.5 * float(weight @ (density[a] ** 2 + density[b] ** 2))
    if float(weight @ (density[a] * density[b])) > _ALIKE * square:
        return ""
    return (
        f"the design is noisy: its absolute curvature falls from {raw:.3g} to {left:.3g} "
        "when it is averaged over a few edges; denoise it with denoise=True, or let its shape "
        "change with max_deviation"
    )
