"""Strips of constant width along one side of seams: overlaps, and flanges that are folded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.flat_region import largest, region
from gso.geometry.vectors import unit
from gso.pattern import Bend
from gso.typing import Array, Flags
from gso.workshop.panels import Mating
from gso.workshop.part import Part
from gso.workshop.polygons import common, rings, united, without
from gso.workshop.tabs import TabSeam, beside, divided, face_angles, room
from gso.workshop.thickness import Thickness

if TYPE_CHECKING:
    from shapely import Geometry

#: Angle in radians up to which a seam is smooth: bends of less are not drawn.
_SMOOTH = np.radians(0.2)
#: Area of a strip that may lie on the part or beside the face that it covers, relative to its own,
#: and distance of points that are the same, relative to the size of a part.
_ON, _SAME = 1e-6, 1e-7
#: Angles of the ends of strips, in radians: by how much they are wider than the face, whose outline
#: may be curved, and at most; those of a rectangle.
_MORE, _WIDEST, _SQUARE = np.radians(20.0), np.radians(160.0), np.full(2, 0.5 * np.pi)


def with_strips(
    parts: Sequence[Part],
    seams: Sequence[Sequence[TabSeam]],
    overlap: float | None,
    flange: float | None,
    sheet: Thickness | None = None,
) -> tuple[list[Part], list[int]]:
    """Add strips of constant width along seams, on one side of each.

    The strip of a smooth seam continues the part, and its bends; the seam is drawn on it. That of a
    seam with an angle is folded by it, so that it lies on the face beside, too. A strip ends at the
    free outline of the face that it covers, and takes half of the angle to an outline with a seam
    or a bend, and at most half of the angle that its own part leaves open.

    Parameters
    ----------
    parts : sequence of Part
    seams : sequence of sequences of TabSeam
        The seams of each part.
    overlap, flange : float or None
        Widths of the strips of smooth seams, and of those with an angle, in millimetres; None for
        none. That of a flange is measured from where both faces of the surface meet.
    sheet : Thickness, optional
        The sheet, for the length of flanges.

    Returns
    -------
    parts : list of Part
    without : list of int
        Numbers of the seams whose strip is not possible on either side: it would meet its part or
        be wider than the face beside it, a flange is not straight, or the angle is not known.
    """
    made, without_strip = list(parts), []
    sides: dict[int, list[tuple[int, TabSeam]]] = {}
    for k, own in enumerate(seams):
        for seam in own:
            sides.setdefault(seam.number, []).append((k, seam))
    for number, both in sorted(sides.items()):
        angle = both[0][1].angle
        width = overlap if abs(angle) <= _SMOOTH else flange
        if np.isnan(angle):
            without_strip.append(number)
        elif width is not None:
            for (k, seam), (other, _) in sorted(zip(both, both[::-1], strict=True), key=_second):
                ends = np.concatenate([x.line[[0, -1]] for x in seams[other]])
                wider = _with_strip(made[k], parts[k], seam, _free(seam, ends), width, sheet)
                if wider is not None:
                    made[k] = wider
                    break
            else:
                without_strip.append(number)
    return made, without_strip


def no_such_seam(seams: Sequence[Mating], overlap: float | None, flange: float | None) -> list[str]:
    """Say that no seam is of the kind that strips of these widths are for."""
    smooth = [abs(seam.angle) <= _SMOOTH for seam in seams]
    if (overlap and any(smooth)) or (flange and not all(smooth)):
        return []
    if (overlap and flange) or not smooth:
        return ["there is no seam, so that there is no overlap or flange"]
    if overlap:
        return [
            "no seam is smooth, so that none has an overlap; --seam-flange is for seams with "
            "an angle"
        ]
    return ["no seam has an angle, so that none has a flange; --seam-overlap is for smooth seams"]


def _second(side: tuple[tuple[int, TabSeam], tuple[int, TabSeam]]) -> bool:
    return not side[0][1].tabs


def _free(seam: TabSeam, ends: Array) -> Flags:
    """Tell whether no other seam of the other part ends at both ends of a seam, (2,)."""
    near = _SAME * float(np.ptp(seam.glued.outline, axis=0).max())
    away = np.linalg.norm(seam.other[[0, -1], None] - ends, axis=2)
    return np.asarray((away < near).sum(axis=1) < 2)


def _with_strip(
    part: Part, bare: Part, seam: TabSeam, free: Flags, width: float, sheet: Thickness | None
) -> Part | None:
    """Add the strip of a seam to a part, which was `bare`; None if that is not possible."""
    import shapely

    line, other = seam.line, seam.other
    near = _SAME * float(np.ptp(part.outline, axis=0).max())
    moves = np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > near]
    line, other = line[moves], other[moves]
    is_straight = all(_straight(x, near) for x in (line, other))
    if is_straight:
        line, other = line[[0, -1]], other[[0, -1]]
    is_flange = abs(seam.angle) > _SMOOTH
    longer = 0.0 if sheet is None or not is_flange else float(sheet.change(seam.angle))
    crossing = _crossing(part, seam, near)
    if len(line) < 2 or (is_flange and (not is_straight or crossing or np.isinf(seam.angle))):
        return None
    face, outside = np.array(face_angles(seam.glued, other)), np.array(face_angles(bare, line))
    angles = np.minimum(0.5 * np.pi, np.minimum(0.5 * outside, np.where(free, 1.0, 0.5) * face))
    smooth_line = is_straight and not is_flange
    if smooth_line:
        # What is beside the face is trimmed off.
        angles = np.where(free, np.minimum(_WIDEST, face + _MORE), angles)
    out = _outer(line, width + longer, angles)
    corners, whole = np.concatenate([line, out[::-1]]), region(part.outline, part.holes)
    if not shapely.Polygon(corners).is_valid:
        return None
    strip: Geometry | None = region(corners)
    if smooth_line:
        strip = largest(common(strip, room(seam.glued, line, other, 0.0)))
        line_in, other_in = (0.5 * (x + x.mean(axis=0)) for x in (line, other))
        covers = _covers(seam, line_in, other_in, _outer(line_in, width, _SQUARE), near)
    else:
        covers = _covers(seam, line, other, _outer(line, width, angles), near)
    if not covers or strip is None or common(whole, strip).area > _ON * strip.area:
        return None
    joined = united(whole, strip)
    if joined is None:
        return None
    outline, holes = rings(joined)
    wider = replace(part, outline=outline, holes=holes)
    if is_flange:
        fold = line + 0.5 * longer / (width + longer) * (out - line)
        radius = 0.0 if sheet is None else float(sheet.inner(seam.angle, 0.0))
        return replace(wider, bends=(*part.bends, Bend(fold, seam.angle, radius)))
    wider = replace(wider, seams=(*part.seams, line), bends=_longer(part, strip, crossing))
    return _continued(wider, seam, strip, near) if is_straight else wider


def _covers(seam: TabSeam, line: Array, other: Array, out: Array, near: float) -> bool:
    """Tell whether a strip from a line of a seam to `out` (k, 2) is on the face beside."""
    for piece, rest in divided(line, np.hstack([other, out]), near, longest=np.inf):
        there = room(seam.glued, piece, rest[:, :2], near)
        strip = region(np.concatenate([piece, rest[::-1, 2:]]))
        if without(strip, there).area > _ON * strip.area:
            return False
    return True


def _straight(line: Array, near: float) -> bool:
    """Tell whether a line (k, 2) of some length is straight."""
    way = line[-1] - line[0]
    size = float(np.linalg.norm(way))
    if size <= near:
        return False
    off = (line - line[0]) @ np.array([-way[1], way[0]]) / size
    return bool(np.abs(off).max() <= near)


def _outer(line: Array, width: float, angles: Array) -> Array:
    """Return the points at a distance to the right of those of a line, mitred (k, 2).

    `angles` (2,) are those between the line and the ends of the strip.
    """
    along = unit(np.diff(line, axis=0))
    normal = along @ np.array([[0.0, -1.0], [1.0, 0.0]])
    one, two = (np.concatenate(x) for x in ((normal[:1], normal), (normal, normal[-1:])))
    out = (one + two) / (1.0 + np.einsum("kd,kd->k", one, two))[:, None]
    slant = 1.0 / np.tan(angles)
    out[0] += slant[0] * along[0]
    out[-1] -= slant[1] * along[-1]
    return np.asarray(line + width * out)


def _crossing(part: Part, seam: TabSeam, near: float) -> list[tuple[int, int]]:
    """Return bends that end on a seam between its ends: their numbers, and which end it is."""
    import shapely

    if not part.bends:
        return []
    points = np.array([bend.line for bend in part.bends])
    on = shapely.distance(shapely.points(points), shapely.LineString(seam.line)) < near
    corners = np.linalg.norm(points[:, :, None] - seam.line[[0, -1]], axis=3).min(axis=2) < near
    along = on.all(axis=1, keepdims=True)
    return [(int(k), int(end)) for k, end in np.argwhere(on & ~corners & ~along)]


def _longer(part: Part, strip: Geometry, crossing: list[tuple[int, int]]) -> tuple[Bend, ...]:
    """Return the bends of a part, those that cross a seam continued to the end of its strip."""
    import shapely

    bends = list(part.bends)
    for k, end in crossing:
        at, way = bends[k].line[end], bends[k].line[end] - bends[k].line[1 - end]
        far = at + way / np.linalg.norm(way) * float(np.hypot(*np.ptp(part.outline, axis=0)))
        points = shapely.get_coordinates(common(strip, shapely.LineString([at, far])))
        if len(points):
            ends = bends[k].line.copy()
            ends[end] = points[int(((points - at) @ way).argmax())]
            bends[k] = bends[k]._replace(line=ends)
    return tuple(bends)


def _continued(part: Part, seam: TabSeam, strip: Geometry, near: float) -> Part:
    """Add the bends of the face that a strip covers where they do not meet the seam.

    What is rolled on the strip is a zone of its own.
    """
    import shapely

    bends, zones = list(part.bends), list(part.zones)
    line, place = shapely.LineString(seam.line), beside(seam.line, seam.other)
    number: dict[int, int] = {-1: -1}
    for bend in seam.glued.bends:
        found = common(strip, shapely.LineString(place(bend.line)))
        if found.length <= near or shapely.distance(found, line) < near:
            continue
        if bend.zone not in number:
            number[bend.zone] = len(zones)
            zones.append(seam.glued.zones[bend.zone]._replace(angle=0.0))
        own = number[bend.zone]
        bends.append(bend._replace(line=shapely.get_coordinates(found)[[0, -1]], zone=own))
        if own >= 0:
            zones[own] = zones[own]._replace(angle=zones[own].angle + bend.angle)
    return replace(part, bends=tuple(bends), zones=tuple(zones))
