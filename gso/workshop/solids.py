"""Folded parts as solids of the sheet's thickness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.geometry import area_vectors
from gso.geometry.vectors import unit
from gso.mesh import Mesh
from gso.typing import Array
from gso.workshop.panels import Panel
from gso.workshop.thickness import Thickness

#: Share of the largest singular value below which normals count as equal.
_FLAT = 1e-6


def folded_solids(
    panels: Sequence[Panel], scale: float, thickness: Thickness
) -> list[tuple[str, Mesh]]:
    """Return the folded panels of a design as closed meshes, in millimetres, with their names.

    Parameters
    ----------
    panels : sequence of Panel
        In the design's unit.
    scale : float
        Millimetres per unit of length of the design.
    thickness : Thickness
        In millimetres; it says on which side of the surface the sheet is, too.
    """
    below = {"middle": 0.5, "outside": 1.0, "inside": 0.0}[thickness.face] * thickness.sheet
    out = []
    for panel in panels:
        surface = panel.surface.replaced(scale * panel.surface.vertices)
        out.append((panel.name, thick(surface, below, thickness.sheet)))
    return out


def thick(surface: Mesh, below: float, sheet: float) -> Mesh:
    """Return a closed mesh between two surfaces that are parallel to a surface.

    Each face is moved along its normal, so that all are as thick as the sheet; at folds the sheet
    is mitred.

    Parameters
    ----------
    surface : Mesh
    below : float
        Distance of the lower surface.
    sheet : float
        Distance of both.

    Examples
    --------
    >>> flat = Mesh([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2, 3]])
    >>> float(np.ptp(thick(flat, 1.0, 2.0).vertices[:, 2]))
    2.0
    """
    points, triangles = surface.vertices, surface.triangles
    way = _mitres(points, triangles)
    above = sheet - below
    n = len(points)
    rims = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in surface.boundary_loops]
    a, b = np.concatenate(rims).T
    # Boundary loops may run with or against the faces.
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2) @ [n, 1]
    with_faces = np.isin(a * n + b, edges)
    a, b = np.where(with_faces, a, b), np.where(with_faces, b, a)
    walls = np.concatenate([np.stack([b, a, a + n], axis=1), np.stack([b, a + n, b + n], axis=1)])
    return Mesh(
        np.concatenate([points + above * way, points - below * way]),
        np.concatenate([triangles, triangles[:, ::-1] + n, walls]),
    )


def _mitres(points: Array, triangles: np.ndarray) -> Array:
    """Return how vertices move when all their faces move by one along their normals.

    It is the shortest vector x with n x = 1 for the normals n of the faces of a vertex.
    """
    normal = unit(area_vectors(points, triangles))
    squares = np.zeros((len(points), 3, 3))
    sums = np.zeros((len(points), 3))
    for corner in range(3):
        np.add.at(squares, triangles[:, corner], normal[:, :, None] * normal[:, None, :])
        np.add.at(sums, triangles[:, corner], normal)
    inverse = np.linalg.pinv(squares, rcond=_FLAT, hermitian=True)
    return np.asarray(np.einsum("nij,nj->ni", inverse, sums))
