"""Meshes of meshio: ``meshio.Mesh``."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.mesh.topology import are_quads

PACKAGE = "meshio"
#: Corners of the faces of each type; further nodes of curved ones are left out.
_CORNERS = {
    "triangle": 3,
    "triangle6": 3,
    "triangle7": 3,
    "quad": 4,
    "quad8": 4,
    "quad9": 4,
}
#: Types that are no faces, and are left out.
_OTHERS = ("vertex", "line", "line3")


def is_mesh(x: Any) -> bool:
    """Tell whether it is one."""
    return hasattr(x, "points") and hasattr(x, "cells_dict")


def surface(x: Any) -> Surface:
    """Return its triangles and quads, in the order of the blocks.

    Raises
    ------
    MeshError
        There are none, or there are solids or polygons.
    """
    tables, notes = [], []
    for block in x.cells:
        kind, table = block.type, np.asarray(block.data)
        if kind in _CORNERS:
            corners = _CORNERS[kind]
            if table.shape[1] > corners:
                notes.append(f"{len(table)} faces {kind!r} are taken as flat: their corners only")
            padded = np.full((len(table), 4), -1)
            padded[:, :corners] = table[:, :corners]
            tables.append(padded)
        elif kind not in _OTHERS:
            raise MeshError(
                f"a meshio mesh has cells {kind!r}; give its surface, of {', '.join(_CORNERS)}"
            )
    if not tables:
        raise MeshError("the meshio mesh has no triangles or quads")
    faces = np.concatenate(tables)
    points = np.asarray(x.points, float)
    if points.shape[1] == 2:
        points = np.pad(points, ((0, 0), (0, 1)))
    return Surface(points, faces if (faces[:, 3] >= 0).any() else faces[:, :3], tuple(notes))


def make(mesh: Mesh) -> Any:
    """Make one, with the triangles of a mixed mesh before the quads."""
    import meshio

    quads = are_quads(mesh.faces)
    cells = [("triangle", mesh.faces[~quads, :3])] if (~quads).any() else []
    cells += [("quad", mesh.faces[quads])] if quads.any() else []
    return meshio.Mesh(mesh.vertices, cells)
