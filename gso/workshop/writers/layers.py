"""Layers of a drawing: what each kind of line is called and how it looks, in all formats.

The kinds are those of :mod:`gso.workshop.writers.strokes`. The set ``"operations"`` has a layer
for each operation of the cutter; its colours are told apart by laser software. The set ``"astm"``
has the layer numbers of ASTM D6673-10, table 1, for pattern software.
"""

from __future__ import annotations

from typing import NamedTuple

from gso.errors import OptionError
from gso.spelling import choices


class Layer(NamedTuple):
    """A layer.

    Attributes
    ----------
    name : str
    colour : str
        As ``#rrggbb``, on white.
    aci : int
        The colour in DXF files (AutoCAD colour index).
    plotted : bool
        False for lines that are shown but not plotted.
    dash : tuple of float
        Lengths of dashes and gaps on paper, in millimetres; empty for solid lines. DXF and SVG
        files have solid lines, because a cutter cuts the gaps, too.
    """

    name: str
    colour: str
    aci: int
    plotted: bool = True
    dash: tuple[float, ...] = ()


_SHEET = Layer("SHEET", "#808080", 8, plotted=False)
_LABEL = Layer("LABEL", "#000000", 7)
_ENGRAVE = Layer("ENGRAVE", "#ff00ff", 6)
_GRAIN = Layer("GRAIN", "#00a0c0", 4)
_SEW = Layer("SEW", "#ff8000", 30, dash=(2.0, 1.0))
_UP = Layer("BEND_UP", "#0000ff", 5, dash=(4.0, 1.5))
_DOWN = Layer("BEND_DOWN", "#00a000", 3, dash=(6.0, 1.5, 0.5, 1.5))
_ROLL = Layer("ROLL", "#00a0a0", 132, dash=(1.5, 1.5))
_GUIDE = Layer("GUIDE", "#808000", 56, dash=(1.0, 2.0))
_CUT = Layer("CUT", "#ff0000", 1)

SETS: dict[str, dict[str, Layer]] = {
    "operations": {
        "sheet": _SHEET,
        "text": _LABEL,
        "mark": _ENGRAVE,
        "crease": _ENGRAVE,
        "notch": _ENGRAVE,
        "grain": _GRAIN,
        "arrow": _GRAIN,
        "guide": _GUIDE,
        "roll": _ROLL,
        "valley": _UP,
        "mountain": _DOWN,
        "seam": _SEW,
        "hole": _CUT,
        "outline": _CUT,
    },
    "astm": {
        "sheet": _SHEET,
        "text": _LABEL._replace(name="15"),
        "mark": _ENGRAVE._replace(name="8"),
        "crease": _ENGRAVE._replace(name="8"),
        "guide": _ENGRAVE._replace(name="8"),
        "roll": _ENGRAVE._replace(name="8"),
        "valley": _ENGRAVE._replace(name="8"),
        "mountain": _ENGRAVE._replace(name="8"),
        "notch": _UP._replace(name="4"),
        "grain": _GRAIN._replace(name="7"),
        "seam": _SEW._replace(name="14"),
        "hole": _CUT._replace(name="11"),
        "outline": _CUT._replace(name="1"),
    },
}
"""Layers by kind, for each set. What is cut comes last: some cutters keep the file's order, and a
part that is cut out may move. A kind without a layer is not drawn."""


def layer_set(name: str) -> dict[str, Layer]:
    """Return the layers of a set by kind.

    Parameters
    ----------
    name : {"operations", "astm"}

    Raises
    ------
    OptionError
        There is no set of this name.

    Examples
    --------
    >>> layer_set("operations")["mountain"].name, layer_set("astm")["hole"].name
    ('BEND_DOWN', '11')
    >>> layer_set("asmt")
    Traceback (most recent call last):
    gso.errors.OptionError: no layers 'asmt'; did you mean 'astm'? There are operations, astm
    """
    if not isinstance(name, str) or name not in SETS:
        raise OptionError(f"no layers {name!r}; {choices(name, SETS)}")
    return SETS[name]
