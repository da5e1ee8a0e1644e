"""Drawings of parts and sheets for the page: SVG whose lines and texts can be picked."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from gso.geometry.rigid import closest_motion
from gso.typing import Array
from gso.workshop.name_places import name_place
from gso.workshop.page_svg import PageSVG
from gso.workshop.part import Drawing, Label, Part
from gso.workshop.writers import strokes

#: Margin, least length of notches, and height of names, as shares of a drawing's larger side.
_ROOM, _NOTCH, _NAME = 0.015, 0.02, 0.045
#: Height of a name as a share of a sheet's larger side.
_ON_SHEET = 0.018
#: Kinds of lines whose paths are joined to one.
_PLAIN = ("grain", "arrow", "mark", "crease", "guide", "seam")


def part_drawing(part: Part, number: int) -> str:
    """Draw a part.

    Its lines are a group of their own, ``lines-N``, which sheets repeat. Bends have their number
    as ``data-bend``, notches the text beside them as ``data-mark``.

    Parameters
    ----------
    part : Part
    number : int
        Of the part on the page.
    """
    low, high = Drawing((part,)).bounds
    size = float(np.maximum(high - low, 1e-9).max())
    room = _ROOM * size
    page = PageSVG(low - room, high + room, "drawing")
    root = page.root
    root.set("data-part", str(number))
    _, _, wide, tall = root.attrib["viewBox"].split()
    root.set("style", f"--w:{wide};--h:{tall}")
    lines = SubElement(root, "g", {"id": f"lines-{number}"})
    every = strokes.lines(part)
    page.path(
        lines,
        [line.points for line in every if line.kind in ("outline", "hole")],
        closed=True,
        kind="outline",
    )
    for kind in _PLAIN:
        own = [_closed(line) for line in every if line.kind == kind]
        page.path(lines, own, kind="mark" if kind == "crease" else kind)
    drawn = {id(bend): k for k, bend in enumerate(part.bends)}
    for line in every:
        if line.bend is not None:
            page.path(lines, [line.points], kind=line.kind)
            lines[-1].set("data-bend", str(drawn[id(line.bend)]))
    _notches(page, lines, part, size)
    _name(page, root, part, size)
    return page.text_of()


def sheet_drawing(drawing: Drawing, parts: Sequence[Part]) -> str:
    """Draw a sheet; the lines of parts are those of their own drawings.

    Parameters
    ----------
    drawing : Drawing
        Its parts are copies of `parts`, moved and turned, with the same names.
    parts : sequence of Part
    """
    low, high = drawing.bounds
    size = float((high - low).max())
    room = 0.3 * _ROOM * size
    page = PageSVG(low - room, high + room, "sheet-drawing")
    root = page.root
    for border in strokes.sheet(drawing):
        page.path(root, [border.points], closed=True, kind="sheet")
    number = {part.name: k for k, part in enumerate(parts)}
    for placed in drawing.parts:
        k = number[placed.name]
        group = SubElement(root, "g", {"class": "on-sheet", "data-part": str(k)})
        SubElement(group, "title").text = strokes.printable(placed.name)
        own = parts[k]
        bounds = Drawing((own,)).bounds
        margin = _ROOM * float((bounds[1] - bounds[0]).max())
        corner = np.array([bounds[0][0] - margin, bounds[1][1] + margin])
        # In the drawing of the part, y grows downwards from its upper left corner.
        flipped = np.array([1.0, -1.0])
        here = (own.outline - corner) * flipped
        there = (placed.outline - np.array([low[0] - room, high[1] + room])) * flipped
        turn, shift = closest_motion(here, there)
        cells = (*turn.T.ravel(), *shift)
        matrix = " ".join(f"{x:.7g}" for x in cells)
        SubElement(group, "use", {"href": f"#lines-{k}", "transform": f"matrix({matrix})"})
        _name(page, group, placed, size, _ON_SHEET)
    return page.text_of()


def _closed(line: strokes.Line) -> Array:
    return np.concatenate([line.points, line.points[:1]]) if line.closed else line.points


def _notches(page: PageSVG, lines: Element, part: Part, size: float) -> None:
    """Draw notches, and the text of each mark beside one of its notches."""
    marks: dict[str, Element] = {}
    drawn: dict[str, list[Array]] = {}
    texts: dict[str, Label] = {}
    for label in strokes.texts(part):
        texts.setdefault(label.text, label)
    for notch in part.notches:
        text = strokes.printable(notch.text)
        if text not in marks:
            marks[text] = SubElement(lines, "g", {"class": "notch", "data-mark": text})
            if text in texts:
                at = texts[text]
                page.text(marks[text], text, at.start, max(at.height, 0.6 * _NOTCH * size))
        end = notch.at + max(_NOTCH * size, 1e-9) * notch.inward
        drawn.setdefault(text, []).append(np.stack([notch.at, end]))
    for text, own in drawn.items():
        page.path(marks[text], own)


def _name(page: PageSVG, parent: Element, part: Part, size: float, share: float = _NAME) -> None:
    """Write the name where it lies inside the part, off bend lines where there is room."""
    text = strokes.printable(part.name)
    middle, high, angle = name_place(part, text, share * size)
    if high > 0:
        up = np.array([-np.sin(angle), np.cos(angle)])
        page.text(parent, text, middle - 0.5 * high * up, high, angle)
        parent[-1].set("class", "name")
