"""Gauss image thinning (Binninger, Verhoeven, Herholz, Sorkine-Hornung 2021), developable task.

The Gauss image of a developable surface is a set of curves. Local step: around each face the
normals of its neighbourhood are fitted by a line in the tangent plane of the sphere, and the
face's normal is moved onto it. Global step: the vertices for which the triangles, rotated to
these normals, agree best, in the sense of least squares with cotangent weights. There is no
term of closeness but the rotations being small; the number of iterations limits the distance.

The local step is a line fit; the paper's follows curves on the sphere. Implemented here: no
installable package has it.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from gso.geometry import area_vectors
from report.method import Array, Method, Solved, combinations
from report.surfaces import Case


def thinned(case: Case, rings: int, iterations: int, closeness: float) -> Solved:
    """Make a case more developable.

    Parameters
    ----------
    case : Case
        The input.
    rings : int
        Size of the neighbourhood of a face, in rings of faces around vertices.
    iterations : int
        Pairs of a local and a global step.
    closeness : float
        Weight of the distance of vertices to the input, beside the mean cotangent weight.
    """
    given, faces = case.mesh.vertices, case.mesh.triangles[:, :3]
    corners = np.repeat(np.arange(len(faces)), 3)
    shape = (len(faces), len(given))
    touches = sparse.csr_matrix((np.ones(corners.size), (corners, faces.ravel())), shape)
    near = touches @ touches.T
    for _ in range(rings - 1):
        near = near @ near
    near.data[:] = 1.0
    near = sparse.diags(1.0 / np.asarray(near.sum(axis=1)).ravel()) @ near
    weight, ends = _cotangents(given, faces)
    stiffness = _laplacian(weight, ends, len(given))
    solver = splu((stiffness + closeness * sparse.identity(len(given))).tocsc())
    points = given
    for _ in range(iterations):
        normal = _normals(points, faces)
        turn = _rotations(normal, _aims(near, normal))
        edge = points[ends[..., 0]] - points[ends[..., 1]]
        wanted = weight[..., None] * np.einsum("fij,fkj->fki", turn, edge)
        right = closeness * given
        np.add.at(right, ends[..., 0], wanted)
        np.add.at(right, ends[..., 1], -wanted)
        points = solver.solve(right)
    return Solved(points.reshape(case.given.shape))


def _normals(points: Array, faces: Array) -> Array:
    vectors = area_vectors(points, faces)
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def _cotangents(points: Array, faces: Array) -> tuple[Array, Array]:
    """Return half the cotangent opposite each edge of each triangle, and the edges' ends."""
    ends = np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], axis=1)
    a, b = (points[ends[..., k]] - points[faces] for k in range(2))
    doubled = np.linalg.norm(np.cross(a, b), axis=-1)
    return 0.5 * np.sum(a * b, axis=-1) / np.maximum(doubled, 1e-300), ends


def _laplacian(weight: Array, ends: Array, count: int) -> sparse.csr_matrix:
    i, j, w = ends[..., 0].ravel(), ends[..., 1].ravel(), weight.ravel()
    rows, columns = np.r_[i, j, i, j], np.r_[i, j, j, i]
    return sparse.csr_matrix((np.r_[w, w, -w, -w], (rows, columns)), (count, count))


def _aims(near: sparse.csr_matrix, normal: Array) -> Array:
    """Move each normal onto the line fitted to those around it."""
    mean = near @ normal
    outer = (normal[:, :, None] * normal[:, None, :]).reshape(-1, 9)
    spread = (near @ outer).reshape(-1, 3, 3) - mean[:, :, None] * mean[:, None, :]
    axis = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    # Only the spread across the mean normal counts: it is that along and across the curve.
    flat = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    _, vectors = np.linalg.eigh(flat @ spread @ flat)
    across = np.cross(axis, vectors[:, :, 2])
    off = np.sum((normal - mean) * across, axis=1, keepdims=True)
    aim = normal - off * across
    return aim / np.linalg.norm(aim, axis=1, keepdims=True)


def _rotations(one: Array, other: Array) -> Array:
    """Return the smallest rotation of each unit vector to the other, as matrices (n, 3, 3)."""
    v, c = np.cross(one, other), np.sum(one * other, axis=1)
    cross = np.zeros((len(one), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = v
    cross[:, [1, 2, 0], [2, 0, 1]] = -v
    return np.eye(3) + cross + cross @ cross / (1.0 + c)[:, None, None]


METHODS = [
    Method(
        "Gauss image thinning",
        "developable",
        thinned,
        peer=True,
        pace="peer",
        note="after Binninger et al. 2021, tuned",
        needs=("scipy",),
        candidates=combinations(rings=2, iterations=(30, 100), closeness=(1e-5, 1e-4)),
    )
]
