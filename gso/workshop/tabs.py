"""Tabs along seams, for paper and cardboard: they are folded and glued behind the other part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.flat_region import region
from gso.geometry.polygon import arc_lengths, points_at
from gso.geometry.steady import steady
from gso.pattern import Bend
from gso.typing import Array
from gso.workshop.part import Label, Part
from gso.workshop.polygons import common, rings, united, without

if TYPE_CHECKING:
    from shapely import Geometry

#: Length of a tab in widths, and the largest turn along it, in radians. Bends of a larger angle
#: end the face that a tab is glued to.
_LENGTH, _TURN = 6.0, 0.35
#: Area of a tab that may lie on the part, on another tab, or beside the face that it is glued to,
#: relative to its own.
_ON = 1e-3
#: Widths of tabs that are tried, as shares of the one that is wanted.
_SHARES = (1.0, 0.5, 0.25)
#: Width of the cut along a bend, and distance of faces that meet a seam, in millimetres.
_CUT, _NEAR = 1e-6, 1e-3


@dataclass(frozen=True, eq=False)
class TabSeam:
    """A seam, seen from the part that may get tabs along it.

    Attributes
    ----------
    number : int
    line : ndarray, (k, 2)
        Its points on the outline of the part, which is to the left.
    other : ndarray, (k, 2)
        The same points on the outline of the other part, which is to the right.
    glued : Part
        The other part.
    tabs : bool
        Whether this side gets the tabs.
    angle : float
        Angle between the faces on both sides, as that of a :class:`Mating`.
    """

    number: int
    line: Array
    other: Array
    glued: Part
    tabs: bool
    angle: float = np.nan


def with_tabs(
    parts: Sequence[Part],
    seams: Sequence[Sequence[TabSeam]],
    width: float | None,
    *,
    numbers: float | None = None,
    place: str | None = None,
) -> tuple[list[Part], list[int]]:
    """Add trapezoidal tabs along the seams of parts, and the seams' numbers.

    A tab lies within the face of the other part that it is glued to, and takes at most half of
    that face's angle at a corner, so that tabs behind the same face do not meet there. A tab that
    would lie on the part or on another tab is made narrower, and left out if a quarter of the width
    does not fit. Where a seam gets no tab on its side, the other side is tried.

    Parameters
    ----------
    parts : sequence of Part
    seams : sequence of sequences of TabSeam
        The seams of each part.
    width : float or None
        Width of the tabs, in millimetres; None for none.
    numbers : float, optional
        Height of the numbers of seams; they are no higher than half of their seam is long.
    place : {"inside", "outside"}, optional
        Where numbers stand: beside seams in the part, or on the longest tab of a seam, otherwise
        outside the part. When not given, on the longest tab, otherwise in the part.

    Returns
    -------
    parts : list of Part
    bare : list of int
        Numbers of the seams that should have tabs, and have none on either side.
    """
    first = [_with_tabs(*own, width) for own in zip(parts, seams, strict=True)]
    both = [
        (seam, tabs)
        for (_, some), own in zip(first, seams, strict=True)
        for seam, tabs in zip(own, some, strict=True)
    ]
    bare = {seam.number for seam, tabs in both if seam.tabs and not tabs}
    out, glued = [], set()
    for (part, some), own in zip(first, seams, strict=True):
        others = [replace(x, tabs=x.number in bare and not x.tabs) for x in own]
        made, more = _with_tabs(part, others, width)
        glued |= {seam.number for seam, tabs in zip(own, more, strict=True) if tabs}
        if numbers is not None:
            labels = (
                _number(seam, [*one, *two], numbers, place)
                for seam, one, two in zip(own, some, more, strict=True)
            )
            made = replace(made, labels=(*made.labels, *labels))
        out.append(made)
    return out, [] if width is None else sorted(bare - glued)


def without_tabs(bare: Sequence[int]) -> list[str]:
    """Name the seams without tabs in a note; none if there are none.

    >>> without_tabs([3, 7])
    ['seams 3, 7 have no tab: it would lie on a part or beside the face that it is glued to']
    """
    if not bare:
        return []
    names = f"seam{'s' if len(bare) > 1 else ''} {', '.join(map(str, bare))}"
    has = "have" if len(bare) > 1 else "has"
    return [f"{names} {has} no tab: it would lie on a part or beside the face that it is glued to"]


def _with_tabs(
    part: Part, seams: Sequence[TabSeam], width: float | None
) -> tuple[Part, list[list[tuple[Array, float]]]]:
    """Add tabs to a part; also return the line and the width of those of each seam."""
    found: list[list[tuple[Array, float]]] = [[] for _ in seams]
    whole = region(part.outline, part.holes)
    if width is None or whole.geom_type != "Polygon":
        return part, found
    for seam, added in zip(seams, found, strict=True):
        for piece, there in divided(seam.line, seam.other, width) if seam.tabs else ():
            # Both sides of the seam may differ by their strain.
            slack = 0.01 * float(np.linalg.norm(piece[-1] - piece[0]))
            face = room(seam.glued, piece, there, slack)
            first, last = (min(0.25 * np.pi, 0.5 * x) for x in face_angles(seam.glued, there))
            for share in _SHARES:
                tab = region(_tab(piece, share * width, (first, last)))
                if tab.area <= 0 or without(tab, face).area > _ON * tab.area:
                    continue
                joined = united(whole, tab) if common(whole, tab).area <= _ON * tab.area else None
                if joined is not None:
                    whole = joined
                    added.append((piece, share * width))
                    break
    outline, holes = rings(whole)
    creases = (piece for added in found for piece, _ in added)
    return replace(part, outline=outline, holes=holes, creases=(*part.creases, *creases)), found


def divided(
    line: Array, other: Array, width: float, longest: float = _LENGTH
) -> list[tuple[Array, Array]]:
    """Divide both sides of a seam into pieces of limited turn and length, in widths."""
    way = np.diff(line, axis=0)
    keep = np.r_[True, np.linalg.norm(way, axis=1) > 0]
    line, other = line[keep], other[keep]
    way = np.diff(line, axis=0)
    if not len(way):
        return []
    angle = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    along = np.cumsum(np.linalg.norm(way, axis=1))
    turned = np.cumsum(np.abs(np.diff(angle, prepend=angle[0])))
    number = np.maximum(along / (longest * width), turned / _TURN).astype(np.int64)
    ends = np.flatnonzero(np.diff(number)) + 1
    stops = [0, *ends.tolist(), len(line) - 1]
    return [(line[a : b + 1], other[a : b + 1]) for a, b in pairwise(stops) if b > a]


def _tab(piece: Array, width: float, angles: tuple[float, float]) -> Array:
    """Return the polygon of a tab to the right of a line, with angles at its first and last point.

    Where they are so small that the sides meet before the width it is a triangle.
    """
    way = piece[-1] - piece[0]
    size = float(np.linalg.norm(way))
    along = way / max(size, 1e-300)
    out = np.array([along[1], -along[0]])
    slants = 1.0 / np.tan(np.array(angles))
    height = min(width, 0.8 * size / float(slants.sum()))
    first = piece[0] + height * (out + slants[0] * along)
    last = piece[-1] + height * (out - slants[1] * along)
    return np.concatenate([piece, [last, first]])


def face_angles(part: Part, line: Array) -> tuple[float, float]:
    """Return the angles to the right of a line at its ends, up to an outline or a sharp bend.

    The line is on the outline of the part.
    """
    lines = [np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in _loops(part)]
    lines += [bend.line[None] for bend in _sharp(part)]
    edges = np.concatenate(lines)
    size = float(np.ptp(part.outline, axis=0).max())
    found = []
    for at, ahead, side in ((line[0], line[-1], -1.0), (line[-1], line[0], 1.0)):
        base = ahead - at
        ends = np.concatenate([edges[:, ::-1], edges])
        ends = ends[np.linalg.norm(ends[:, 0] - at, axis=1) < 1e-6 * size]
        rays = ends[:, 1] - ends[:, 0]
        turn = np.arctan2(base[0] * rays[:, 1] - base[1] * rays[:, 0], rays @ base)
        turn = side * turn % (2.0 * np.pi)
        # An edge along the seam itself is no side of the face.
        inner = turn[(turn > 1e-3) & (turn < 2.0 * np.pi - 1e-3)]
        found.append(float(inner.min(initial=np.pi)))
    return found[0], found[1]


def _sharp(part: Part) -> list[Bend]:
    """Return the bends that end a face: sharp ones that are no lines of what is rolled."""
    rolled = [k for k, zone in enumerate(part.zones) if not zone.pressed]
    return [bend for bend in part.bends if abs(bend.angle) > _TURN and bend.zone not in rolled]


def _loops(part: Part) -> list[Array]:
    return [part.outline, *part.holes]


def beside(piece: Array, there: Array) -> Callable[[Array], Array]:
    """Return the motion that lays points of the other part beside the seam."""
    here, start = piece[-1] - piece[0], there[-1] - there[0]
    turn = complex(*here) / complex(*start) if np.any(start) else 1.0 + 0.0j
    turn /= abs(turn)
    matrix = np.array([[turn.real, turn.imag], [-turn.imag, turn.real]])
    shift = 0.5 * (piece[0] + piece[-1]) - 0.5 * (there[0] + there[-1]) @ matrix
    return lambda points: np.asarray(points @ matrix + shift)


def room(glued: Part, piece: Array, there: Array, slack: float) -> Geometry:
    """Return the face that a tab is glued to, laid beside the seam and wider by `slack`.

    It is bounded by the outline of the other part and by its sharp bends.
    """
    import shapely

    shape = region(glued.outline, glued.holes)
    folds = [shapely.LineString(bend.line) for bend in _sharp(glued)]
    if folds:
        cut = shapely.buffer(folds, _CUT, cap_style="square")
        shape = without(shape, shapely.union_all(cut))
    faces = shapely.get_parts(shape)
    middle = shapely.LineString(_inner(there))
    shape = shapely.GeometryCollection(faces[shapely.distance(faces, middle) < _NEAR].tolist())
    parts = shapely.get_parts(shapely.transform(shape, beside(piece, there)))
    # The cut along bends is no gap.
    slack = max(slack, 2.0 * _CUT) if folds else slack
    return steady(lambda some: shapely.union_all(shapely.buffer(some, slack)), parts)


def _inner(line: Array) -> Array:
    """Return the middle half of a line."""
    along = arc_lengths(line)
    at = np.linspace(0.25, 0.75, 5) * along[-1]
    return points_at(at, along, line)


def _number(
    seam: TabSeam, added: Sequence[tuple[Array, float]], height: float, place: str | None
) -> Label:
    """Place the number of a seam on its longest tab, or beside its middle."""
    if added and place != "inside":
        piece, width = max(added, key=lambda one: float(np.linalg.norm(one[0][-1] - one[0][0])))
        away = -0.5 * width
        height = min(height, 0.6 * width)
    else:
        piece = _inner(seam.line)
        height = min(height, float(np.linalg.norm(piece[-1] - piece[0])))
        away = -height if place == "outside" else height
    way = piece[-1] - piece[0]
    along = way / max(float(np.linalg.norm(way)), 1e-300)
    middle = 0.5 * (piece[0] + piece[-1]) + away * np.array([-along[1], along[0]])
    return Label(str(seam.number), middle, height, float(np.arctan2(along[1], along[0])))
