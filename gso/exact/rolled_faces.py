"""Folding of patterns with rolled faces: bends with a radius become cylinders and cones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.mesh.topology import label_components
from gso.pattern import Folded, Pattern
from gso.typing import Array, Ints
from gso.unfolding.dual_edges import dual_edges
from gso.unfolding.folding import angles_at, frames, motions

#: Angle in radians between bend lines up to which they are parallel.
_PARALLEL = 1e-6


def fold(pattern: Pattern, folded: Folded, rolled: Ints) -> Array:
    """Fold and roll a pattern by its bends alone.

    Parameters
    ----------
    pattern : Pattern
        With triangles.
    folded : Folded
        Its bends. Others than those in rolled faces fold it like paper, whatever their radius.
    rolled : ndarray of int, (t,)
        The rolled face of each triangle, -1 for none.

    Returns
    -------
    ndarray, (p, 3)
        Positions of the pattern's vertices, each part in a place of its own.
    """
    faces, flat = pattern.faces, pattern.flat
    edges = dual_edges(faces, np.pad(flat, ((0, 0), (0, 1))))
    one, other = edges.triangles.T
    inner = (rolled[one] == rolled[other]) & (rolled[one] >= 0)
    body = label_components(len(faces), one[inner], other[inner])
    curved = folded.taken(folded.radii > 0)
    angle = angles_at(edges, curved, len(flat))
    radius = angles_at(edges, curved._replace(angles=curved.radii), len(flat))
    # A limiting line of a rolled face is a part of its roll.
    sharp = angle * ((rolled[one] < 0) & (rolled[other] < 0))
    sharp += angles_at(edges, folded.taken(folded.radii == 0), len(flat))
    local = np.pad(flat[faces], ((0, 0), (0, 0), (0, 1)))
    border = np.flatnonzero(body[one] != body[other])
    sides = edges.triangles[border]
    first, second = (corners[border] for corners in edges.corners())
    ends = np.stack([first, second], axis=1)
    normal = np.zeros((len(border), 2, 3))
    normal[..., 2] = 1.0
    middle = flat[edges.ends[border]].mean(axis=1)
    for k in np.unique(body[rolled >= 0]).tolist():
        own = inner & (body[one] == k) & (radius > 0)
        if own.any():
            lines = flat[edges.ends[own]]
            roll = _Roll.of(lines, radius[own], float(np.sign(angle[own].sum())))
            which = body == k
            local[which] = roll.points(flat[faces[which]].reshape(-1, 2)).reshape(-1, 3, 3)
            at = body[sides] == k
            normal[at] = roll.normals(middle[np.nonzero(at)[0]])
    placed = local.reshape(-1, 3)[ends]
    frame = np.stack([frames(placed[:, s], normal[:, s]) for s in (0, 1)], axis=1)
    turn, shift = motions(
        body[sides], placed.mean(axis=2), frame, sharp[border], int(body.max()) + 1
    )
    out = np.einsum("tij,tkj->tki", turn[body], local) + shift[body][:, None]
    points: Array = np.zeros((len(flat), 3))
    points[faces.ravel()] = out.reshape(-1, 3)
    return points


@dataclass(frozen=True, eq=False)
class _Roll:
    """How a rolled face bends: its frame in the plane, and radius or half angle.

    Attributes
    ----------
    centre : ndarray, (2,)
        A point on a ruling of a cylinder; the apex of a cone.
    along : ndarray, (2,)
        Unit direction of a ruling.
    radius : float
        Of a cylinder.
    half_angle : float
        Of a cone, in radians; 0 for a cylinder.
    sign : float
        1 where it is convex seen from above, else -1.
    """

    centre: Array
    along: Array
    radius: float
    half_angle: float
    sign: float

    @classmethod
    def of(cls, lines: Array, radii: Array, sign: float) -> _Roll:
        """Take it from bend lines (b, 2, 2) and the radii in their middles."""
        way = lines[:, 1] - lines[:, 0]
        size = np.linalg.norm(way, axis=1)
        longest = int(size.argmax())
        d = way[longest] / size[longest]
        across = np.abs(way[:, 0] * d[1] - way[:, 1] * d[0]) / size
        middle = lines.mean(axis=1)
        if across.max() < _PARALLEL:
            return cls(middle[longest], d, float(np.average(radii, weights=size)), 0.0, sign)
        normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
        apex = np.linalg.lstsq(normal, (normal * middle).sum(axis=1), rcond=None)[0]
        away = np.linalg.norm(middle - apex, axis=1)
        # The mean direction, so that the cut behind it is outside the face.
        d = ((middle - apex) / away[:, None]).mean(axis=0)
        slope = float((radii * away).sum() / (away * away).sum())
        return cls(apex, d / np.linalg.norm(d), 0.0, float(np.arctan(slope)), sign)

    def _local(self, points: Array) -> tuple[Array, Array]:
        p = points - self.centre
        x, y = self.along
        return p @ np.array([y, -x]), p @ self.along

    def points(self, points: Array) -> Array:
        """Return the rolled places (k, 3) of points (k, 2)."""
        u, v = self._local(points)
        if self.half_angle == 0:
            turn = u / self.radius
            down = self.sign * self.radius * (1 - np.cos(turn))
            return np.stack([self.radius * np.sin(turn), v, -down], axis=1)
        far, turn = np.hypot(u, v), np.arctan2(-u, v) / np.sin(self.half_angle)
        s, c = np.sin(self.half_angle), np.cos(self.half_angle)
        out = [far * s * np.cos(turn), far * s * np.sin(turn), -self.sign * far * c]
        return np.stack(out, axis=1)

    def normals(self, points: Array) -> Array:
        """Return the upper normals there."""
        u, v = self._local(points)
        if self.half_angle == 0:
            turn = u / self.radius
            return np.stack([self.sign * np.sin(turn), 0 * u, np.cos(turn)], axis=1)
        turn = np.arctan2(-u, v) / np.sin(self.half_angle)
        s, c = np.sin(self.half_angle), np.cos(self.half_angle)
        return np.stack(
            [self.sign * c * np.cos(turn), self.sign * c * np.sin(turn), s + 0 * u], axis=1
        )
