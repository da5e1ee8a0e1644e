"""Meshes: vertices, faces, the grid if there is one, connectivity, closest points, cuts."""

from gso.mesh.mesh import Frame, Mesh

__all__ = ["Frame", "Mesh"]
