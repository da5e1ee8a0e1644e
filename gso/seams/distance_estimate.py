"""How far a set of faces would have to move to become developable: an estimate.

A displacement w along normals changes lengths by ``w k`` in the direction of the largest normal
curvature k. A piece whose flat image has the scale u (:mod:`gso.seams.potential`) has to change
lengths by about half the spread of u, so that it has to move by that over its mean curvature.
For a cap of a sphere this is the distance from the nearest cylinder, up to a factor.
"""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.seams.estimates import Estimates
from gso.seams.regions import Regions
from gso.typing import Array, Ints

#: Curvature times the diagonal that counts at least, so that planes have a finite estimate.
_FLAT = 0.05


class DistanceEstimates:
    """Estimates of distances, over an allowed one.

    Parameters
    ----------
    estimates : Estimates
        Of the strain.
    regions : Regions
        The mesh with its creases.
    distance : float
        The allowed distance.
    """

    def __init__(self, estimates: Estimates, regions: Regions, distance: float):
        self._estimates, self._area = estimates, regions.face_area
        floor = _FLAT / regions.mesh.diagonal
        self._bent = np.maximum(largest_curvatures(regions.opened.mesh), floor) * distance

    def __call__(self, faces: Ints) -> float | None:
        """Estimate the distance of some faces together; None where they are no disk."""
        strain = self._estimates(faces)
        if strain is None:
            return None
        area = self._area[faces]
        return strain * float(area.sum()) / max(float(area @ self._bent[faces]), 1e-300)


def largest_curvatures(mesh: Mesh) -> Array:
    """Return the largest absolute normal curvature (m,) of each triangle, about.

    It is the root of the sum of the squares of both principal curvatures, from the change of the
    normals at the corners.
    """
    corners, normals = mesh.vertices[mesh.faces], vertex_normals(mesh)[mesh.faces]
    size = np.linalg.norm(geometry.area_vectors(mesh.vertices, mesh.faces), axis=1)
    good = size > 1e-12 * float(size.max(initial=0.0))
    sides = [tuple(x[good, k].T - x[good, 0].T) for x in (corners, normals) for k in (1, 2)]
    rows = geometry.shape_matrix(*sides)
    out = np.zeros(len(mesh.faces))
    out[good] = np.sqrt(sum(x * x for row in rows for x in row))
    return out
