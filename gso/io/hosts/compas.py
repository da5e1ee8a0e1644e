"""Meshes of COMPAS: ``compas.datastructures.Mesh``."""

from __future__ import annotations

from typing import Any

from gso.io.polygons import are_polygons, face_rows, of_polygons
from gso.io.raw_surface import Surface
from gso.mesh import Mesh

PACKAGE = "compas"


def is_mesh(x: Any) -> bool:
    """Tell whether it is one."""
    return callable(getattr(x, "to_vertices_and_faces", None))


def surface(x: Any) -> Surface:
    """Return its surface; vertices are numbered in the order of their keys."""
    points, faces = x.to_vertices_and_faces()
    return of_polygons(points, faces) if are_polygons(faces) else Surface(points, faces)


def make(mesh: Mesh) -> Any:
    """Make one; vertices and faces keep their numbers as keys."""
    from compas.datastructures import Mesh as CompasMesh

    return CompasMesh.from_vertices_and_faces(mesh.vertices.tolist(), face_rows(mesh.faces))
