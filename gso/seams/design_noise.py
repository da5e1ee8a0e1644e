"""Whether a design is noisy, by its curvature, and the design without its noise."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.pipeline.component_solves import solve_mesh
from gso.seams.potential import Potential
from gso.tasks import check
from gso.wording import length

#: Ratio of the absolute curvature to that after smoothing from which on a design may be noisy.
_FALLS = 3.0
#: Correlation of the curvature of neighbours up to which it is noise: that of white noise is
#: about -0.2, that of a coarse smooth surface above 0.5.
_ALIKE = 0.2
#: Standard deviations that noise may be removed by, and the standard deviation of a normal
#: distribution over the median of absolute values.
_DEVIATIONS, _NORMAL = 3.0, 1.4826


def noise(mesh: Mesh, potential: Potential) -> str:
    """Say so if a design is noisy; empty if it is not.

    Then smoothing over some edges removes most of its curvature, and neighbours differ in it.
    """
    inner = ~mesh.half_edges.boundary_vertex & (potential.area > 0)
    raw = float(np.abs(potential.curvature[inner]).sum())
    left = float(np.abs(potential.smoothed(inner)[inner]).sum())
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
        'when it is averaged over a few edges; denoise it with denoise="auto", or let its shape '
        "change with max_deviation"
    )


def without_noise(mesh: Mesh, *, within: bool) -> tuple[Mesh, str]:
    """Denoise a design; return what was done, too.

    Parameters
    ----------
    mesh : Mesh
    within : bool
        Whether no vertex moves farther than three standard deviations of the noise, which are
        estimated from the median.
    """
    smooth = solve_mesh(check("denoise", verdict=False), mesh).mesh.vertices
    moved = smooth - mesh.vertices
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    if within:
        most = _DEVIATIONS * _NORMAL * float(np.median(size[mesh.used]))
        moved = moved * np.minimum(1.0, most / np.maximum(size, 1e-300))
        size = np.minimum(size, most)
    said = (
        f"the design was denoised: its vertices moved by {length(float(size[mesh.used].mean()))} "
        f"on average, {length(float(size.max()))} at most"
    )
    return mesh.replaced(mesh.vertices + moved), said
