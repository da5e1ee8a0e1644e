"""Normals at the vertices of a mesh."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.mesh.mesh import Mesh
from gso.typing import Array


def vertex_normals(mesh: Mesh) -> Array:
    """Return area-weighted unit normals (n, 3) at the vertices of a mesh.

    Mean over both triangulations of the quads: a quad that is split through the vertex
    contributes both triangles, otherwise only the corner triangle at the vertex. So a
    symmetric surface has symmetric normals, independently of its numbering. Vertices without
    an area around them get the z direction.
    """
    v, n = mesh.vertices, len(mesh.vertices)
    quads, triangles = topology.by_size(mesh.faces)
    around = geometry.quad_corner_vectors(v, quads) + geometry.quad_area_vectors(v, quads).T
    # A triangle belongs to both triangulations, so it counts twice.
    whole = 2.0 * geometry.area_vectors(v, triangles).T
    at = np.concatenate([quads.T.ravel(), triangles.T.ravel()])
    x, y, z = total = [
        np.bincount(at, np.concatenate([around[:, d].ravel(), np.tile(whole[d], 3)]), n)
        for d in range(3)
    ]
    length = np.sqrt(x * x + y * y + z * z)
    none = length == 0
    z[none] = length[none] = 1.0
    return np.stack([c / length for c in total], axis=1)
