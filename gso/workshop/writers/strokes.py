"""What is drawn of a part: lines and texts of a kind each, the same in all formats."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from gso.geometry.flat_region import region
from gso.pattern import Bend, Zone
from gso.typing import Array
from gso.workshop.names import different
from gso.workshop.part import Drawing, GuideLine, Label, Part
from gso.workshop.polygons import common

# A bend by less is none, in radians.
_FLAT = 1e-9
# Length of notches in millimetres, and its largest fraction of a part's smaller side.
_NOTCH = 4.0
_SHARE = 0.1
# Height of texts beside notches, as a fraction of the notches' length.
_BESIDE = 0.75
_CORNERS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
# Height of texts beside bends in millimetres, and its largest fraction of the bend's length.
_BEND_TEXT = 3.0
_BEND_SHARE = 0.08
# Length of the grain line as a fraction of the part's, and of its head as one of the line's.
_GRAIN = 0.6
_HEAD = 0.08


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline.

    Attributes
    ----------
    kind : str
        ``outline``, ``hole``, ``mountain``, ``valley``, ``roll`` (a line of what is rolled),
        ``guide``, ``crease``, ``mark``, ``seam``, ``notch``, ``grain``, ``arrow`` (the head of the
        grain line) or ``sheet``.
    points : ndarray, (k, 2)
        In millimetres. The first point of a closed line is not repeated.
    closed : bool
    bend : Bend, optional
        The bend along it.
    zone : Zone, optional
        The zone that the bend is a line of.
    guide : GuideLine, optional
        The guide line that it is.
    """

    kind: str
    points: Array
    closed: bool = False
    bend: Bend | None = None
    zone: Zone | None = None
    guide: GuideLine | None = None

    @property
    def title(self) -> str:
        """What is done along it, in words; empty if it is no bend and no guide line."""
        if self.guide is not None:
            return self.guide.in_words()
        if self.bend is None:
            return ""
        zone = "" if self.zone is None else f"{self.zone.in_words()}; here "
        return zone + self.bend.in_words()


def lines(part: Part) -> list[Line]:
    """Return the lines of a part, the outline last.

    Parameters
    ----------
    part : Part

    Examples
    --------
    >>> square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
    >>> bend = Bend(np.array([[30.0, 0], [30, 60]]), np.pi / 2, 1.5)
    >>> [line.kind for line in lines(Part("a", square, bends=(bend,), grain=np.array([0.0, 1])))]
    ['grain', 'arrow', 'mountain', 'outline']
    """
    drawn = [] if part.grain is None else _grain(part, part.grain)
    drawn += [_line("mark", line) for line in part.marks]
    drawn += [_line("crease", line) for line in part.creases]
    depth = _depth(part)
    for notch in part.notches:
        drawn.append(Line("notch", np.stack([notch.at, notch.at + depth * notch.inward])))
    drawn += [
        Line(_kind(part, bend), np.asarray(bend.line), bend=bend, zone=_zone(part, bend))
        for bend in _bends(part)
    ]
    drawn += [Line("guide", guide.line, guide=guide) for guide in part.guides]
    drawn += [_line("seam", line) for line in part.seams]
    drawn += [_line("hole", line, closed=True) for line in part.holes]
    return [*drawn, _line("outline", part.outline, closed=True)]


def texts(part: Part, bend_text: bool = False) -> list[Label]:
    """Return the texts of a part: labels, those of notches and zones and, if asked for, of bends.

    Parameters
    ----------
    part : Part
    bend_text : bool
        Whether each bend that is not rolled has a text with its direction, angle and radius.

    Examples
    --------
    >>> square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
    >>> bend = Bend(np.array([[30.0, 0], [30, 60]]), np.pi / 2, 1.5)
    >>> [text.text for text in texts(Part("a", square, bends=(bend,)), bend_text=True)]
    ['down 90 deg R 1.5']
    """
    found = [replace(label, text=printable(label.text)) for label in part.labels]
    depth = _depth(part)
    height = _BESIDE * depth
    found += _numbers(part, depth, height)
    for bend in _bends(part) if bend_text else []:
        if _kind(part, bend) == "roll":
            continue
        way = "down" if bend.angle > 0 else "up"
        words = f"{way} {abs(np.degrees(bend.angle)):.4g} deg"
        if np.isfinite(bend.radius):
            words += f" R {bend.radius:.4g}"
        found.append(_beside(bend, words))
    for number, zone in enumerate(part.zones):
        own = [bend for bend in part.bends if bend.zone == number]
        if own and not zone.pressed:
            found.append(_beside(own[len(own) // 2], zone.in_words()))
    return [text for text in found if text.text and text.height > 0]


def _beside(bend: Bend, words: str) -> Label:
    """Place words beside a bend, readable from below or from the right."""
    step = bend.line[1] - bend.line[0]
    high = min(_BEND_TEXT, _BEND_SHARE * float(np.hypot(*step)))
    step = step if (step[0], step[1]) > (1e-9 * abs(step[1]), 0) else -step
    angle = float(np.arctan2(step[1], step[0]))
    up = np.array([-np.sin(angle), np.cos(angle)])
    return Label(words, np.mean(bend.line, axis=0) + high * up, high, angle)


def sheet(drawing: Drawing) -> list[Line]:
    """Return the border of the sheet; nothing if there is no sheet.

    >>> square = Part("a", np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]]))
    >>> [line.points.tolist() for line in sheet(Drawing((square,), sheet=(90.0, 70.0)))]
    [[[0.0, 0.0], [90.0, 0.0], [90.0, 70.0], [0.0, 70.0]]]
    """
    if drawing.sheet is None:
        return []
    wide, high = drawing.sheet
    corners = np.array([[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high]])
    return [Line("sheet", corners, closed=True)]


def identifiers(parts: Iterable[Part]) -> list[str]:
    """Make names of groups from the names of parts: without special characters, all different.

    >>> square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
    >>> identifiers([Part(name, square) for name in ("left/1", "Left 1", "")])
    ['left_1', 'Left_1-2', 'part']
    """
    return different(
        re.sub(r"[^\w.-]+", "_", part.name)[:100].strip("_") or "part" for part in parts
    )


def title(part: Part) -> str:
    """Return the name of a part, and how many of it are needed if more than one.

    >>> square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
    >>> title(Part("left", square, count=2))
    'left, 2 times'
    """
    return printable(part.name) + (f", {part.count} times" if part.count != 1 else "")


def printable(text: str) -> str:
    r"""Return a text as one line of printable characters.

    >>> printable("panel 3\n x 2\x00")
    'panel 3 x 2'
    """
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _numbers(part: Part, depth: float, height: float) -> list[Label]:
    """Place the texts of notches inside the part, beside a notch where it is narrow or holed.

    A text without room is left out; others of its seam have room.
    """
    import shapely

    shape = region(part.outline, part.holes)
    shapely.prepare(shape)
    found = []
    for notch in part.notches:
        text = printable(notch.text)
        along = np.array([notch.inward[1], -notch.inward[0]])
        # A letter is about 0.7 of its height wide.
        ends = 0.5 * height * _CORNERS * [0.7 * len(text), 1.0]
        for side in (0.0, 1.5, -1.5):
            at = notch.at + (depth + height) * notch.inward + side * height * along
            if shapely.contains_xy(shape, *(at + ends).T).all():
                found.append(Label(text, at, height))
                break
    return found


def _line(kind: str, points: Array, closed: bool = False) -> Line:
    line = np.asarray(points, float)
    if len(line) > 3 and np.array_equal(line[0], line[-1]):
        return Line(kind, line[:-1], closed=True)
    return Line(kind, line, closed)


def _zone(part: Part, bend: Bend) -> Zone | None:
    return part.zones[bend.zone] if 0 <= bend.zone < len(part.zones) else None


def _kind(part: Part, bend: Bend) -> str:
    zone = _zone(part, bend)
    if zone is not None and not zone.pressed:
        return "roll"
    return "mountain" if bend.angle > 0 else "valley"


def _bends(part: Part) -> list[Bend]:
    return [bend for bend in part.bends if abs(bend.angle) >= _FLAT]


def _depth(part: Part) -> float:
    return min(_NOTCH, _SHARE * min(part.size))


def _grain(part: Part, grain: Array) -> list[Line]:
    """Return the grain line, inside the part and close to its middle, and the head of its arrow."""
    import shapely

    along = grain / np.hypot(*grain)
    across = np.array([-along[1], along[0]])
    middle = part.low + 0.5 * np.array(part.size)
    far = np.hypot(*part.size) * along
    inside = common(
        region(part.outline, part.holes), shapely.LineString([middle - far, middle + far])
    )
    chord = max(shapely.get_parts(inside), key=shapely.length, default=inside)
    least = 0.5 * min(part.size)
    ends = (shapely.get_coordinates(chord) - middle) @ along
    start, end = (ends.min(), ends.max()) if chord.length > 0 else (-least, least)
    half = 0.5 * _GRAIN * (end - start)
    centre = middle + 0.5 * (start + end) * along
    tail, tip = centre - half * along, centre + half * along
    back, side = 2 * _HEAD * half * along, _HEAD * half * across
    head = np.stack([tip - back + side, tip, tip - back - side])
    return [Line("grain", np.stack([tail, tip])), Line("arrow", head)]
