"""Bodies of revolution: their axis and their profile, found in a mesh with any faces.

The centroid of the surface lies on the axis, and the axis is a principal axis of it. Where these
are not unique, the normals say more: the normal lines of a surface of revolution meet its axis, so
that they belong to a linear complex of lines. The profile is a section by a half-plane, moved to
the mean of several sections.

Source: Pottmann and Wallner 2001, Computational Line Geometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso import metrics
from gso.geometry import doubled_areas
from gso.geometry.vectors import cross, unit
from gso.mesh import Mesh
from gso.mesh.separation import centres
from gso.seams.profile_sections import MOSTLY, Sections, aligned
from gso.typing import Array, Flags

#: Largest root mean square of the normals' components along the circles about an axis, and the
#: ratio and difference to the least one of all axes up to which an axis is tried.
_TURNED, _RATIO, _EXTRA = 0.3, 2.0, 0.02
#: Difference of the second moments of an axis from the others, over the largest one, from which on
#: it is unique; the same of the least eigenvalue of the linear complex: a ratio.
_GAP, _UNIQUE, _ROUNDING = 0.02, 4.0, 1e-9
#: Boundary loops, and places on each, whose planes are tried for parts of a ball, and the number of
#: their axes that are taken.
_LOOPS, _PLACES, _TRIED = 4, 32, 4


@dataclass(frozen=True, eq=False)
class Revolution:
    """A surface of revolution.

    Attributes
    ----------
    origin : ndarray, (3,)
        A point of its axis.
    axis : ndarray, (3,)
        Unit direction of the axis.
    profile : ndarray, (p, 2)
        Radius and height above the origin along the profile. With the radius to the right and the
        height up, the normals of the surface are on its left. The first point is repeated at the
        end of a closed profile, which begins where its radius is least.
    apart : float
        Largest distance of the surface from that of the profile, as far as it was measured: at
        vertices, up to some thousand of them, and along sections.
    """

    origin: Array
    axis: Array
    profile: Array
    apart: float

    @classmethod
    def of(cls, mesh: Mesh, distance: float) -> Revolution | None:
        """Find the axis and the profile of a mesh; None if it is no body of revolution.

        Parameters
        ----------
        mesh : Mesh
            One component; its boundary consists of circles about the axis.
        distance : float
            Half of it is how far the mesh may be from a body of revolution, in its unit.

        Examples
        --------
        >>> turn = np.exp(2j * np.pi * np.arange(24) / 24)
        >>> ring = np.stack([turn.real, turn.imag, 0.0 * turn.real], axis=1)
        >>> low = np.arange(24)
        >>> faces = np.stack([low, np.roll(low, -1), np.roll(low, -1) + 24, low + 24], axis=1)
        >>> cone = Mesh(np.concatenate([3.0 * ring, ring + [0.0, 0.0, 4.0]]), faces)
        >>> found = Revolution.of(cone, 0.1)
        >>> abs(found.axis).round(3).tolist(), sorted(found.profile[:, 0].round(1).tolist())
        ([0.0, 0.0, 1.0], [1.0, 3.0])
        """
        return cls._found(mesh, distance, part=False)

    @classmethod
    def with_part(cls, mesh: Mesh, distance: float) -> Revolution | None:
        """Find the body of revolution of which a mesh is a part; None if there is none.

        At least half of the boundary is along circles about the axis or in planes with it, or most
        sections are nearly as long as the longest: a dome with a door, or half of a vase.

        Parameters
        ----------
        mesh, distance
            As of :meth:`of`; its boundary may be any.
        """
        return cls._found(mesh, distance, part=True)

    @classmethod
    def _found(cls, mesh: Mesh, distance: float, *, part: bool) -> Revolution | None:
        triangles = Mesh(mesh.vertices, mesh.triangles)
        if not len(triangles.faces) or len(np.unique(triangles.components)) > 1:
            return None
        for origin, axis in _axes(triangles, part=part):
            sections = Sections(triangles, origin, axis)
            found = (sections.part_profile if part else sections.profile)(distance)
            if found is not None:
                return cls(origin, axis, *found)
        return None

    @cached_property
    def is_closed(self) -> bool:
        """Whether the profile is a closed line, as that of a torus."""
        return bool(np.array_equal(self.profile[0], self.profile[-1]))

    @cached_property
    def poles(self) -> int:
        """Number of ends of the profile on the axis."""
        return int((self.profile[[0, -1], 0] == 0.0).sum())

    @cached_property
    def reach(self) -> float:
        """How far the surface moves at most where all radii grow by their own length.

        This is the radius, times the cosine of the slope; a rim moves by its whole radius.
        """
        way = np.diff(self.profile, axis=0)
        steep = np.abs(way[:, 1]) / np.linalg.norm(way, axis=1)
        radius = np.maximum(self.profile[1:, 0], self.profile[:-1, 0])
        rims = 0.0 if self.is_closed else float(self.profile[[0, -1], 0].max())
        return max(float((steep * radius).max()), rims)

    def straightness(self) -> float:
        """Return the largest distance of the profile from the line between its ends."""
        way = self.profile[-1] - self.profile[0]
        away = self.profile - self.profile[0]
        share = np.clip(away @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        return float(np.linalg.norm(away - share[:, None] * way, axis=1).max())


def _axes(mesh: Mesh, *, part: bool) -> list[tuple[Array, Array]]:
    """Return axes to try, of the body that a mesh is or is a part of: points and directions.

    The best come first.
    """
    weight = doubled_areas(mesh.vertices, mesh.faces)
    weight, middle, normal = weight / weight.sum(), centres(mesh), metrics.face_normals(mesh)
    centroid = weight @ middle
    of_normals = _of_normals(weight, middle, normal, mesh.diagonal)
    if part:
        centre = _centre(weight, middle, normal)
        upright = [*np.eye(3)[::-1], unit(centroid - centre), *_across_boundary(mesh)]
        share = np.array([aligned(mesh, centre, axis) for axis in upright])
        # Of nearly equal ones those along the axes of the coordinates come first.
        order = np.argsort(-np.where(share < MOSTLY, 0.0, share.round(1)), kind="stable")
        found = of_normals + [(centre, upright[k]) for k in order[:_TRIED]]
    else:
        principal, single = _principal(mesh, weight, middle, centroid)
        found = [(centroid, axis) for axis in principal.T[single]] + of_normals
        # A ball has an axis in every direction.
        found += [(centroid, axis) for axis in (*np.eye(3)[::-1], *principal.T[~single])]
    turned = []
    for origin, axis in found:
        round_it = unit(np.cross(axis, middle - origin))
        along = np.einsum("md,md->m", round_it, normal)
        turned.append(float(np.sqrt(weight @ along**2)))
    most = min(_TURNED, max(_RATIO * min(turned), min(turned) + _EXTRA))
    return [one for one, own in zip(found, turned, strict=True) if own <= most]


def _of_normals(
    weight: Array, middle: Array, normal: Array, size: float
) -> list[tuple[Array, Array]]:
    """Return the axis of the linear complex of some normal lines, if there is one only."""
    centroid = weight @ middle
    lines = np.concatenate([cross(middle - centroid, normal) / size, normal], axis=1)
    spread, vectors = np.linalg.eigh((weight[:, None] * lines).T @ lines)
    way, moment = vectors[:3, 0], size * vectors[3:, 0]
    length = float(np.linalg.norm(way))
    if spread[1] <= _UNIQUE * spread[0] + _ROUNDING or length <= _ROUNDING:
        return []
    axis = way / length
    return [(centroid + np.cross(axis, moment / length), axis)]


def _principal(mesh: Mesh, weight: Array, middle: Array, centroid: Array) -> tuple[Array, Flags]:
    """Return the principal axes (3, 3) of a surface as columns, and which of them are unique."""
    # Second moments of triangles: a twelfth at the corners, three quarters at the centre.
    away, inner = mesh.vertices[mesh.faces] - centroid, middle - centroid
    moments = np.einsum("m,mkd,mke->de", weight / 12.0, away, away)
    moments += 0.75 * np.einsum("m,md,me->de", weight, inner, inner)
    level, principal = np.linalg.eigh(moments)
    gap = np.diff(level) > _GAP * level[-1]
    return principal, np.array([gap[0], gap[0] and gap[1], gap[1]])


def _across_boundary(mesh: Mesh) -> Array:
    """Return the normals (k, 3) of planes through points of the boundary near each other."""
    found = [np.empty((0, 3))]
    for loop in mesh.boundary_loops[:_LOOPS]:
        step = max(len(loop) // _PLACES, 1)
        points = mesh.vertices[loop]
        ways = np.roll(points, -step, axis=0) - points
        found.append(np.cross(ways, np.roll(ways, -step, axis=0))[::step])
    return unit(np.concatenate(found))


def _centre(weight: Array, middle: Array, normal: Array) -> Array:
    """Return the point that is nearest to some normal lines: the centre of a ball."""
    across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    total = np.einsum("m,mde->de", weight, across)
    right = np.einsum("m,mde,me->d", weight, across, middle)
    return np.asarray(np.linalg.lstsq(total, right, rcond=1e-9)[0])
