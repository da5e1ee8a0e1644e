"""Planes, and reflections at them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.typing import Array


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
