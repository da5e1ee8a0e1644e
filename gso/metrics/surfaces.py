"""Vertices, faces and lengths of the surfaces and images that metrics are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.mesh import topology
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from gso.mesh import Mesh


def components(points: Array) -> tuple[Array, ...]:
    """Split an array (..., d) into a tuple of its d components."""
    return tuple(points[..., k] for k in range(points.shape[-1]))


def points_of(surface: Any) -> Array:
    """Return the vertices of a mesh or grid as (n, 3)."""
    points = surface.vertices if hasattr(surface, "vertices") else np.asarray(surface, float)
    return points.reshape(-1, points.shape[-1])


def used_points(surface: Any) -> Array:
    """Return the vertices that belong to a face, (n, 3)."""
    return surface.vertices[surface.used] if hasattr(surface, "used") else points_of(surface)


def grid_of(surface: Any) -> Array | None:
    """Return the grid array of a mesh or grid, or None."""
    if hasattr(surface, "grid"):
        return surface.grid
    points = np.asarray(surface, float)
    if points.ndim != 3:
        raise MeshError(f"expected a Mesh or a grid array (H, W, 3), not an array {points.shape}")
    return points


def mesh_of(surface: Any) -> Mesh:
    from gso.mesh import Mesh

    return surface if isinstance(surface, Mesh) else Mesh.from_grid(surface)


def cells_of(surface: Any) -> Ints:
    """Return the quad faces of a mesh or grid."""
    if not hasattr(surface, "faces"):
        return topology.grid_faces(*np.asarray(surface).shape[:2])
    return topology.by_size(surface.faces)[0]


def faces_of(surface: Any) -> Ints:
    return surface.faces if hasattr(surface, "faces") else cells_of(surface)


def image_of(surface: Any, flat: Any) -> Array:
    """Return an image as (n, 2), or another surface as (n, 3), in the order of the vertices."""
    if hasattr(flat, "vertices"):
        out = flat.vertices
    else:
        image = np.asarray(flat, float)
        out = image.reshape(-1, image.shape[-1])[:, :2]
    count = len(points_of(surface))
    if len(out) != count:
        raise MeshError(f"the image has {len(out)} vertices and the surface {count}")
    index = getattr(surface, "grid_index", None)
    if hasattr(flat, "vertices") or image.ndim != 3 or index is None:
        return out
    ordered = np.empty_like(out)
    ordered[index.ravel()] = out
    return ordered


def in_range(p: Array, q: Array) -> tuple[Array, Array]:
    """Rescale a surface and its image so that fourth powers of lengths do not overflow.

    The unit is a power of two, so the ratios are exact.
    """
    unit = 2.0 ** np.floor(np.log2(np.ptp(p, axis=0).max() or 1.0))
    return p / unit, q / unit


def unit(surface: Any) -> float:
    """Return the largest distance of a vertex from the centroid: the default unit of length."""
    if hasattr(surface, "frame"):
        return surface.frame.scale
    return geometry.ball(points_of(surface))[1]
