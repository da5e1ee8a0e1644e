"""Bilateral filtering of face normals (Zheng, Fu, Au, Tai 2011), and vertices that follow them.

This is the local, iterative scheme. Each face's normal becomes the mean of those of the faces
that share a vertex with it, weighted by area, by the distance of the centroids and by the
difference of the normals. Vertices are then moved by the update of Sun et al. 2007. Both are
implemented here: no installable package has them.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gso.geometry import area_vectors
from report.method import Array, Method, Solved, combinations
from report.surfaces import Case


def bilateral(case: Case, steepness: float, passes: int, updates: int) -> Solved:
    """Denoise a case.

    Parameters
    ----------
    case : Case
        The input.
    steepness : float
        Standard deviation of the Gaussian of differences of normals.
    passes : int
        Passes over the normals.
    updates : int
        Updates of the vertices for the filtered normals.
    """
    points, faces = case.mesh.vertices, case.mesh.triangles[:, :3]
    area, normal, centre = _faces(points, faces)
    corners = np.repeat(np.arange(len(faces)), 3)
    shape = (len(faces), len(points))
    touches = sparse.csr_matrix((np.ones(corners.size), (corners, faces.ravel())), shape)
    pairs = (touches @ touches.T).tocoo()
    i, j = pairs.row, pairs.col
    apart = np.linalg.norm(centre[i] - centre[j], axis=1)
    spread = apart[(pairs.data >= 2) & (i != j)].mean()
    fixed = area[j] * np.exp(-0.5 * (apart / spread) ** 2)
    for _ in range(passes):
        differ = np.sum((normal[i] - normal[j]) ** 2, axis=1)
        weight = fixed * np.exp(-0.5 * differ / steepness**2)
        mean = sparse.csr_matrix((weight, (i, j)), pairs.shape) @ normal
        normal = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    share = 1.0 / np.asarray(touches.sum(axis=0)).ravel()[:, None]
    for _ in range(updates):
        centre = points[faces].mean(axis=1)
        # Sum over the faces of a vertex of n n^T (centre - vertex).
        height = np.sum(normal * centre, axis=1)[:, None] * normal
        outer = (normal[:, :, None] * normal[:, None, :]).reshape(-1, 9)
        at = (touches.T @ outer).reshape(-1, 3, 3)
        points = points + share * (touches.T @ height - np.einsum("nij,nj->ni", at, points))
    return Solved(points.reshape(case.given.shape))


def _faces(points: Array, faces: Array) -> tuple[Array, Array, Array]:
    """Return areas, unit normals and centroids of triangles."""
    vectors = area_vectors(points, faces)
    size = np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)
    return 0.5 * size, vectors / size[:, None], points[faces].mean(axis=1)


METHODS = [
    Method(
        "bilateral normals",
        "denoise",
        bilateral,
        peer=True,
        pace="slow",
        note="Zheng et al. 2011, tuned for each level",
        needs=("scipy",),
        candidates=combinations(steepness=(0.4, 0.8), passes=(3, 10, 30), updates=(20, 60)),
    )
]
