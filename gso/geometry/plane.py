"""Planes, and reflections at them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.polygon import area_vector
from gso.geometry.vectors import unit
from gso.typing import Array

#: Relative difference of distances that count as the same.
_SAME = 1e-6


@dataclass(frozen=True)
class Plane:
    """The plane of the points x with ``normal @ x == offset``, and the reflection at it.

    Examples
    --------
    >>> Plane(np.array([1.0, 0, 0]), 2.0).image(np.array([[5.0, 1, 1]])).tolist()
    [[-1.0, 1.0, 1.0]]
    """

    normal: Array
    offset: float

    def height(self, points: Array) -> Array:
        """Return the signed distances of points (k, 3)."""
        return np.asarray(points @ self.normal - self.offset)

    def image(self, points: Array) -> Array:
        """Return reflected points (k, 3)."""
        return np.asarray(points - 2.0 * np.outer(self.height(points), self.normal))

    def image_of_vectors(self, vectors: Array) -> Array:
        """Return reflected displacements (k, 3)."""
        return np.asarray(vectors - 2.0 * np.outer(vectors @ self.normal, self.normal))


def loop_axes(loop: Array) -> Array:
    """Return axes (3, 3) of the plane of a closed polygon (k, 3): two in it, and the normal.

    The normal is that of the polygon's area, from where it is anticlockwise. The first axis is
    towards the corner that is farthest from the middle, so that axes turn with the polygon.

    >>> loop_axes(np.array([[3.0, 0, 1], [0, 1, 1], [-3, 0, 1], [0, -1, 1]])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    away = loop - loop.mean(axis=0)
    normal = unit(area_vector(loop))
    away = away - np.outer(away @ normal, normal)
    far = np.linalg.norm(away, axis=1)
    first = unit(away[int((far > (1.0 - _SAME) * far.max()).argmax())])
    return np.stack([first, np.cross(normal, first), normal])
