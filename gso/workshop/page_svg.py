"""SVG elements of the page: paths with few digits, and texts whose look is in the page's style."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element, tostring

import numpy as np

from gso.io.svg_page import SVGPage
from gso.typing import Array

#: Least number of steps of the coordinates along the larger side.
_STEPS = 2000
#: Points of the shortest lines that are simplified.
_SHORT = 4


class PageSVG(SVGPage):
    """An element ``svg`` of a class, without a size of its own.

    Coordinates of paths are rounded to a power of ten, a half to a twentieth per mille of the
    larger side, and are written relative to the point before.

    Parameters
    ----------
    low, high : ndarray, (2,)
        Opposite corners of what is seen, y up.
    kind : str
        Class of the element.

    Examples
    --------
    >>> svg = PageSVG(np.zeros(2), np.array([400.0, 300.0]), "drawing")
    >>> svg.path(svg.root, [np.array([[1.0, 300.0], [3.04, 299.0], [3.0, 250.5]])], kind="rim")
    >>> svg.text_of()
    '<svg viewBox="0 0 400 300" class="drawing"><path class="rim" d="M1 0l2 1 0 48.5" /></svg>'
    """

    def __init__(self, low: Array, high: Array, kind: str):
        side = max(float(np.max(high - low)), 1e-9)
        self._decimals = max(int(np.ceil(np.log10(_STEPS / side))), 0)
        super().__init__(low, high, digits=6)
        for name in ("xmlns", "width", "height"):
            del self.root.attrib[name]
        self.root.set("class", kind)

    def path(
        self,
        parent: Element,
        lines: Sequence[Array] | Array,
        *,
        closed: bool = False,
        title: str = "",
        kind: str = "",
    ) -> None:
        """Add one path of polylines (k, 2), with a title and a class if they are given.

        Points that are half a step from the line between others, or less, are left out.
        """
        import shapely

        kept = [
            line
            if len(line) < _SHORT
            else shapely.get_coordinates(shapely.simplify(shapely.LineString(line), self._half))
            for line in lines
        ]
        drawn = "".join(self._drawn(line, "Z" if closed else "") for line in kept)
        if drawn:
            self._add_path(parent, drawn, title, kind)

    def text(
        self, parent: Element, text: str, at: Array, height: float, angle: float = 0.0
    ) -> None:
        """Add a text by the middle of its base line, with capital letters of a height."""
        super().text(parent, text, at, height, angle)
        for name in ("font-family", "text-anchor"):
            del parent[-1].attrib[name]

    def text_of(self) -> str:
        """Return the element as text."""
        return tostring(self.root, "unicode")

    @property
    def _half(self) -> float:
        return 0.5 * 10.0**-self._decimals

    def _number(self, value: float) -> str:
        return f"{round(value, self._decimals + 1):.6g}"

    def _drawn(self, line: Array, end: str) -> str:
        steps = np.round(self._placed(line) * 10.0**self._decimals).astype(np.int64)
        steps[1:] -= steps[:-1].copy()
        moved = (steps != 0).any(axis=1)
        moved[0] = True
        first, *rest = steps[moved].tolist()
        onward = f"l{self._list(x for step in rest for x in step)}" if rest else ""
        return f"M{self._list(first)}{onward}{end}"

    def _list(self, values: Iterable[int]) -> str:
        """Write numbers of steps one after another; a minus sign parts them, too."""
        words = " ".join(map(self._short, values))
        return words.replace(" -", "-")

    def _short(self, value: int) -> str:
        text = f"{value / 10**self._decimals:.{self._decimals}f}"
        if self._decimals:
            text = text.rstrip("0").rstrip(".")
        return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text
