"""Bends of developable faces along their rulings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gso.exact.ruling_rows import levels, ruling_rows
from gso.exact.sliced_pattern import SlicedPattern
from gso.mesh.topology import pair_keys
from gso.pattern import Folded, Zone
from gso.recognition import BendLine, ShapeFace
from gso.typing import Array, Flags

#: Distances, relative to the size, within which points are on a line: at least, and at most.
_SAME, _COARSEST = 1e-7, 5e-4
#: Largest angle in radians by which a press bends.
_HALF_TURN = np.pi + np.radians(1.0)


def ruled_bends(
    sliced: SlicedPattern,
    faces: Sequence[ShapeFace],
    flat: Array,
    press_radius: tuple[float, float] | None = None,
    tolerance: float = 0.0,
) -> Folded:
    """Return the edges to bend faces along, with angles and radii.

    They are rows of edges along rulings where a face has enough. Otherwise triangles are divided
    along rulings, and those of neighbouring faces where rulings end at them.

    Parameters
    ----------
    sliced : SlicedPattern
        The pattern, whose triangles are not divided yet.
    faces : sequence of ShapeFace
        The faces of the shape.
    flat : ndarray, (t, 3, 2)
        Flat corners of the shape's triangles, each face in its own place.
    press_radius : (float, float), optional
        As of :func:`gso.exact.folded_pattern`.
    tolerance : float
        Error of the coordinates: vertices on one ruling may be so far beside it.
    """
    size = float(np.linalg.norm(np.ptp(sliced.points, axis=0)))
    near = float(np.clip(2 * tolerance, _SAME * size, _COARSEST * size))
    found, ruled = [Folded()], []
    for number, face in enumerate(faces):
        if not face.bend_lines:
            continue
        if is_pressed(face, press_radius):
            bends = [_middle_line(face)]
        else:
            bends = _rulings(face)
            rows = ruling_rows(sliced, face, flat, max(3, len(bends)), near)
            if rows is not None:
                found.append(rows._replace(zone=np.full(len(rows.edges), number)))
                continue
        turn, shift = _motion(sliced, face, flat)
        own = max(near, 2.0 * _apex_error(face, flat, size))
        ends = [np.stack([bend.start, bend.end]) @ turn + shift for bend in bends]
        lines = [_Line.of(line, face, shift, own) for line in ends]
        ruled.append((number, bends, lines, own))
    for number, _, lines, own in ruled:
        _slice(sliced, number, lines, own)
    found += [_on_lines(sliced, *one) for one in ruled]
    return joined_bends(found)


def _apex_error(face: ShapeFace, flat: Array, size: float) -> float:
    """Return the distance of a cone's apex from the vertex there; 0 if there is none."""
    if face.surface is None or face.surface.slope == 0:
        return 0.0
    # Flat images of cones have the apex at the origin.
    least = float(np.linalg.norm(flat[face.triangles], axis=-1).min())
    return least if least < _COARSEST * size else 0.0


def _slice(sliced: SlicedPattern, number: int, lines: list[_Line], near: float) -> None:
    """Divide the triangles of a face along lines."""
    for line in lines:
        edges = sliced.edges_of(number)
        away = line.away(sliced.flat[edges])
        away[np.abs(away) < near] = 0.0
        hit = away[:, 0] * away[:, 1] < 0
        share = away[hit, 0] / (away[hit, 0] - away[hit, 1])
        p, q = sliced.flat[edges[hit]].transpose(1, 0, 2)
        inside = line.reaches(p + share[:, None] * (q - p))
        if inside.any():
            sliced.insert(edges[hit][inside], share[inside])


def _on_lines(
    sliced: SlicedPattern, number: int, bends: list[BendLine], lines: list[_Line], near: float
) -> Folded:
    """Return the edges of a face on its lines, with the angles and radii of its bends."""
    edges = sliced.edges_of(number)
    inner = np.isin(pair_keys(edges, len(sliced.flat)), sliced.inner())
    on = [inner & line.carries(sliced.flat[edges], near) for line in lines]
    found = [Folded()]
    for line, bend, own in zip(lines, _weighted(bends, lines, on), on, strict=True):
        share = line.along(sliced.flat[edges[own]]).mean(axis=1)
        share = share / float(np.linalg.norm(bend.end - bend.start))
        radii = bend.radius_start + share * (bend.radius_end - bend.radius_start)
        angle = -bend.angle if bend.up else bend.angle
        zone = np.full(len(radii), number)
        found.append(Folded(edges[own], np.full(len(radii), angle), radii, zone))
    return joined_bends(found)


def zones_of(
    faces: Sequence[ShapeFace], press_radius: tuple[float, float] | None
) -> tuple[Zone, ...]:
    """Return how each face is bent, planes as zones that do not turn."""
    return tuple(_zone(face, is_pressed(face, press_radius)) for face in faces)


def _zone(face: ShapeFace, pressed: bool) -> Zone:
    lines = face.bend_lines
    radii = [radius for line in lines for radius in (line.radius_start, line.radius_end)]
    if face.radius is not None:
        radii = [face.radius]
    turn = -face.bend_angle if lines and lines[0].up else face.bend_angle
    return Zone(face.kind, min(radii, default=np.inf), max(radii, default=np.inf), turn, pressed)


def is_pressed(face: ShapeFace, largest: tuple[float, float] | None) -> bool:
    """Tell whether a face is a cylinder that a press bends at one line."""
    if largest is None or not face.bend_lines or face.radius is None or face.flat is None:
        return False
    turn = float(np.ptp(face.flat[..., 0])) / face.radius
    return bool(face.radius <= largest[int(face.bend_lines[0].up)] and turn <= _HALF_TURN)


def _middle_line(face: ShapeFace) -> BendLine:
    """Return the ruling in the middle of a cylinder, with the whole angle."""
    if face.flat is None or face.radius is None:
        raise AssertionError("only a cylinder has a ruling in the middle")
    across, along = face.flat[..., 0], face.flat[..., 1]
    middle, angle = 0.5 * (across.min() + across.max()), float(np.ptp(across)) / face.radius
    start, end = (np.array([middle, y]) for y in (along.min(), along.max()))
    return BendLine(start, end, face.radius, face.radius, angle, face.bend_lines[0].up)


def joined_bends(some: list[Folded]) -> Folded:
    """Return the bends of several faces together."""
    return Folded(*(np.concatenate(column) for column in zip(*some, strict=True)))


def _rulings(face: ShapeFace) -> list[BendLine]:
    """Return the bend lines of a face; of those on one ruling of a round face the first."""
    bends = list(face.bend_lines)
    if face.surface is None:
        return bends
    level = levels(face.surface, np.array([line.end for line in bends]))
    order = np.argsort(level, kind="stable")
    new = np.diff(level[order], prepend=-np.inf) > _SAME * max(float(np.ptp(level)), 1e-300)
    first = np.minimum.reduceat(order, np.flatnonzero(new))
    return [bends[k] for k in sorted(first.tolist())]


@dataclass(frozen=True, eq=False)
class _Line:
    """A ruling in the pattern: its ends (2, 2), and how far it reaches from the first one."""

    ends: Array
    reach: tuple[float, float]

    @classmethod
    def of(cls, ends: Array, face: ShapeFace, apex: Array, near: float) -> _Line:
        """Make a line that ends at `ends`, but on round faces only at the outline or the apex."""
        if face.surface is None:
            return cls(ends, (-near, float(np.linalg.norm(ends[1] - ends[0])) + near))
        line = cls(ends, (-np.inf, np.inf))
        return line if face.surface.slope == 0 else cls(ends, (float(line.along(apex)), np.inf))

    @property
    def way(self) -> Array:
        """Its unit direction."""
        d = self.ends[1] - self.ends[0]
        return np.asarray(d / np.linalg.norm(d))

    def away(self, points: Array) -> Array:
        """Return the signed distances of points (..., 2)."""
        x, y = self.way
        return np.asarray((points - self.ends[0]) @ np.array([-y, x]))

    def along(self, points: Array) -> Array:
        """Return the places of points (..., 2) along the line."""
        return np.asarray((points - self.ends[0]) @ self.way)

    def reaches(self, points: Array) -> Flags:
        """Tell which points are within its reach."""
        at = self.along(points)
        return np.asarray((at > self.reach[0]) & (at < self.reach[1]))

    def carries(self, ends: Array, near: float) -> Flags:
        """Tell which edges (e, 2, 2) lie on it."""
        on = (np.abs(self.away(ends)) < 2 * near) & self.reaches(ends)
        return np.asarray(on.all(axis=1))


def _motion(sliced: SlicedPattern, face: ShapeFace, flat: Array) -> tuple[Array, Array]:
    """Return how the flat image of a face was moved: p @ turn + shift."""
    first = int(face.triangles[0])
    here, there = flat[first], sliced.flat[sliced.faces[first]]
    turn = np.linalg.solve(here[1:] - here[0], there[1:] - there[0])
    return turn, there[0] - here[0] @ turn


def _weighted(bends: list[BendLine], lines: list[_Line], on: list[Flags]) -> list[BendLine]:
    """Give the angle of limiting lines on the outline to their neighbours."""
    out = list(bends)
    rest = [k for k, bend in enumerate(bends) if not bend.limit]
    for k, bend in enumerate(bends):
        if bend.limit and rest and not on[k].any():
            middle = lines[k].ends.mean(axis=0)
            near = min(rest, key=lambda j: abs(float(lines[j].away(middle))))
            out[near] = replace(out[near], angle=out[near].angle + bend.angle)
    return out
