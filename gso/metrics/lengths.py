"""Lengths and the isometry defect of flat images."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.metrics.surfaces import (
    SurfaceLike,
    cells_of,
    components,
    faces_of,
    image_of,
    mesh_of,
    points_of,
    unit,
)
from gso.typing import Array


def isometry_defect(
    surface: SurfaceLike, flat: SurfaceLike, *, scale: float | None = None
) -> Array:
    """Return the defect ``||a|-|a'|| + ||b|-|b'|| + |a.b - a'.b'|`` of every quad cell (c,)."""
    scale = unit(surface) if scale is None else scale
    cells = cells_of(surface)
    p = points_of(surface) / scale
    q = image_of(surface, flat) / scale
    a, b = geometry.diagonals(*(components(p[cells[:, k]]) for k in range(4)))
    a2, b2 = geometry.diagonals(*(components(q[cells[:, k]]) for k in range(4)))
    return np.asarray(np.abs(np.stack(geometry.isometry_defect(a, b, a2, b2))).sum(axis=0))


def loss_iso_cell(surface: SurfaceLike, flat: SurfaceLike, *, scale: float | None = None) -> float:
    """Return the mean isometry defect of the quad cells, in the unit ball (published, Table 2).

    It does not detect folding, nor a shift of the two checkerboard sub-lattices against each
    other: read it together with strain and inverted cells. NaN on a mesh without quads.
    """
    defect = isometry_defect(surface, flat, scale=scale)
    return float(defect.mean()) if defect.size else float("nan")


def isometry_energy(surface: SurfaceLike, flat: SurfaceLike) -> float:
    """Return the mean over the faces of E_iso (Jiang et al. 2020), dimensionless.

    E_iso sums the squared differences of the squared diagonals and of their inner product (for
    triangles: of the squared sides). The mean is divided by the squared mean of the surface's
    squared lengths. Its square root is about twice the strain.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> isometry_energy(grid, grid[..., :2])
    0.0
    """
    p, q = points_of(surface), image_of(surface, flat)
    differences, squares = [], []
    for some in topology.by_size(faces_of(surface)):
        here, there = (
            np.stack(
                np.broadcast_arrays(*geometry.face_products(*(components(x[k]) for k in some.T)))
            )
            for x in (p, q)
        )
        differences.append(((here - there) ** 2).sum(axis=0))
        squares.append(here[: 2 if some.shape[1] == 4 else 3].ravel())
    return float(np.concatenate(differences).mean() / np.concatenate(squares).mean() ** 2)


def edge_length_error(surface: SurfaceLike, flat: SurfaceLike) -> float:
    """Return the mean of |l'/l - 1| over the mesh edges."""
    mesh = mesh_of(surface)
    a, b = mesh.edges.T
    q = image_of(surface, flat)
    before = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    after = np.linalg.norm(q[a] - q[b], axis=1)
    ok = before > 0
    return float(np.abs(after[ok] / before[ok] - 1.0).mean())
