"""Meshes of trimesh, and other objects with vertices and faces."""

from __future__ import annotations

from typing import Any

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.mesh import Mesh

PACKAGE = "trimesh"


def is_mesh(x: Any) -> bool:
    """Tell whether it is one, or a scene."""
    return (hasattr(x, "vertices") and hasattr(x, "faces")) or _is_scene(x)


def _is_scene(x: Any) -> bool:
    return hasattr(x, "geometry") and hasattr(x, "to_mesh")


def surface(x: Any) -> Surface:
    """Return its surface.

    Raises
    ------
    MeshError
        It is a scene.
    """
    if _is_scene(x):
        raise MeshError("a trimesh.Scene is no single mesh; give scene.to_mesh()")
    return Surface(x.vertices, x.faces)


def make(mesh: Mesh) -> Any:
    """Make one, of triangles."""
    import trimesh

    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
