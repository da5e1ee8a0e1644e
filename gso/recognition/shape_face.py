"""Records of what was recognised: the faces of a shape, and its mesh."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from gso.recognition.bend_lines import BendLine
from gso.recognition.edge_arcs import arc_angles
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: Kinds of faces.
Kind = Literal["plane", "cylinder", "cone", "torsal", "free"]


@dataclass(frozen=True)
class ShapeFace:
    """One face of a shape: triangles on one surface.

    Attributes
    ----------
    kind : str
        "plane", "cylinder" (circular), "cone" (circular or not), "torsal" (any other surface with
        straight rulings along which its normals are constant), or "free" (not developable).
    triangles : ndarray of int, (k,)
        Rows of :attr:`Recognised.triangles`.
    flat : ndarray, (k, 3, 2), or None
        Corners of the triangles in the plane, as seen from the side of their normals; None for a
        free face. On cylinders and circular cones lengths are those of the surface: two vertices
        of a circle are as far apart as the arc is long.
    surface : RoundSurface or None
        Equation of a cylinder or of a circular cone.
    axis : ndarray, (3,), or None
        Unit normal of a plane, axis of a cylinder or circular cone, direction of parallel rulings.
    apex : ndarray, (3,), or None
        Point of a cone that all its rulings pass.
    deviation : float
        Largest distance of a vertex from the surface, in the unit of the mesh.
    normal_deviation : float
        Largest angle between a triangle's normal and the surface's at its middle, in radians.
    strain : float
        Largest strain between the triangles and their flat image; 0 where it is by equation.
    seam : ndarray of int, (s, 2)
        Vertices at the ends of edges along which a face that closes around was opened.
    bend_lines : tuple of BendLine
        In the plane of `flat`.
    bend_angle : float
        Angle by which the face turns in all, in radians; 0 for planes and free faces.
    normals : (ndarray of int, ndarray), or None
        Vertices (n,), increasing, of a torsal face of a CAD file, and unit normals (n, 3) of its
        surface there.
    """

    kind: Kind
    triangles: Ints
    flat: Array | None = None
    surface: RoundSurface | None = None
    axis: Array | None = None
    apex: Array | None = None
    deviation: float = 0.0
    normal_deviation: float = 0.0
    strain: float = 0.0
    seam: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    bend_lines: tuple[BendLine, ...] = ()
    bend_angle: float = 0.0
    normals: tuple[Ints, Array] | None = None

    def normals_at(self, vertices: Ints) -> Array:
        """Return :attr:`normals` at vertices (...,), NaN where there are none; (..., 3)."""
        if self.normals is None:
            return np.full((*vertices.shape, 3), np.nan)
        known, normals = self.normals
        at = np.minimum(np.searchsorted(known, vertices), len(known) - 1)
        return np.where((known[at] == vertices)[..., None], normals[at], np.nan)

    @property
    def radius(self) -> float | None:
        """Radius of a cylinder; None for other kinds."""
        cylinder = self.surface is not None and self.kind == "cylinder"
        return self.surface.radius if cylinder and self.surface is not None else None

    @property
    def half_angle(self) -> float | None:
        """Angle between axis and rulings of a circular cone, in radians; None for other kinds."""
        cone = self.surface is not None and self.kind == "cone"
        return self.surface.half_angle if cone and self.surface is not None else None


@dataclass(frozen=True)
class Recognised:
    """A mesh divided into faces.

    Attributes
    ----------
    vertices : ndarray, (n, 3)
        Those of the mesh; where seams were cut across triangles, new ones follow.
    triangles : ndarray of int, (t, 3)
    source : ndarray of int, (t,)
        Row of ``mesh.triangles`` that each triangle is, or is a part of.
    faces : tuple of ShapeFace
        Each triangle belongs to one.
    tolerance : float
        Distance within which vertices count as on a surface, in the unit of the mesh.
    """

    vertices: Array
    triangles: Ints
    source: Ints
    faces: tuple[ShapeFace, ...]
    tolerance: float

    @property
    def chord(self) -> float:
        """Largest distance of an edge's middle from its cylinder or circular cone."""
        found = [0.0]
        for face in self.faces:
            if face.surface is not None:
                corners = self.vertices[self.triangles[face.triangles]]
                middle = 0.5 * (corners + np.roll(corners, 1, axis=1))
                found.append(float(np.abs(face.surface.distances(middle.reshape(-1, 3))).max()))
        return max(found)

    @cached_property
    def face(self) -> Ints:
        """Number of the face of each triangle, (t,)."""
        number = np.full(len(self.triangles), -1)
        for k, face in enumerate(self.faces):
            number[face.triangles] = k
        return number

    @cached_property
    def developable(self) -> Flags:
        """Which triangles have a flat image, (t,)."""
        flat = np.array([face.flat is not None for face in self.faces])
        return flat[self.face]

    @cached_property
    def arcs(self) -> Array:
        """Angle of the arc that each edge is in the flat image, (t, 3), in radians.

        Of the edge from corner k to corner k + 1, positive where the arc runs anticlockwise, 0
        where the edge is straight. Outlines that are circles around the axis of a cylinder or
        cone are arcs in the flat image of the cone, and in that of a plane across the axis; the
        arc is as long as the edge on the cylinder or cone, so that neighbours agree.
        """
        return arc_angles(
            self.vertices,
            self.triangles,
            self.face,
            [face.surface for face in self.faces],
            [face.axis if face.kind == "plane" else None for face in self.faces],
            self.tolerance,
        )

    def edge_lengths(self) -> Array:
        """Return the lengths of edges in the flat image, along their arcs; (t, 3)."""
        image = self.flat()
        chord = np.linalg.norm(np.roll(image, -1, axis=1) - image, axis=2)
        half = np.abs(self.arcs) / 2
        return np.asarray(chord / np.sinc(half / np.pi))

    def flat(self) -> Array:
        """Return the corners of all triangles in the plane, each face in its place; (t, 3, 2).

        A free triangle is at its true size, by itself.
        """
        image = np.zeros((len(self.triangles), 3, 2))
        p, q, r = self.vertices[self.triangles].transpose(1, 0, 2)
        length = np.linalg.norm(q - p, axis=1)
        image[:, 1, 0] = length
        image[:, 2, 0] = np.einsum("td,td->t", q - p, r - p) / length
        image[:, 2, 1] = np.linalg.norm(np.cross(q - p, r - p), axis=1) / length
        for face in self.faces:
            if face.flat is not None:
                image[face.triangles] = face.flat
        return image
