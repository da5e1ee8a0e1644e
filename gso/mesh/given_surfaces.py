"""Surfaces of a CAD file that the faces of a mesh lie on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gso.typing import Array, Flags, Ints


@dataclass(frozen=True, eq=False)
class GivenSurface:
    """One face of a CAD file.

    Attributes
    ----------
    name : str
        Its number in the file and its kind, such as "face 3 (sphere)".
    kind : str
        "plane", "cylinder", "cone", "sphere", "torus", or "surface" for any other.
    round : ndarray, (8,), or None
        Of a cylinder or cone: a point on the axis, the axis as a unit vector, the radius at the
        point, and the growth of the radius per length along the axis, which is not negative.
    rulings : ndarray, (r, 8), or None
        Of any other torsal surface: rulings in the plane of the unrolled corners, one after the
        other. Start and end; the angle by which the surface has turned up to there, in radians;
        1 where it is convex, -1 where it is concave; the radii of curvature at start and end.
    """

    name: str
    kind: str
    round: Array | None = None
    rulings: Array | None = None

    @property
    def is_developable(self) -> bool:
        """Whether it is a plane, a cylinder, a cone or another torsal surface."""
        return self.kind == "plane" or self.round is not None or self.rulings is not None


@dataclass(frozen=True, eq=False)
class GivenSurfaces:
    """The surfaces of a CAD file, and which triangles are on them.

    Attributes
    ----------
    surfaces : tuple of GivenSurface
    of_face : ndarray of int, (m,)
        Place in `surfaces` for each triangle.
    unrolled : ndarray, (m, 3, 2)
        Corners of the triangles of torsal surfaces in the plane; NaN on others.
    normals : ndarray, (m, 3, 3)
        Unit normals of torsal surfaces at the corners, of either sign; NaN on others.
    """

    surfaces: tuple[GivenSurface, ...]
    of_face: Ints
    unrolled: Array
    normals: Array

    def taken(self, faces: Ints, turns: Ints | None = None) -> GivenSurfaces:
        """Select triangles; `turns` (p, 3) has the old corner of each new one."""
        flat, normals = self.unrolled[faces], self.normals[faces]
        if turns is not None:
            order = turns[:, :3, None]
            flat, normals = (np.take_along_axis(x, order, axis=1) for x in (flat, normals))
        return replace(self, of_face=self.of_face[faces], unrolled=flat, normals=normals)

    @property
    def is_developable(self) -> Flags:
        """Which of the surfaces are developable."""
        return np.array([surface.is_developable for surface in self.surfaces], bool)
