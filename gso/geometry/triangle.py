"""Areas of triangles and quads, of arrays of points and faces."""

from __future__ import annotations

import numpy as np

from gso.geometry.cells import corner_area2
from gso.geometry.vector import angle, cross, norm2, sub
from gso.typing import Array, Ints, Vec


def area_vectors(points: Array, triangles: Ints) -> Array:
    """Return the doubled areas of triangles times their unit normals, (t, 3).

    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0]])
    >>> area_vectors(corners, np.array([[0, 1, 2]]))
    array([[0., 0., 6.]])
    """
    return np.stack(_area_vectors(points, triangles), axis=1)


def doubled_areas(points: Array, triangles: Ints) -> Array:
    """Return the doubled areas (t,) of triangles of points (n, 3)."""
    return np.asarray(np.sqrt(norm2(_area_vectors(points, triangles))))


def _area_vectors(points: Array, triangles: Ints) -> Vec[Array]:
    p, q, r = corners(points, triangles)
    return cross(sub(q, p), sub(r, p))


def signed_areas(flat: Array, triangles: Ints) -> Array:
    """Return the doubled signed areas (t,) of triangles of points (n, 2)."""
    return corner_area2(*corners(flat, triangles))


def quad_area_vectors(points: Array, quads: Ints) -> Array:
    """Return the doubled area vectors (q, 3) of quads: the products of their diagonals."""
    v0, v1, v2, v3 = corners(points, quads)
    return np.stack(cross(sub(v2, v0), sub(v3, v1)), axis=1)


def quad_corner_vectors(points: Array, quads: Ints) -> Array:
    """Return the doubled area vectors (4, 3, q) of the triangles at the corners of quads.

    The triangle at a corner has it and both its neighbours as vertices.

    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> quad_corner_vectors(square, np.array([[0, 1, 2, 3]]))[:, 2, 0]
    array([1., 1., 1., 1.])
    """
    v = corners(points, quads)
    sides = [sub(v[(k + 1) % 4], v[k]) for k in range(4)]
    return np.stack([np.stack(cross(sides[k - 1], sides[k])) for k in range(4)])


def corners(points: Array, faces: Ints) -> list[Vec[Array]]:
    """Return the corners (k) of faces (m, k) as component arrays (m,), which are contiguous."""
    rows = np.ascontiguousarray(points.T)
    columns = (np.ascontiguousarray(c) for c in faces.T)
    return [tuple(row.take(c) for row in rows) for c in columns]


def corner_angles(points: Array, triangles: Ints) -> Array:
    """Return the angles (t, 3) of triangles of points (n, 2 or 3), in radians.

    >>> np.degrees(corner_angles(np.array([[0.0, 0], [1, 0], [0, 1]]), np.array([[0, 1, 2]])))
    array([[90., 45., 45.]])
    """
    own = [points[triangles[:, k]] for k in range(3)]
    out = np.empty(triangles.shape)
    for k, here in enumerate(own):
        a, b = ((own[(k + step) % 3] - here).T for step in (1, 2))
        out[:, k] = angle(tuple(a), tuple(b))
    return out
