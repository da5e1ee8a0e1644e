"""Areas, and inverted faces of flat images."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.mesh import Mesh, topology
from gso.metrics.surfaces import SurfaceLike, faces_of, image_of, in_range, points_of
from gso.typing import Array, Flags, Ints


def area(mesh: Mesh, points: Array | None = None) -> float:
    """Return the area of a surface, or of its image (n, 2) or (n, 3) if `points` is given.

    >>> from gso.mesh import Mesh
    >>> area(Mesh.from_grid(np.dstack([*np.mgrid[:3.0, :4.0], np.zeros((3, 4))])))
    6.0
    """
    v = mesh.vertices if points is None else points
    v = np.pad(v, ((0, 0), (0, 3 - v.shape[1])))
    return float(0.5 * geometry.doubled_areas(v, mesh.triangles).sum())


def face_areas(mesh: Mesh) -> Array:
    """Return the area of each face (m,), of quads half the cross product of their diagonals.

    >>> from gso.mesh import Mesh
    >>> face_areas(Mesh.from_grid(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])))
    array([1., 1., 1., 1.])
    """
    if mesh.faces.shape[1] == 3:
        doubled = geometry.doubled_areas(mesh.vertices, mesh.faces)
    else:
        corners = topology.four_corners(mesh.faces)
        doubled = np.linalg.norm(geometry.quad_area_vectors(mesh.vertices, corners), axis=1)
    return np.asarray(0.5 * doubled)


def area_error(surface: SurfaceLike, flat: SurfaceLike) -> float:
    """Return the mean of |A'/A - 1| over the corner triangles that have an area."""
    tri = topology.corner_triangles(faces_of(surface))
    p, q = in_range(points_of(surface), image_of(surface, flat))
    before, after = space_areas(p, tri), corner_areas(q, tri)
    keep = before > 1e-12 * before.max()
    return float(np.abs(after[keep] / before[keep] - 1.0).mean())


def flipped_cells(
    flat: SurfaceLike, faces: Ints | None = None, *, surface: SurfaceLike | None = None
) -> int:
    """Count the inverted cells in a flat image.

    A grid cell (`flat` is (H, W, 2)) is inverted when any of its four corner triangles has
    signed area <= 0. Any other quad (`flat` is (n, 2), `faces` given) may be concave; it is
    inverted when neither diagonal splits it into two triangles of positive area. A triangle
    is inverted when its signed area is <= 0. With `surface`, cells that have a corner without
    area in space are not counted.
    """
    image = np.asarray(flat, float)
    if faces is None and image.ndim != 3:
        raise MeshError("flipped_cells needs faces=... for an image that is no grid (H, W, 2)")
    points = image.reshape(-1, image.shape[-1])[:, :2]
    table = topology.grid_faces(*image.shape[:2]) if faces is None else faces
    space = None if surface is None else points_of(surface)
    return int(_flipped(points, table, space, grid=faces is None).sum())


def _flipped(points: Array, faces: Ints, space: Array | None, *, grid: bool) -> Flags:
    """Mark the faces (m,) that are inverted in an image (n, 2), quads first."""
    quads, tris = topology.by_size(faces)
    # Corners 1 and 3 are the split along the diagonal 0-2, corners 0 and 2 the other one.
    bad = corner_areas(points, quads).reshape(4, -1) <= 0
    turned = bad.any(axis=0) if grid else (bad[0] | bad[2]) & (bad[1] | bad[3])
    flipped: Flags = np.r_[turned, corner_areas(points, tris) <= 0]
    if space is not None and flipped.any():
        area = space_areas(space, quads).reshape(4, -1).min(axis=0, initial=np.inf)
        area = np.r_[area, space_areas(space, tris)]
        flipped &= area > 1e-12 * np.max(area, initial=0.0)
    return flipped


def flipped_faces(mesh: Mesh, flat: Array) -> Ints:
    """Find the faces of a mesh that are inverted in its flat image (n, 2).

    These are the faces that :func:`flips` counts.

    >>> from gso.mesh import Mesh
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> flipped_faces(Mesh(square, [[0, 1, 2, 3]]), square[:, 1::-1])
    array([0])
    """
    quad = topology.are_quads(mesh.faces)
    order = np.r_[np.flatnonzero(quad), np.flatnonzero(~quad)]
    grid = mesh.grid_index is not None
    return np.sort(order[_flipped(flat, mesh.faces, mesh.vertices, grid=grid)])


def flips(mesh: Mesh, flat: Array) -> int:
    """Count the inverted faces in a flat image (n, 2) of a mesh; see :func:`flipped_cells`."""
    return len(flipped_faces(mesh, flat))


def space_areas(points: Array, faces: Ints) -> Array:
    """Return the doubled areas of the corner triangles of faces in space."""
    return geometry.doubled_areas(points, topology.corner_triangles(faces))


def corner_areas(flat: Array, faces: Ints) -> Array:
    """Return the doubled signed areas of the faces' corner triangles in a flat image (n, 2)."""
    return geometry.signed_areas(flat, topology.corner_triangles(faces))
