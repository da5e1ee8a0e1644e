"""Parts of panels: outline, bends, notches, labels, holes and tabs, in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gso.geometry.flat_region import moved, region
from gso.geometry.polygon import anticlockwise, arc_lengths, points_at, rectangle
from gso.pattern import Bend
from gso.typing import Array
from gso.verdict import Reason
from gso.workshop.finish import Finish
from gso.workshop.marks import cut, marked
from gso.workshop.name_places import name_place
from gso.workshop.offsets import offset, with_allowance
from gso.workshop.panels import Made, Mating, Panel, Side
from gso.workshop.part import Label, Notch, Part
from gso.workshop.polygons import roomiest
from gso.workshop.seam_strips import with_strips
from gso.workshop.tabs import TabSeam, with_tabs
from gso.workshop.thickness import thickened
from gso.workshop.traced_guides import guide_lines

#: Angle, in radians, from which on a bend is drawn; smaller ones are added to the next.
_DRAWN = np.radians(0.2)
#: Corners of the polygon of a registration hole.
_ROUND = 48
#: Largest number of notches of a seam, but for one, and their distance if there are only holes.
_NOTCHES, _APART = 50, 50.0
#: Height of the numbers of seams without names, in millimetres.
_NUMBERS = 4.0


@dataclass(frozen=True, eq=False)
class Joint:
    """A seam on one part, in its place.

    Attributes
    ----------
    number : int
    line : ndarray, (k, 2)
        Its points on the outline, the part to the left.
    along : ndarray, (k,)
        Their arc length in space. Where the sides are two curves in space, the arc length of
        this one in the pattern, equal on both sides half-way along the seam.
    length : float
        Length of the seam in space.
    first : bool
        Whether it is the side that gets tabs.
    angle : float
        Angle between the faces on both sides, as that of a :class:`Mating`.
    mark : str
        Text of its notches.
    """

    number: int
    line: Array
    along: Array
    length: float
    first: bool
    angle: float
    mark: str


@dataclass(frozen=True, eq=False)
class Fitted:
    """The panels of a design in millimetres, with what is drawn on them.

    Attributes
    ----------
    made : Made
    scale : float
        Millimetres per unit of length of the design.
    panels : tuple of Panel
        With patterns in millimetres, for the thickness of the sheet.
    marks, holes : list of list of ndarray (k, 2)
        Those of each panel.
    reasons : tuple of Reason
        Why other holes cannot be cut.
    """

    made: Made
    scale: float
    panels: tuple[Panel, ...]
    marks: list[list[Array]]
    holes: list[list[Array]]
    reasons: tuple[Reason, ...]


def fitted(
    made: Made,
    scale: float,
    finish: Finish,
    marks: Sequence[ArrayLike] = (),
    holes: Sequence[ArrayLike] = (),
) -> Fitted:
    """Fit the panels of a design to the sheet, and carry marks and holes to them.

    Parameters
    ----------
    made : Made
    scale : float
        Millimetres per unit of length of the design.
    finish : Finish
    marks, holes : sequence of array_like, (k, 3)
        Lines to engrave, and closed lines to cut, on the surface.
    """
    panels = tuple(scaled(made.panels, scale, finish))
    flats = [panel.flat for panel in panels]
    drawn = marked(made.panels, marks, flats)
    return Fitted(made, scale, panels, drawn, *cut(made.panels, holes, flats))


def parts_from(fitted: Fitted, finish: Finish) -> tuple[list[Part], list[int]]:
    """Make the parts of fitted panels.

    Also return the numbers of the seams along which no tab, overlap or flange is possible where
    one is asked for.
    """
    panels = fitted.panels
    joints: list[list[Joint]] = [[] for _ in panels]
    seams = []
    for seam in fitted.made.matings:
        both = []
        for side, first in ((seam.one, True), (seam.two, False)):
            joint = _joint(panels[side.panel], seam, side, fitted.scale, first)
            joints[side.panel].append(joint)
            both.append((side.panel, joint))
        seams.append(both)
    bare = [_bare(*own) for own in zip(panels, fitted.marks, fitted.holes, strict=True)]
    tabs = [_tab_seams(number, seams, bare) for number in range(len(panels))]
    missing: list[int] = []
    if finish.registration is not None:
        bare = _registered(bare, seams, finish, *finish.registration)
    if finish.tabs is not None or finish.numbers is not None:
        numbered = finish.notches is None or finish.numbers is not None
        numbers = (finish.labels or _NUMBERS) if numbered else None
        bare, missing = with_tabs(bare, tabs, finish.tabs, numbers=numbers, place=finish.numbers)
    if finish.seam_strip:
        widths = (finish.seam_overlap, finish.seam_flange)
        bare, missing = with_strips(bare, tabs, *widths, finish.thickness)
    return [_finished(*own, finish) for own in zip(bare, joints, strict=True)], missing


def scaled(panels: Sequence[Panel], scale: float, finish: Finish) -> list[Panel]:
    """Return panels whose patterns are in millimetres, for the thickness of the sheet."""
    out = []
    for panel in panels:
        own = replace(
            panel,
            flat=scale * panel.flat,
            radii=scale * panel.radii,
            zones=tuple(zone.scaled(scale) for zone in panel.zones),
        )
        out.append(own if finish.thickness is None else thickened(own, finish.thickness))
    return out


def _bare(panel: Panel, marks: Sequence[Array], cut: Sequence[Array]) -> Part:
    """Make the part of one panel, whose pattern is in millimetres, as it lies there."""
    loops = [panel.flat[loop] for loop in panel.loops]
    outline, *holes = map(anticlockwise, loops)
    holes = [hole[::-1] for hole in holes] + list(cut)
    return Part(
        panel.name,
        outline,
        tuple(holes),
        drawn(panel.lines),
        marks=tuple(marks),
        zones=panel.zones,
        faces=panel.faces,
        guides=guide_lines(panel),
    )


def drawn(bends: Sequence[Bend]) -> tuple[Bend, ...]:
    """Return the bends that are drawn: small ones are added to the next, so that none is lost.

    Folds, whose radius is 0, are drawn in any case.

    >>> line = np.zeros((2, 2))
    >>> some = [Bend(line, np.radians(x), 9.0) for x in (0.15, 0.1, 0.1, -0.1, 5.0)]
    >>> [round(float(np.degrees(bend.angle)), 2) for bend in drawn(some)]
    [0.25, 5.0]
    """
    out, angle = [], 0.0
    for bend in bends:
        angle += bend.angle
        if abs(angle) >= _DRAWN or bend.radius == 0:
            out.append(bend._replace(angle=angle))
            angle = 0.0
    return tuple(out)


def _tab_seams(
    number: int, seams: Sequence[Sequence[tuple[int, Joint]]], parts: Sequence[Part]
) -> list[TabSeam]:
    """Return the seams of a part with the places of the other side, one for each side of it."""
    out = []
    for seam in seams:
        for (own, here), (other, there) in (seam, seam[::-1]):
            if own == number:
                at = here.length - here.along
                line = points_at(at, there.along, there.line)
                seam_line = (here.line, line, parts[other])
                out.append(TabSeam(here.number, *seam_line, here.first, here.angle))
    return out


def _finished(part: Part, joints: Sequence[Joint], finish: Finish) -> Part:
    """Add notches, allowance, kerf and texts to a part, and turn it long side along x."""
    if finish.notches is not None:
        spacing = finish.notches
        part = replace(part, notches=tuple(n for j in joints for n in _notches(j, spacing)))
    part = part.turned(-rectangle(part.outline)[0])
    part = offset(with_allowance(part, finish.allowance), 0.5 * finish.kerf)
    if finish.face == "inside":
        part = part.mirrored()
    part = part.shifted(-part.low)
    if finish.labels is not None:
        part = replace(part, labels=(*_name(part, finish.labels), *part.labels))
    return replace(part, grain=np.array([1.0, 0.0])) if finish.grain else part


def _joint(panel: Panel, seam: Mating, side: Side, scale: float, first: bool) -> Joint:
    line, along = side.on(panel.flat), scale * seam.along
    length = float(along[-1])
    if not seam.common and length > 0:
        line, own = _outline(panel, side)
        along = arc_lengths(line) - np.interp(0.5 * length, along, own) + 0.5 * length
    if not first:
        line, along = line[::-1], length - along[::-1]
    mark = str(seam.kind or seam.number)
    return Joint(seam.number, line, along, length, first, seam.angle, mark)


def _outline(panel: Panel, side: Side) -> tuple[Array, Array]:
    """Return the outline (m, 2) from the first to the last point of a side.

    Also the arc length along it up to each point of the side, (k,).
    """
    first = side.edges[0]
    loop = next(loop for loop in panel.loops if np.isin(first, loop).all())
    ring = panel.flat[loop]
    size = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    start, total = np.r_[0.0, np.cumsum(size)[:-1]], float(size.sum())
    place = np.full(len(panel.flat), -1)
    place[loop] = np.arange(len(loop))
    a, b = place[side.edges].T
    ahead = (a + 1) % len(loop) == b
    share = np.where(ahead, side.shares, 1.0 - side.shares)
    at = start[np.where(ahead, a, b)] + share * size[np.where(ahead, a, b)]
    # Steps between points are shorter than half of the outline.
    step = np.diff(at)
    own = np.r_[0.0, np.cumsum(step - total * np.round(step / total))]
    way = 1.0 if own[-1] >= 0 else -1.0
    far = way * (start - at[0]) % total
    between = np.flatnonzero((far > 0) & (far < abs(own[-1])))
    between = between[np.argsort(far[between])]
    ends = side.on(panel.flat)[[0, -1]]
    return np.concatenate([ends[:1], ring[between], ends[1:]]), way * own


def places(length: float, spacing: float) -> Array:
    """Return the arc lengths of the notches of a seam: an odd number of them, evenly.

    A seam has no more than 51, whatever their distance.

    >>> places(100.0, 30.0).tolist()
    [25.0, 50.0, 75.0]
    """
    count = min(max(int(length / spacing), 1), _NOTCHES)
    count += 1 - count % 2
    return length * np.arange(1, count + 1) / (count + 1)


def _notches(joint: Joint, spacing: float) -> list[Notch]:
    """Return the notches of one side, in the order of its line: the other side's are reversed."""
    if not joint.length > 0:
        return []
    at = places(joint.length, spacing)
    # Both sides of a seam have their notches at the same points of the surface.
    k = np.clip(np.searchsorted(joint.along, at, "right") - 1, 0, len(joint.along) - 2)
    step = joint.along[k + 1] - joint.along[k]
    share = np.clip((at - joint.along[k]) / np.maximum(step, 1e-300), 0.0, 1.0)
    way = joint.line[k + 1] - joint.line[k]
    points = joint.line[k] + share[:, None] * way
    inward = np.stack([-way[:, 1], way[:, 0]], axis=1)
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-300)
    return [Notch(p, n, joint.mark) for p, n in zip(points, inward, strict=True)]


def _registered(
    parts: Sequence[Part],
    seams: Sequence[Sequence[tuple[int, Joint]]],
    finish: Finish,
    diameter: float,
    inset: float,
) -> list[Part]:
    """Add holes beside the notches of each seam, where both sides have room for them."""
    import shapely

    inside = [moved(region(p.outline, p.holes), -0.75 * diameter, 2.0) for p in parts]
    turn = -2.0 * np.pi * np.arange(_ROUND) / _ROUND
    ring = 0.5 * diameter * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    taken: list[list[Array]] = [[] for _ in parts]

    def free(number: int, middle: Array) -> bool:
        near = any(np.linalg.norm(middle - other) < 2.0 * diameter for other in taken[number])
        return not near and bool(inside[number].contains(shapely.Point(middle)))

    for seam in seams:
        sides = [_notches(joint, finish.notches or _APART) for _, joint in seam]
        for pair in zip(sides[0], reversed(sides[1]), strict=True):
            middles = [
                (number, notch.at + inset * notch.inward)
                for (number, _), notch in zip(seam, pair, strict=True)
            ]
            if all(free(*place) for place in middles):
                for number, middle in middles:
                    taken[number].append(middle)
    return [
        replace(part, holes=(*part.holes, *(ring + middle for middle in own)))
        for part, own in zip(parts, taken, strict=True)
    ]


def _name(part: Part, height: float) -> tuple[Label, ...]:
    """Place the name, no larger than fits; below it what the part is made of."""
    middle, high, angle = name_place(part, part.name, height)
    if not high > 0:
        return ()
    name = Label(part.name, middle, high, angle)
    if not part.faces:
        return (name,)
    room = roomiest(region(part.outline, part.holes))[1]
    low = min(0.5 * high, 2.0 * room / max(0.7 * len(part.made_of), 1.0))
    down = np.array([np.sin(angle), -np.cos(angle)])
    return (name, Label(part.made_of, middle + high * down, low, angle))
