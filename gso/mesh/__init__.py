"""Meshes: vertices, faces, the grid if there is one, connectivity, closest points, cuts."""

from gso.mesh.attributes import Attributes, Labels
from gso.mesh.closest_point import Nearest
from gso.mesh.cut import Cut, cut, joining
from gso.mesh.given_surfaces import GivenSurface, GivenSurfaces
from gso.mesh.mesh import Frame, Mesh
from gso.mesh.normals import vertex_normals
from gso.mesh.paths import Paths
from gso.mesh.polyline import Polylines
from gso.mesh.separation import between
from gso.mesh.welding import collapse, equal, near

__all__ = [
    "Attributes",
    "Cut",
    "Frame",
    "GivenSurface",
    "GivenSurfaces",
    "Labels",
    "Mesh",
    "Nearest",
    "Paths",
    "Polylines",
    "between",
    "collapse",
    "cut",
    "equal",
    "joining",
    "near",
    "vertex_normals",
]
