"""Two tangents at every vertex, which vary as smoothly over the surface as its normals."""

from __future__ import annotations

import numpy as np

from gso.typing import Array

#: Length of the projected axis below which another axis is taken.
_STEEP = 0.1


def tangents(normals: Array) -> tuple[Array, Array]:
    """Return two orthonormal tangents (n, 3) at vertices with unit normals (n, 3).

    The first is the projection of one axis for all vertices: the one that is most nearly a tangent
    everywhere. Displacements along neighbouring tangents are then along neighbouring directions.
    Where it is a normal, another axis is taken.

    Examples
    --------
    >>> first, second = tangents(np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]))
    >>> bool(np.allclose(first, [1, 0, 0]) or np.allclose(first, [-1, 0, 0]))
    True
    """
    axes = np.linalg.eigh(normals.T @ normals)[1]
    along = axes[:, 0] - (normals @ axes[:, 0])[:, None] * normals
    other = axes[:, 1] - (normals @ axes[:, 1])[:, None] * normals
    length = np.linalg.norm(along, axis=1, keepdims=True)
    first = np.where(length > _STEEP, along, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)
