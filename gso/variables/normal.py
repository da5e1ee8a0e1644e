"""Offsets along the vertex normals of a reference surface: one unknown per vertex."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.variables.base import Array, Layout, Variables


def vertex_normals(mesh: Mesh) -> Array:
    """Area-weighted unit normals (n, 3) at the vertices of a mesh.

    Vertices without an area around them get the z direction.
    """
    v, t = mesh.vertices, mesh.triangles
    face = np.cross(v[t[:, 1]] - v[t[:, 0]], v[t[:, 2]] - v[t[:, 0]])
    total = np.stack(
        [sum(np.bincount(t[:, k], face[:, d], len(v)) for k in range(3)) for d in range(3)],
        axis=1,
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    up = np.broadcast_to([0.0, 0.0, 1.0], total.shape)
    return np.divide(total, length, out=up.copy(), where=length > 0)


def normal_offsets(layout: Layout, points: Array, normals: Array) -> Variables:
    """Vertex = point + unknown * normal, on the block "surface".

    Parameters
    ----------
    points, normals : ndarray, (n, 3)
        Where the lines start and which way they run.
    """
    from scipy.sparse import csr_matrix

    n = len(points)
    basis = csr_matrix(
        (normals.ravel(), np.repeat(np.arange(n), 3), np.arange(3 * n + 1)), shape=(3 * n, n)
    )
    return Variables(layout, basis, layout.pack({"surface": points}))
