"""Vertices, faces and lengths of the surfaces and images that metrics are given."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gso import geometry
from gso.errors import MeshError
from gso.mesh import Mesh, topology
from gso.typing import Array, Ints

#: A mesh, or a grid (H, W, 3); as an image also (H, W, 2) and (n, 2).
SurfaceLike = Mesh | ArrayLike


def components(points: Array) -> tuple[Array, ...]:
    """Split an array (..., d) into a tuple of its d components."""
    return tuple(points[..., k] for k in range(points.shape[-1]))


def points_of(surface: SurfaceLike) -> Array:
    """Return the vertices of a mesh or grid as (n, 3)."""
    points = surface.vertices if isinstance(surface, Mesh) else np.asarray(surface, float)
    return points.reshape(-1, points.shape[-1])


def used_points(surface: SurfaceLike) -> Array:
    """Return the vertices that belong to a face, (n, 3)."""
    if isinstance(surface, Mesh):
        return surface.vertices[surface.used]
    return points_of(surface)


def grid_of(surface: SurfaceLike) -> Array | None:
    """Return the grid array of a mesh or grid, or None."""
    if isinstance(surface, Mesh):
        return surface.grid
    points = np.asarray(surface, float)
    if points.ndim != 3:
        raise MeshError(f"expected a Mesh or a grid array (H, W, 3), not an array {points.shape}")
    return points


def mesh_of(surface: SurfaceLike) -> Mesh:
    return surface if isinstance(surface, Mesh) else Mesh.from_grid(surface)


def cells_of(surface: SurfaceLike) -> Ints:
    """Return the quad faces of a mesh or grid."""
    if isinstance(surface, Mesh):
        return topology.by_size(surface.faces)[0]
    return topology.grid_faces(*np.asarray(surface).shape[:2])


def faces_of(surface: SurfaceLike) -> Ints:
    return surface.faces if isinstance(surface, Mesh) else cells_of(surface)


def image_of(surface: SurfaceLike, flat: SurfaceLike) -> Array:
    """Return an image as (n, 2), or another surface as (n, 3), in the order of the vertices."""
    image = flat.vertices if isinstance(flat, Mesh) else np.asarray(flat, float)
    out = image if isinstance(flat, Mesh) else image.reshape(-1, image.shape[-1])[:, :2]
    count = len(points_of(surface))
    if len(out) != count:
        raise MeshError(f"the image has {len(out)} vertices and the surface {count}")
    index = surface.grid_index if isinstance(surface, Mesh) else None
    if image.ndim != 3 or index is None:
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


def unit(surface: SurfaceLike) -> float:
    """Return the largest distance of a vertex from the centroid: the default unit of length."""
    if isinstance(surface, Mesh):
        return surface.frame.scale
    return geometry.ball(points_of(surface))[1]
