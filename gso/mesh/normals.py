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
    v, he = mesh.vertices, mesh.half_edges
    four = topology.four_corners(mesh.faces)
    whole = geometry.quad_area_vectors(v, four)
    # A triangle belongs to both triangulations, so it counts twice.
    whole[~topology.are_quads(mesh.faces)] *= 2.0
    tri = topology.corner_triangles(topology.by_size(mesh.faces)[0])
    corner, first = geometry.area_vectors(v, tri), np.ascontiguousarray(tri[:, 0])
    n = len(v)
    x, y, z = total = [
        np.bincount(he.origin, whole[:, d][he.face], n) + np.bincount(first, corner[:, d], n)
        for d in range(3)
    ]
    length = np.sqrt(x * x + y * y + z * z)
    none = length == 0
    z[none] = length[none] = 1.0
    return np.stack([c / length for c in total], axis=1)
