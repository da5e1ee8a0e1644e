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
    points, normals, faces = mesh.vertices, vertex_normals(mesh), mesh.faces
    side = np.stack([points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2)], axis=2)
    turn = np.stack([normals[faces[:, k]] - normals[faces[:, 0]] for k in (1, 2)], axis=2)
    up = geometry.area_vectors(points, faces)
    size = np.linalg.norm(up, axis=1)
    along = side[:, :, 0] / np.maximum(np.linalg.norm(side[:, :, 0], axis=1, keepdims=True), 1e-300)
    across = np.cross(up / np.maximum(size, 1e-300)[:, None], along)
    frame = np.stack([along, across], axis=1)
    sides, turns = frame @ side, frame @ turn
    good = size > 1e-12 * max(float(size.max(initial=0.0)), 1e-300)
    sides[~good] = np.eye(2)
    turns[~good] = 0.0
    shape = np.swapaxes(np.linalg.solve(np.swapaxes(sides, 1, 2), np.swapaxes(turns, 1, 2)), 1, 2)
    return np.asarray(np.linalg.norm(shape, axis=(1, 2)))
