"""Mirror symmetry of strips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.plane import Plane
from gso.typing import Array, Ints

#: Distance of a mirrored point from its partner, relative to the diagonal.
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Mirror(Plane):
    """A plane of symmetry of strips."""

    def partners(self, points: Array) -> Ints | None:
        """Return the point that each point (k, 3) is the image of; None if there is none."""
        from scipy.spatial import cKDTree

        away, partner = cKDTree(points).query(self.image(points))
        paired = (partner[partner] == np.arange(len(points))).all()
        return partner if away.max(initial=0.0) <= _TOLERANCE and paired else None

    def even_step(self, step: Array, partners: Ints) -> Array:
        """Return the means of displacements (k, 3) and the images of those of their partners."""
        other = step[partners]
        return np.asarray(0.5 * (step + self.image_of_vectors(other)))

    def arranged(self, index: Ints, points: Array) -> Array:
        """Move the ends of a sequence of rulings to the nearest symmetric places.

        Either each ruling is its own image, or the sequence is reversed by the reflection, with
        the ends of each ruling exchanged or not.

        Parameters
        ----------
        index : ndarray of int, (r, 2)
            Their ends.
        points : ndarray, (n, 3)
        """
        image = self.image(points)
        ways = [index[:, ::-1], index[::-1], index[::-1, ::-1]]
        far = [((points[index] - image[way]) ** 2).sum() for way in ways]
        out: Array = points.copy()
        out[index] = 0.5 * (points[index] + image[ways[int(np.argmin(far))]])
        return out
