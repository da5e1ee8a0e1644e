"""Flat parts as SVG drawings in millimetres: a layer per operation, a group per part."""

from __future__ import annotations

import io
from os import PathLike
from typing import Any

import numpy as np

from gso.io.atomic import check_writable, replacing
from gso.spelling import known_keywords
from gso.typing import Array
from gso.workshop.part import Drawing, Part
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import Layer, layer_set
from gso.workshop.writers.strokes import Line, Text
from gso.workshop.writers.writer_checks import check, length

SUFFIX = ".svg"
PACKAGE = "svgwrite"

# Least line width on paper in millimetres, and the least as a fraction of the larger side.
_FINEST = 0.1
_SHARE = 1 / 1500
# Margin of a drawing without a sheet, as a multiple of the line width.
_MARGIN = 10.0
# Height of capital letters as a fraction of the font size, in the usual sans-serif fonts.
_CAPITAL = 0.72


@known_keywords()
def write(
    drawing: Drawing,
    path: str | PathLike[str],
    *,
    layers: str = "operations",
    stroke: float | None = None,
    bend_text: bool = False,
) -> None:
    """Write parts as an SVG drawing at the scale 1:1.

    Widths, heights and coordinates are in millimetres; y points down in the file, as in every
    SVG file. Layers are Inkscape layers, named and coloured by operation, with a group for each
    part. Each bend has its direction, angle and radius as its title. If the drawing has a sheet,
    the page is the sheet.

    Parameters
    ----------
    drawing : Drawing
    path : str or PathLike
        A file whose name ends in .svg. It is replaced only when the new one is complete.
    layers : {"operations", "astm"}
        Names of the layers: operations, or the numbers of ASTM D6673.
    stroke : float, optional
        Line width in millimetres; by default 0.1, but at least 1/1500 of the larger side.
    bend_text : bool
        Also write the direction, angle and radius beside each bend.

    Raises
    ------
    OptionError
        Unknown layers, or a line width that is not a positive number.
    MeshError
        The drawing is empty, a part is not usable, or the file cannot be written.

    Examples
    --------
    >>> import os, tempfile
    >>> from gso.workshop.part import Part
    >>> plate = Part("plate", np.array([[0.0, 0], [80, 0], [80, 50], [0, 50]]))
    >>> path = os.path.join(tempfile.mkdtemp(), "plate.svg")
    >>> write(Drawing((plate,)), path, stroke=0.5)
    >>> print(open(path).read().splitlines()[1][:60])
    <svg baseProfile="full" height="60mm" version="1.1" viewBox=
    """
    check_writable(path, (SUFFIX,))
    check(drawing)
    chosen = layer_set(layers)
    low, high = drawing.bounds
    size = float((high - low).max())
    width = max(_FINEST, _SHARE * size) if stroke is None else length("stroke", stroke)
    margin = 0.0 if drawing.sheet is not None else _MARGIN * width
    page = _Page(low - margin, high + margin, width)
    named = list(zip(drawing.parts, strokes.identifiers(drawing.parts), strict=True))
    drawn: list[list[Line | Text]] = [
        [*strokes.lines(part), *strokes.texts(part, bend_text)] for part in drawing.parts
    ]
    for layer in dict.fromkeys(chosen.values()):
        group = page.layer(layer, is_text=layer == chosen["text"])
        if layer == chosen["sheet"]:
            for border in strokes.sheet(drawing):
                group.add(page.line(border))
        for (part, name), every in zip(named, drawn, strict=True):
            mine = [each for each in every if chosen.get(each.kind) == layer]
            if mine:
                inner = group.add(page.group(f"{layer.name}-{name}", part))
                for each in mine:
                    inner.add(page.text(each) if isinstance(each, Text) else page.line(each))
        page.add(group)
    with replacing(path) as file:
        file.write(page.content())


class _Page:
    """A page with y down, made of svgwrite's elements.

    Parameters
    ----------
    low, high : ndarray, (2,)
        Its corners in the coordinates of the parts.
    width : float
        Line width in millimetres.
    """

    def __init__(self, low: Array, high: Array, width: float):
        import svgwrite
        from svgwrite.extensions import Inkscape

        wide, tall = (high - low).tolist()
        self._corner = np.array([low[0], high[1]])
        self._width = width
        self._page = svgwrite.Drawing(
            size=(f"{wide:.12g}mm", f"{tall:.12g}mm"),
            viewBox=f"0 0 {wide:.12g} {tall:.12g}",
            debug=False,
        )
        self._inkscape = Inkscape(self._page)

    def layer(self, layer: Layer, is_text: bool) -> Any:
        look: dict[str, Any] = {"fill": layer.colour, "stroke": "none"}
        if not is_text:
            look = {"fill": "none", "stroke": layer.colour, "stroke_width": f"{self._width:.6g}"}
            look |= {"stroke_linecap": "round", "stroke_linejoin": "round"}
        return self._inkscape.layer(label=layer.name, id=_identifier(layer.name), **look)

    def group(self, name: str, part: Part) -> Any:
        group = self._page.g(id=_identifier(name))
        times = f", {part.count} times" if part.count != 1 else ""
        group.set_desc(title=strokes.printable(part.name) + times)
        return group

    def line(self, line: Line) -> Any:
        points = self._placed(line.points).tolist()
        drawn = "M" + "L".join(f"{x:.12g} {y:.12g}" for x, y in points)
        path = self._page.path(d=drawn + ("Z" if line.closed else ""))
        if line.bend is not None:
            path.set_desc(title=strokes.about(line.bend))
        return path

    def text(self, text: Text) -> Any:
        x, y = self._placed(text.start).tolist()
        drawn = self._page.text(
            text.text,
            insert=(f"{x:.12g}", f"{y:.12g}"),
            font_size=f"{text.height / _CAPITAL:.6g}",
            font_family="sans-serif",
            text_anchor="middle",
        )
        if text.angle:
            degrees = -np.degrees(text.angle)
            drawn["transform"] = f"rotate({degrees:.9g} {x:.12g} {y:.12g})"
        return drawn

    def add(self, group: Any) -> None:
        """Add a layer if there is something on it."""
        if group.elements:
            self._page.add(group)

    def content(self) -> bytes:
        text = io.StringIO()
        self._page.write(text)
        return text.getvalue().encode("utf-8")

    def _placed(self, points: Array) -> Array:
        return np.asarray((points - self._corner) * (1.0, -1.0))


def _identifier(name: str) -> str:
    """Make an identifier of XML, which begins with a letter."""
    return name if name[:1].isalpha() else f"layer-{name}"
