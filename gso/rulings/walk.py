"""Tracing of lines along a direction field on a triangulated surface, all at once.

Each triangle has one direction: that in which the normal interpolated from its corners turns
least. On a developable surface the normal depends on one scalar function only, and the lines
are the level lines of its interpolant. They therefore match across edges, and their error is of
second order although the field is constant in each triangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.mesh import Mesh, topology
from gso.rulings.face_curvature import face_matrices
from gso.rulings.gauss_image import gauss_image
from gso.typing import Array, Flags, Ints

#: Cosine of the largest turn between two triangles, 60 degrees; at larger turns a line ends.
_SHARP = 0.5

#: If two triangles both point to their common edge, a line follows the edge; it deviates from it
#: by this share of the way, so that it reaches another edge.
_TILT = 1e-3

#: Triangles with less than this share of the largest triangle's area count as degenerate.
_THIN = 1e-12


@dataclass(frozen=True)
class Field:
    """A direction in each triangle of a mesh.

    Attributes
    ----------
    directions : ndarray, (t, 3)
        Unit vectors in the triangles' planes; the sign is arbitrary.
    rates : ndarray, (t, 3)
        Derivatives of the barycentric coordinates along them, per length.
    flat : ndarray of bool, (t,)
        Triangles without a direction.
    """

    directions: Array
    rates: Array
    flat: Flags

    @classmethod
    def of(cls, mesh: Mesh, limit: float) -> Field:
        """Compute the directions in which the normal turns least.

        Triangles with curvatures below `limit` (1 / length) have none.
        """
        corners = topology.four_corners(mesh.triangles)
        s, (e, f, _), _ = face_matrices(mesh.vertices, gauss_image(mesh), corners)
        # Eigenvectors of s^T s; its eigenvalues are the squared singular values of s.
        (a, b), (c, d) = s
        high, _, angle = geometry.eigen(a * a + c * c, a * b + c * d, b * b + d * d)
        along = np.cos(angle)[:, None] * f - np.sin(angle)[:, None] * e
        return cls.along(mesh, along, high < limit**2)

    @classmethod
    def along(cls, mesh: Mesh, directions: Array, flat: Flags) -> Field:
        """Build a field from given directions (t, 3) of any length."""
        p = mesh.vertices[mesh.triangles]
        normal = geometry.area_vectors(mesh.vertices, mesh.triangles)
        twice = np.linalg.norm(normal, axis=1)[:, None]
        # A quad may have a degenerate triangle, which no line can cross.
        thin = twice <= _THIN * twice.max()
        unit = directions / np.where(thin, 1.0, np.linalg.norm(directions, axis=1)[:, None])
        side = np.divide(np.cross(normal, unit), twice**2, out=np.zeros_like(unit), where=~thin)
        # The gradient of a barycentric coordinate is the opposite edge, rotated by 90 degrees,
        # over twice the area.
        opposite = np.roll(p, -2, axis=1) - np.roll(p, -1, axis=1)
        rates = -(opposite * side[:, None]).sum(axis=2)
        return cls(unit, rates, flat | thin[:, 0])


@dataclass
class Steps:
    """Points of lines in the order in which they were reached.

    Attributes
    ----------
    line : ndarray of int, (p,)
        Index of the line.
    triangle : ndarray of int, (p,)
        Triangle in which the point lies.
    weights : ndarray, (p, 3)
        Barycentric coordinates of the point.
    arrived : ndarray of bool, (lines,)
        Whether the line ends at the boundary or at a flat region.
    """

    line: Ints
    triangle: Ints
    weights: Array
    arrived: Flags


def walk(mesh: Mesh, field: Field, start: Ints, sign: Array) -> Steps:
    """Trace lines from the centroids of triangles, with or against the directions of a field.

    Lines end at the boundary, before flat triangles, where the direction turns by more than
    60 degrees, and when their length reaches the surface's diagonal.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    field : Field
        Directions in its triangles.
    start : ndarray of int, (s,)
        Start triangle of each line, not flat.
    sign : ndarray, (s,)
        1 or -1: with the direction or against it.
    """
    twin = mesh.triangle_edges.twin
    at = _Front(
        line=np.arange(start.size),
        triangle=start,
        weights=np.full((start.size, 3), 1.0 / 3.0),
        rates=sign[:, None] * field.rates[start],
        heading=sign[:, None] * field.directions[start],
        left=np.full(start.size, mesh.diagonal),
    )
    arrived = np.zeros(start.size, bool)
    found = [(at.line, at.triangle, at.weights)]
    side = at.leave()
    # Bounds the steps: a line crosses at most as many triangles as there are.
    for _ in range(len(mesh.triangles)):
        found.append((at.line, at.triangle, at.weights))
        across = twin[3 * at.triangle + side]
        end = (across < 0) | field.flat[np.maximum(across, 0) // 3]
        arrived[at.line[end]] = True
        side = at.cross(mesh, field, side, across, ~end & (at.left > 0))
        if not at.line.size:
            break
    line, triangle, weights = (np.concatenate(c) for c in zip(*found, strict=True))
    return Steps(line, triangle, weights, arrived)


@dataclass
class _Front:
    """State of the lines that have not ended: their triangles, positions and directions.

    `rates` and `heading` are `rates` and `directions` of :class:`Field` with the sign of the
    line; `left` is the remaining length.
    """

    line: Ints
    triangle: Ints
    weights: Array
    rates: Array
    heading: Array
    left: Array

    def keep(self, which: Flags) -> None:
        """Drop all lines but those selected."""
        for name, values in vars(self).items():
            setattr(self, name, values[which])

    def leave(self) -> Ints:
        """Advance to the edge of the triangle that lies ahead; return its number."""
        falling = self.rates < 0
        steps = np.full(self.rates.shape, np.inf)
        np.divide(self.weights, -self.rates, out=steps, where=falling)
        corner = steps.argmin(axis=1)
        rows = np.arange(corner.size)
        length = steps[rows, corner]
        self.left = self.left - length
        ahead = np.maximum(self.weights + length[:, None] * self.rates, 0.0)
        ahead[rows, corner] = 0.0
        self.weights = ahead / ahead.sum(axis=1, keepdims=True)
        return np.asarray((corner + 1) % 3)

    def cross(self, mesh: Mesh, field: Field, side: Ints, across: Ints, go: Flags) -> Ints:
        """Cross the next triangle to the edge ahead; drop lines that end before it.

        `side` is the number of the edge that the lines are on, `across` the twin half-edge, and
        `go` selects the lines that continue. Returns the number of the edge reached.
        """
        side, across = side[go], across[go]
        self.keep(go)
        rows = np.arange(across.size)
        here, there = self.weights[rows, side], self.weights[rows, (side + 1) % 3]
        self.triangle, side = np.divmod(across, 3)
        self.weights = np.zeros_like(self.weights)
        self.weights[rows, side], self.weights[rows, (side + 1) % 3] = there, here
        turn = (field.directions[self.triangle] * self.heading).sum(axis=1)
        smooth = np.abs(turn) > _SHARP
        side, turn = side[smooth], np.sign(turn[smooth])[:, None]
        self.keep(smooth)
        before = self.heading
        self.heading = turn * field.directions[self.triangle]
        self.rates = turn * field.rates[self.triangle]
        back = self.rates[np.arange(side.size), (side + 2) % 3] <= 0
        if back.any():
            self._follow_side(mesh, before, side, back)
        return self.leave()

    def _follow_side(self, mesh: Mesh, before: Array, side: Ints, which: Flags) -> None:
        """Make lines whose direction points back follow the edge that they came through."""
        rows = np.flatnonzero(which)
        side = side[rows]
        first = mesh.triangles[self.triangle[rows], side]
        last = mesh.triangles[self.triangle[rows], (side + 1) % 3]
        edge = mesh.vertices[last] - mesh.vertices[first]
        length = np.linalg.norm(edge, axis=1)
        forward = (edge * before[rows]).sum(axis=1) > 0
        end, other = (np.where(forward, side + a, side + b) % 3 for a, b in ((1, 0), (0, 1)))
        self.rates[rows, other] = -1.0 / length
        self.rates[rows, end] = (1.0 - _TILT) / length
        self.rates[rows, (side + 2) % 3] = _TILT / length
        self.heading[rows] = edge / np.where(forward, length, -length)[:, None]
