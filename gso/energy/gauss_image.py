"""Gaussian curvature by the normals of quads, at the interior vertices.

On coarse meshes quads can hide curvature by bending along their diagonals, where both
triangulations see little of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.energy.curvature import INVARIANT
from gso.geometry import image_curvature, quad_area_vectors
from gso.mesh import Mesh
from gso.mesh.topology import are_quads
from gso.typing import Array, S, Vec

__all__ = ["INVARIANT", "build", "residual"]


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the Gaussian curvature at the first point; the others are corners of its quads."""
    return (image_curvature(points[0], points[1:]),)


def build(mesh: Mesh) -> list[Term]:
    """Build one term for each number of quads at a vertex; weights sum to one over all vertices.

    Vertices of grids have equal weights; those of other meshes are weighted by the area of the
    quads around them. Vertices of triangles have none.
    """
    quad = are_quads(mesh.faces)
    if not quad.any():
        return []
    area = np.zeros(len(mesh.faces))
    area[quad] = np.linalg.norm(quad_area_vectors(mesh.vertices, mesh.faces[quad]), axis=1)
    he = mesh.half_edges
    around = np.bincount(he.origin, area[he.face], len(mesh.vertices)).astype(float)
    mixed = np.bincount(he.origin, ~quad[he.face], len(mesh.vertices)) > 0
    found = [(np.c_[c, ring][~mixed[c]], c[~mixed[c]]) for c, ring in mesh.face_stars]
    weights = [_weights(mesh, around[centre]) for _, centre in found]
    total = sum(float(w.sum()) for w in weights)
    return [
        Term("curvature", residual, (("surface", ids),), weights=weight / total)
        for (ids, _), weight in zip(found, weights, strict=True)
        if len(ids)
    ]


def _weights(mesh: Mesh, areas: Array) -> Array:
    return np.ones(len(areas)) if mesh.grid_index is not None else areas
