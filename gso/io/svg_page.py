"""SVG pages in millimetres: layers of paths and texts."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from gso.typing import Array

_SVG = "http://www.w3.org/2000/svg"
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
# Height of capital letters as a fraction of the font size, in the usual sans-serif fonts.
_CAPITAL = 0.72


class SVGPage:
    """A page at the scale 1:1, whose groups of the first level are Inkscape layers.

    Points are given with y up, as in the package; in the file y points down.

    Parameters
    ----------
    low, high : ndarray, (2,)
        Opposite corners of the page.
    digits : int
        Significant digits of numbers.

    Attributes
    ----------
    root : Element
        The element ``svg``.

    Examples
    --------
    >>> page = SVGPage(np.zeros(2), np.array([40.0, 30.0]))
    >>> page.path(page.layer("cut", "#ff0000", 0.1), [np.array([[1.0, 2.0], [3.0, 4.0]])])
    >>> print(page.content().decode().splitlines()[1][-33:])
    <path d="M1 28L3 26" /></g></svg>
    """

    def __init__(self, low: Array, high: Array, digits: int = 10):
        self._corner = np.array([low[0], high[1]])
        self._digits = digits
        wide, tall = map(self._number, (high - low).tolist())
        size = {"width": f"{wide}mm", "height": f"{tall}mm", "viewBox": f"0 0 {wide} {tall}"}
        self.root = Element("svg", {"xmlns": _SVG} | size)

    def layer(self, name: str, colour: str, width: float | None = None) -> Element:
        """Add a layer of lines of a width, or of texts; it is left out if it stays empty."""
        self.root.set("xmlns:inkscape", _INKSCAPE)
        known = {"id": identifier(name), "inkscape:groupmode": "layer", "inkscape:label": name}
        look = {"fill": colour, "stroke": "none"}
        if width is not None:
            look = {"fill": "none", "stroke": colour, "stroke-width": self._number(width)}
            look |= {"stroke-linecap": "round", "stroke-linejoin": "round"}
        return SubElement(self.root, "g", known | look)

    def group(self, parent: Element, name: str, title: str) -> Element:
        """Add a group with a title to a layer."""
        group = SubElement(parent, "g", {"id": identifier(name)})
        SubElement(group, "title").text = title
        return group

    def path(
        self,
        parent: Element,
        lines: Sequence[Array] | Array,
        *,
        closed: bool = False,
        title: str = "",
        kind: str = "",
    ) -> None:
        """Add one path of polylines (k, 2), with a title and a class if they are given."""
        if len(lines) == 0:
            return
        end = "Z" if closed else ""
        point = f"%.{self._digits}g %.{self._digits}g"
        form = "".join(f"M{'L'.join([point] * len(line))}{end}" for line in lines)
        drawn = form % tuple(self._placed(np.concatenate(lines)).ravel().tolist())
        self._add_path(parent, drawn, title, kind)

    @staticmethod
    def _add_path(parent: Element, drawn: str, title: str, kind: str) -> None:
        """Add a path with a title and a class if they are given."""
        path = SubElement(parent, "path", ({"class": kind} if kind else {}) | {"d": drawn})
        if title:
            SubElement(path, "title").text = title

    def text(
        self, parent: Element, text: str, at: Array, height: float, angle: float = 0.0
    ) -> None:
        """Add a text by the middle of its base line, with capital letters of a height."""
        x, y = map(self._number, self._placed(at).tolist())
        look = {"x": x, "y": y, "font-size": self._number(height / _CAPITAL)}
        look |= {"font-family": "sans-serif", "text-anchor": "middle"}
        if angle:
            look["transform"] = f"rotate({self._number(-np.degrees(angle))} {x} {y})"
        SubElement(parent, "text", look).text = text

    def content(self) -> bytes:
        """Return the contents of the file."""
        for layer in self.root.findall("g"):
            if not len(layer):
                self.root.remove(layer)
        return bytes(tostring(self.root, "utf-8", xml_declaration=True))

    def _number(self, value: float) -> str:
        return f"{value:.{self._digits}g}"

    def _placed(self, points: Array) -> Array:
        return np.asarray((points - self._corner) * (1.0, -1.0))


def identifier(name: str) -> str:
    """Make an identifier of XML, which begins with a letter.

    >>> identifier("cut"), identifier("14")
    ('cut', 'layer-14')
    """
    return name if name[:1].isalpha() else f"layer-{name}"
