"""Directions that strips are asked to run along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, Polylines
from gso.typing import Array

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Along:
    """A direction (1, 3), or a polyline (n, 3) that strips nearby follow.

    Attributes
    ----------
    points : ndarray, (n, 3)
    """

    points: Array

    @classmethod
    def of(cls, given: str | ArrayLike | None) -> Along | None:
        """Read what a user gave: a name of an axis, a vector, also as "1,1,0", or points.

        Raises
        ------
        OptionError
            It is none of these.

        Examples
        --------
        >>> Along.of("y").points
        array([[0., 1., 0.]])
        """
        if given is None:
            return None
        wrong = OptionError(
            f"along is {given!r}; it must be 'x', 'y', 'z', a vector of three numbers, or the "
            "points (n, 3) of a line"
        )
        if isinstance(given, str):
            given = _AXES.get(given, given.split(","))
        try:
            points = np.asarray(given, np.float64)
        except (TypeError, ValueError):
            raise wrong from None
        points = points[None] if points.ndim == 1 else points
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise wrong
        if len(points) > 1:
            points = points[np.r_[True, lengths(np.diff(points, axis=0)) > 0]]
            points = points if len(points) > 1 else 0.0 * points
        if not points.any():
            raise wrong
        return cls(points)

    def moved(self, origin: Array, size: float) -> Along:
        """Return it where a point is the origin and a length is one."""
        return self if len(self.points) == 1 else Along((self.points - origin) / size)

    def directions(self, mesh: Mesh) -> Array:
        """Return unit directions (m, 3) at the faces of a mesh."""
        points, faces = self.points, mesh.faces
        if len(points) == 1:
            return np.repeat(unit(points), len(faces), axis=0)
        lines = Polylines.of(points, closed=False)
        kept = (faces >= 0)[..., None]
        middle = (mesh.vertices[faces] * kept).sum(axis=1) / kept.sum(axis=1)
        return lines.way[lines.nearest(middle).segment]
