"""Parts as PDF at the scale 1:1, on pages of paper that are put together."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gso.errors import OptionError
from gso.geometry.polygon import rectangle
from gso.quantities import as_positive
from gso.spelling import choices
from gso.typing import Array
from gso.workshop.assembly_view import TALL, Picture
from gso.workshop.part import Drawing, Part
from gso.workshop.polygons import is_clear
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import Layer
from gso.workshop.writers.tiles import FOOT, Tile, Tiling, tiled

if TYPE_CHECKING:
    from reportlab.pdfgen.canvas import Canvas

SUFFIX = ".pdf"
PACKAGE = "reportlab"

#: Width and height of papers in millimetres.
PAPERS = {
    "A0": (841.0, 1189.0),
    "A1": (594.0, 841.0),
    "A2": (420.0, 594.0),
    "A3": (297.0, 420.0),
    "A4": (210.0, 297.0),
}

# Margin of the pages, and by how much they overlap, in millimetres.
_MARGIN, _OVERLAP = 10.0, 10.0
# Points in a millimetre, and the line width in millimetres.
_POINT, _LINE = 72.0 / 25.4, 0.25
# Height of capital letters as a fraction of the font size (Helvetica).
_CAPITAL = 0.718
# Lengths of the scale bar, and height of the texts at the foot of a page.
_BARS, _TEXT = (100.0, 50.0), 3.0
# Sizes of the picture of a part's place, in millimetres: the first for which there is room.
_PLACES = (36.0, 26.0, 18.0)
# Steps of joining on a page, and in a row.
_EACH, _ROW = 6, 2
# Colours of lines of pictures, their widths in millimetres, and that of the part in its place.
_PICTURED = {"bends": ("#000000", 0.08), "rim": ("#000000", 0.2), "joined": ("#d4007a", 0.5)}
_HERE = "#f08a1c"
# Size of the crosses at the corners of a window.
_CROSS = 4.0


def content(
    drawing: Drawing,
    layers: dict[str, Layer],
    *,
    paper: str = "A4",
    overlap: float = _OVERLAP,
    margin: float = _MARGIN,
    bend_text: bool = False,
    places: Mapping[str, tuple[Picture, Sequence[Array]]] | None = None,
    steps: Sequence[tuple[str, Picture, Sequence[str]]] = (),
) -> bytes:
    """Return parts as a PDF at the scale 1:1, divided into pages.

    Each part that fits has a page of its own, turned if need be. Others and sheets are divided:
    each page has a window of the drawing with crosses at its corners, dashed lines where the
    neighbouring pages begin, its name (A1 is the upper left page) and a scale bar. Pages without
    parts are left out. Where there are several, a page before them shows how they are put together.

    Parameters
    ----------
    drawing : Drawing
    paper : {"A0", "A1", "A2", "A3", "A4"}
    overlap, margin : float
        By how much pages overlap, and what stays free around each, in millimetres.
    layers : dict of Layer
        Colours of the lines by kind, from :func:`gso.workshop.writers.layers.layer_set`.
    bend_text : bool
        Also write the direction, angle and radius beside each bend.
    places : mapping, optional
        By the name of a part the picture of its design, and outlines (k, 2) of the part in it:
        drawn small on the page of the part.
    steps : sequence of (str, Picture, sequence of str)
        Title, picture and lines of text of the steps in which parts are joined, drawn on pages of
        their own at the end.

    Raises
    ------
    OptionError
        Unknown paper, or lengths that leave no room on the paper.

    Examples
    --------
    >>> from gso.workshop.part import Part
    >>> from gso.workshop.writers.layers import layer_set
    >>> plate = Part("plate", np.array([[0.0, 0], [300, 0], [300, 150], [0, 150]]))
    >>> content(Drawing((plate,)), layer_set("operations"), paper="A4")[:5]
    b'%PDF-'
    """
    check_paper(paper)
    gap, free = as_positive(overlap, "overlap", zero=True), as_positive(margin, "margin", zero=True)
    some = _tilings(drawing, paper, gap, free)
    stream = io.BytesIO()
    book = _Book(stream, free, gap, _count(some, len(steps)))
    for own, tiling in some:
        if len(tiling.tiles) > 1:
            book.overview(own, tiling, layers)
        for tile in tiling.tiles:
            book.tile(own, tiling, tile, layers, bend_text)
        if len(own.parts) == 1 == len(tiling.tiles) and own.parts[0].name in (places or {}):
            book.place(own.parts[0], tiling.tiles[0], *(places or {})[own.parts[0].name])
    for first in range(0, len(steps), _EACH):
        book.steps(PAPERS[paper], steps[first : first + _EACH])
    book.close()
    return stream.getvalue()


def page_count(drawing: Drawing, paper: str, steps: int = 0) -> int:
    """Return the number of pages that :func:`content` makes of parts and of some steps.

    >>> plate = Part("plate", np.array([[0.0, 0], [300, 0], [300, 150], [0, 150]]))
    >>> page_count(Drawing((plate,)), "A3"), page_count(Drawing((plate,)), "A4", steps=7)
    (1, 5)
    """
    check_paper(paper)
    return _count(_tilings(drawing, paper, _OVERLAP, _MARGIN), steps)


def room(paper: str, margin: float = _MARGIN) -> tuple[float, float]:
    """Return length and width of the window of an upright page, in millimetres.

    >>> room("A4")
    (265.0, 190.0)
    """
    check_paper(paper)
    wide, high = PAPERS[paper]
    return high - 2 * margin - FOOT, wide - 2 * margin


def on_page(part: Part, paper: str, margin: float = _MARGIN) -> Part | None:
    """Return a part as it lies on one page, turned if need be; None if it is larger.

    >>> square = Part("a", np.array([[0.0, 0], [250, 0], [250, 180], [0, 180]]))
    >>> [round(side) for side in on_page(square, "A4").size]
    [180, 250]
    """
    high, wide = room(paper, margin)
    x, y = part.size
    # Across, the foot of the page takes room of the width.
    if (x <= wide and y <= high) or (x <= high + FOOT and y <= wide - FOOT):
        return part
    if x <= high and y <= wide:
        return part.turned(0.5 * np.pi)
    angle, (long, short) = rectangle(part.outline, (high, wide))
    return part.turned(0.5 * np.pi - angle) if long <= high and short <= wide else None


def _tilings(
    drawing: Drawing, paper: str, overlap: float, margin: float
) -> list[tuple[Drawing, Tiling]]:
    """Return the drawings that pages are made of, each with its pages."""
    own = _divided(drawing, paper, margin)
    return [(one, tiled(one, PAPERS[paper], overlap, margin)) for one in own]


def _count(some: Sequence[tuple[Drawing, Tiling]], steps: int) -> int:
    """Count pages of drawings, with a page before several of one drawing, and those of steps."""
    own = sum(len(tiling.tiles) + (len(tiling.tiles) > 1) for _, tiling in some)
    return own + -(-steps // _EACH)


def _divided(drawing: Drawing, paper: str, margin: float) -> list[Drawing]:
    """Give each part that fits a page a drawing of its own; other parts stay together."""
    if drawing.sheet is not None:
        return [drawing]
    own, rest = [], []
    for part in drawing.parts:
        lying = on_page(part, paper, margin)
        if lying is None:
            rest.append(part)
        else:
            own.append(Drawing((lying,), title=strokes.title(part)))
    return [*own, *([replace(drawing, parts=tuple(rest))] if rest else [])]


def check_paper(paper: object) -> None:
    """Raise an OptionError if there is no such paper."""
    if not isinstance(paper, str) or paper not in PAPERS:
        raise OptionError(f"no paper {paper!r}; {choices(paper, PAPERS)}")


def _wrapped(canvas: Canvas, words: Sequence[str], width: float, size: float) -> list[str]:
    """Break lines of text at spaces so that each has at most a width, in the canvas' unit."""
    out = []
    for text in words:
        line = ""
        for word in strokes.printable(text).split():
            longer = f"{line} {word}".strip()
            if line and canvas.stringWidth(longer, "Helvetica", size) > width:
                out.append(line)
                line = word
            else:
                line = longer
        out.append(line)
    return out


class _Book:
    """The pages, made with ReportLab; its unit is the millimetre.

    Parameters
    ----------
    stream : file
    margin, overlap : float
    pages : int
        How many there will be.
    """

    def __init__(self, stream: io.BytesIO, margin: float, overlap: float, pages: int):
        from reportlab.pdfgen.canvas import Canvas

        self._margin, self._overlap = margin, overlap
        # The same drawing always gives the same bytes.
        self._canvas = Canvas(stream, invariant=1)
        self._page, self._pages = 0, pages

    def close(self) -> None:
        self._canvas.save()

    def overview(self, drawing: Drawing, tiling: Tiling, layers: dict[str, Layer]) -> None:
        """Draw all pages, scaled down, with their names."""
        tiles = tiling.tiles
        low = np.min([tile.low for tile in tiles], axis=0)
        high = np.max([tile.high for tile in tiles], axis=0)
        room = np.array(tiling.page) - 2.0 * self._margin - [0.0, FOOT]
        scale = float((room / (high - low)).min())
        c = self._begin(tiling)
        c.saveState()
        c.translate(self._margin, self._margin + FOOT)
        c.scale(scale, scale)
        c.translate(*(-low).tolist())
        self._draw(drawing, layers, False, _LINE / scale)
        c.setStrokeGray(0.5)
        c.setFillGray(0.5)
        c.setLineWidth(_LINE / scale)
        for tile in tiles:
            wide, high_ = (tile.high - tile.low).tolist()
            c.rect(*tile.low.tolist(), wide, high_)
            x, y = (0.5 * (tile.low + tile.high)).tolist()
            c.setFont("Helvetica", 0.15 * min(wide, high_))
            c.drawCentredString(x, y, tile.name)
        c.restoreState()
        said = f"how the pages are put together, {scale:.3g} : 1"
        self._foot(drawing, tiling, said, bar=False)

    def tile(
        self,
        drawing: Drawing,
        tiling: Tiling,
        tile: Tile,
        layers: dict[str, Layer],
        bend_text: bool,
    ) -> None:
        """Draw one page at the scale 1:1."""
        c = self._begin(tiling)
        wide, high = (tile.high - tile.low).tolist()
        c.saveState()
        c.translate(self._margin, self._margin + FOOT)
        frame = c.beginPath()
        frame.rect(0, 0, wide, high)
        c.clipPath(frame, stroke=0)
        c.translate(*(-tile.low).tolist())
        self._draw(drawing, layers, bend_text, _LINE)
        c.restoreState()
        self._marks(tiling, wide, high)
        self._foot(drawing, tiling, tile.name)

    def place(self, part: Part, tile: Tile, picture: Picture, loops: Sequence[Array]) -> None:
        """Draw the place of a part, in a corner of its page that the part leaves free."""
        shape = np.array(picture.size) / max(picture.size)
        for size in _PLACES:
            for share in ((1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (0.0, 0.0)):
                corner = tile.low + share * (tile.high - tile.low - size * shape)
                if is_clear(part.outline, corner, corner + size * shape):
                    at = corner - tile.low + [self._margin, self._margin + FOOT]
                    self._picture(picture, at, size, names=False)
                    self._here(picture, at, size, loops)
                    return

    def steps(
        self, paper: tuple[float, float], steps: Sequence[tuple[str, Picture, Sequence[str]]]
    ) -> None:
        """Draw steps of joining on one page, with what they join."""
        c = self._begin_page(paper)
        wide, high = np.array(paper) - 2.0 * self._margin
        cell = np.array([wide / _ROW, (high - FOOT) / -(-_EACH // _ROW)])
        for k, (title, picture, words) in enumerate(steps):
            row, column = divmod(k, _ROW)
            low = np.array([self._margin, self._margin + FOOT + high - FOOT]) + cell * [
                column,
                -row - 1,
            ]
            c.setFillGray(0.0)
            c.setFont("Helvetica-Bold", _TEXT / _CAPITAL)
            c.drawString(low[0], low[1] + cell[1] - 2.0 * _TEXT, strokes.printable(title))
            c.setFont("Helvetica", 0.8 * _TEXT / _CAPITAL)
            said = _wrapped(c, words, cell[0] - 4.0, 0.8 * _TEXT / _CAPITAL)
            foot = 1.5 * _TEXT * len(said)
            for number, line in enumerate(said):
                c.drawString(low[0], low[1] + foot - 1.5 * _TEXT * (number + 1) + 1.0, line)
            shape = np.array(picture.size) / max(picture.size)
            size = float(((cell - [6.0, foot + 4.0 * _TEXT]) / shape).min())
            self._picture(picture, low + np.array([0.0, foot + 2.0]), size)
        c.setFillGray(0.0)
        c.setFont("Helvetica", _TEXT / _CAPITAL)
        said_page = f"order of joining, page {self._page} of {self._pages}"
        c.drawString(self._margin, self._margin, said_page)

    def _picture(self, picture: Picture, at: Array, size: float, names: bool = True) -> None:
        """Draw a picture whose larger side has a size; `at` is its lower left corner."""
        from PIL.Image import fromarray
        from reportlab.lib.utils import ImageReader

        c = self._canvas
        scale = size / max(picture.size)
        c.saveState()
        c.translate(*at.tolist())
        c.drawImage(ImageReader(fromarray(picture.image)), 0, 0, *(scale * x for x in picture.size))
        c.setDash()
        for kind, lines in picture.lines.items():
            colour, width = _PICTURED[kind]
            c.setStrokeColor(colour)
            c.setLineWidth(min(width, 0.006 * size))
            path = c.beginPath()
            for one, two in (scale * lines).tolist():
                path.moveTo(*one)
                path.lineTo(*two)
            c.drawPath(path)
        for name in picture.names if names else ():
            c.setFillColor(_PICTURED["joined"][0] if name.kind == "seam" else "#000000")
            c.setFont("Helvetica-Bold", max(scale * TALL, 1.8) / _CAPITAL)
            c.drawCentredString(*(scale * name.at).tolist(), strokes.printable(name.text))
        c.restoreState()

    def _here(self, picture: Picture, at: Array, size: float, loops: Sequence[Array]) -> None:
        """Fill a part in a picture."""
        c = self._canvas
        c.saveState()
        c.translate(*at.tolist())
        c.setFillColor(_HERE, alpha=0.6)
        c.setStrokeColor(_HERE)
        c.setLineWidth(0.3)
        path = c.beginPath()
        for loop in loops:
            points = (size / max(picture.size) * loop).tolist()
            path.moveTo(*points[0])
            for point in points[1:]:
                path.lineTo(*point)
            path.close()
        c.drawPath(path, stroke=1, fill=1, fillMode=0)
        c.restoreState()

    def _begin(self, tiling: Tiling) -> Canvas:
        return self._begin_page(tiling.page)

    def _begin_page(self, size: tuple[float, float]) -> Canvas:
        if self._page:
            self._canvas.showPage()
        self._page += 1
        self._canvas.setPageSize([_POINT * side for side in size])
        self._canvas.scale(_POINT, _POINT)
        return self._canvas

    def _draw(
        self, drawing: Drawing, layers: dict[str, Layer], bend_text: bool, width: float
    ) -> None:
        c = self._canvas
        c.setLineWidth(width)
        c.setLineCap(1)
        for line in strokes.sheet(drawing):
            self._line(line, layers["sheet"], width)
        for part in drawing.parts:
            for line in strokes.lines(part):
                if line.kind in layers:
                    self._line(line, layers[line.kind], width)
            c.setFillColor(layers["text"].colour)
            for text in strokes.texts(part, bend_text):
                c.saveState()
                c.translate(*text.start.tolist())
                c.rotate(float(np.degrees(text.angle)))
                c.setFont("Helvetica", text.height / _CAPITAL)
                c.drawCentredString(0, 0, text.text)
                c.restoreState()

    def _line(self, line: strokes.Line, layer: Layer, width: float) -> None:
        c = self._canvas
        c.setStrokeColor(layer.colour)
        share = width / _LINE
        c.setDash([share * x for x in layer.dash]) if layer.dash else c.setDash()
        points: Array = line.points
        path = c.beginPath()
        path.moveTo(*points[0].tolist())
        for x, y in points[1:].tolist():
            path.lineTo(x, y)
        if line.closed:
            path.close()
        c.drawPath(path, stroke=1, fill=0)

    def _marks(self, tiling: Tiling, wide: float, high: float) -> None:
        """Draw crosses at the corners of the window, and where the neighbours' windows begin."""
        c, x0, y0 = self._canvas, self._margin, self._margin + FOOT
        c.setDash()
        c.setStrokeGray(0.4)
        c.setLineWidth(0.5 * _LINE)
        for x in (x0, x0 + wide):
            for y in (y0, y0 + high):
                c.line(x - _CROSS, y, x + _CROSS, y)
                c.line(x, y - _CROSS, x, y + _CROSS)
        c.setDash([2, 2])
        gap = self._overlap
        if tiling.columns > 1:
            for x in (x0 + gap, x0 + wide - gap):
                c.line(x, y0, x, y0 + high)
        if tiling.rows > 1:
            for y in (y0 + gap, y0 + high - gap):
                c.line(x0, y, x0 + wide, y)
        c.setDash()

    def _foot(self, drawing: Drawing, tiling: Tiling, name: str, bar: bool = True) -> None:
        """Write the page's name, number and title, and draw the scale bar."""
        c, x, y = self._canvas, self._margin, self._margin
        c.setDash()
        c.setFillGray(0.0)
        c.setStrokeGray(0.0)
        c.setLineWidth(_LINE)
        c.setFont("Helvetica", _TEXT / _CAPITAL)
        title = strokes.printable(drawing.title)
        said = f"{name}, page {self._page} of {self._pages}"
        c.drawString(x, y, f"{title}: {said}" if title else said)
        if not bar:
            return
        wide = tiling.page[0] - 2.0 * self._margin
        size = next((b for b in _BARS if b <= 0.45 * wide), _BARS[-1])
        right = tiling.page[0] - self._margin
        c.line(right - size, y + 6.0, right, y + 6.0)
        for end in (right - size, right):
            c.line(end, y + 4.5, end, y + 7.5)
        c.drawRightString(right, y, f"{size:g} mm; print at 100 %")
