"""Facets of pieces: the angles between neighbouring faces inside them."""

from __future__ import annotations

from gso import metrics
from gso.mesh import Mesh
from gso.result import Result

#: Ratio of the mean angle between neighbouring faces, result over design, up to which pieces count
#: as smooth: facets have no Gaussian curvature either.
FACETS = 1.10


def facet_ratio(result: Result) -> float:
    """Return the mean angle between faces inside pieces, relative to the design's."""
    before = mean_angle(result.design)
    return mean_angle(result.mesh) / before if before > 0 else 1.0


def mean_angle(mesh: Mesh) -> float:
    """Return the mean angle between neighbouring faces, in degrees."""
    angles = metrics.dihedral_angles(mesh)
    return float(angles.mean()) if angles.size else 0.0
