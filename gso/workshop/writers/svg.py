"""Flat parts as SVG drawings in millimetres: a layer per operation, a group per part."""

from __future__ import annotations

from gso.io.svg_page import SVGPage
from gso.quantities import as_positive
from gso.workshop.part import Drawing
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import Layer

SUFFIX = ".svg"

# Least line width on paper in millimetres, and the least as a fraction of the larger side.
_FINEST = 0.1
_SHARE = 1 / 1500
# Margin of a drawing without a sheet, as a multiple of the line width.
_MARGIN = 10.0


def content(
    drawing: Drawing,
    layers: dict[str, Layer],
    *,
    stroke: float | None = None,
    bend_text: bool = False,
) -> bytes:
    """Return parts as an SVG drawing at the scale 1:1.

    Widths, heights and coordinates are in millimetres; y points down in the file, as in every
    SVG file. Layers are Inkscape layers, named and coloured by operation, with a group for each
    part. Each bend has its direction, angle and radius as its title. If the drawing has a sheet,
    the page is the sheet.

    Parameters
    ----------
    drawing : Drawing
    layers : dict of Layer
        Layers by kind of line, from :func:`gso.workshop.writers.layers.layer_set`.
    stroke : float, optional
        Line width in millimetres; by default 0.1, but at least 1/1500 of the larger side.
    bend_text : bool
        Also write the direction, angle and radius beside each bend.

    Raises
    ------
    OptionError
        A line width that is not a positive number.

    Examples
    --------
    >>> import numpy as np
    >>> from gso.workshop.part import Part
    >>> from gso.workshop.writers.layers import layer_set
    >>> plate = Part("plate", np.array([[0.0, 0], [80, 0], [80, 50], [0, 50]]))
    >>> content(Drawing((plate,)), layer_set("operations"), stroke=0.5).decode()[-48:]
    '<path d="M5 55L85 55L85 5L5 5Z" /></g></g></svg>'
    """
    low, high = drawing.bounds
    size = float((high - low).max())
    width = max(_FINEST, _SHARE * size) if stroke is None else as_positive(stroke, "stroke")
    margin = 0.0 if drawing.sheet is not None else _MARGIN * width
    page = SVGPage(low - margin, high + margin)
    names = strokes.identifiers(drawing.parts)
    for layer in dict.fromkeys(layers.values()):
        inside = page.layer(layer.name, layer.colour, None if layer == layers["text"] else width)
        for border in strokes.sheet(drawing) if layer == layers["sheet"] else ():
            page.path(inside, [border.points], closed=True)
        for part, name in zip(drawing.parts, names, strict=True):
            drawn = [line for line in strokes.lines(part) if layers.get(line.kind) == layer]
            texts = strokes.texts(part, bend_text) if layer == layers["text"] else []
            if not (drawn or texts):
                continue
            group = page.group(inside, f"{layer.name}-{name}", strokes.title(part))
            for line in drawn:
                page.path(group, [line.points], closed=line.closed, title=line.title)
            for text in texts:
                page.text(group, text.text, text.start, text.height, text.angle)
    return page.content()
