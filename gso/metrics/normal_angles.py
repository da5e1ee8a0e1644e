"""Normals of faces and the angles between them."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.metrics.surfaces import SurfaceLike, components, faces_of, mesh_of, points_of
from gso.typing import Array


def face_normals(surface: SurfaceLike) -> Array:
    """Return unit normals (m, 3): for quads, of the diagonals' cross product; zero without area."""
    faces, p = faces_of(surface), points_of(surface)
    a, b = geometry.diagonals(*(components(p[c]) for c in topology.four_corners(faces).T))
    normal = np.stack(geometry.cross(a, b), axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0))


def dihedral_angles(surface: SurfaceLike) -> Array:
    """Return the angle between the normals of the two faces at every interior edge, degrees, (e,).

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> dihedral_angles(grid).max()
    np.float64(0.0)
    """
    mesh = mesh_of(surface)
    he, normal = mesh.half_edges, face_normals(mesh)
    inner = he.interior
    a, b = (components(normal[he.face[h]]) for h in (inner, he.twin[inner]))
    return np.asarray(np.degrees(geometry.angle(a, b)))


def normal_angle(clean: SurfaceLike, denoised: SurfaceLike) -> float:
    """Return the mean angle theta between the cell normals of two surfaces, degrees (Table 3)."""
    n1, n2 = face_normals(clean), face_normals(denoised)
    return float(np.degrees(geometry.angle(components(n1), components(n2))).mean())
