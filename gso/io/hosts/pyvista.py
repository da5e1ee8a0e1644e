"""Meshes of PyVista: ``pyvista.PolyData``."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.io.source import face_table
from gso.mesh import Mesh
from gso.mesh.validation import checked_vertices
from gso.typing import Ints

PACKAGE = "pyvista"


def is_mesh(x: Any) -> bool:
    """Tell whether it is one, or another data set of PyVista."""
    return hasattr(x, "points") and hasattr(x, "n_points") and hasattr(x, "n_cells")


def surface(x: Any) -> Surface:
    """Return its faces; those with five or more corners are cut into triangles.

    Raises
    ------
    MeshError
        It has none, or is no PolyData.
    """
    if not hasattr(x, "faces"):
        raise MeshError(f"a pyvista.{type(x).__name__} is no surface; give its extract_surface()")
    if getattr(x, "n_strips", 0):
        raise MeshError("the pyvista mesh has strips of triangles; give its triangulate()")
    corners, count = _polygons(np.asarray(x.faces))
    if not len(count):
        raise MeshError("the pyvista mesh has no faces")
    points = checked_vertices(np.asarray(x.points, float))
    faces, polygon, notes = face_table(corners, count, points)
    return Surface(points, faces, notes, polygon=polygon)


def _polygons(cells: Ints) -> tuple[Ints, Ints]:
    """Return the corners of all polygons, and their number in each.

    Cells are the number of corners and the corners, polygon after polygon.
    """
    # All polygons have as many corners, or their starts are found one by one.
    if len(cells) and len(cells) % (cells[0] + 1) == 0:
        table = cells.reshape(-1, cells[0] + 1)
        if (table[:, 0] == cells[0]).all():
            return table[:, 1:].ravel(), table[:, 0]
    starts, at, given = [], 0, cells.tolist()
    while at < len(given):
        starts.append(at)
        at += given[at] + 1
    return np.delete(cells, starts), cells[starts]


def make(mesh: Mesh) -> Any:
    """Make one."""
    import pyvista

    count = (mesh.faces >= 0).sum(axis=1)
    table = np.concatenate([count[:, None], mesh.faces], axis=1)
    return pyvista.PolyData(mesh.vertices.copy(), table[table >= 0])
