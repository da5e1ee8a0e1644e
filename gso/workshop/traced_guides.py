"""Guide lines of curved parts without bend lines: their rulings, traced on the surface."""

from __future__ import annotations

import numpy as np

from gso import rulings
from gso.geometry.polygon import arc_lengths, rectangle
from gso.typing import Array
from gso.workshop.panels import Panel
from gso.workshop.part import GuideLine

#: Number of guide lines of a part.
_COUNT = 7
#: Distance from a traced line up to which it is drawn with fewer points, over its length.
_SIMPLER = 0.005
#: Shortest guide line, over the longest side of the part.
_SHORT = 0.02


def guide_lines(panel: Panel) -> tuple[GuideLine, ...]:
    """Trace the rulings of a curved panel without bend lines.

    A developable surface has straight rulings. The angles of the guide lines tell how far a
    nearly developable panel is from that. Lines that end inside the panel, where it is bent alike
    in all directions, are left out if there are others.

    Parameters
    ----------
    panel : Panel
        In the unit of its pattern.

    Returns
    -------
    tuple of GuideLine
        None for panels with bends, and for flat ones.

    Examples
    --------
    >>> from gso import as_mesh
    >>> y, turn = np.mgrid[:9, :17] / 16
    >>> surface = as_mesh(np.stack([np.sin(turn), y, np.cos(turn)], axis=-1))
    >>> flat = np.stack([turn, y], axis=-1).reshape(-1, 2)
    >>> found = guide_lines(Panel("a", surface, flat))
    >>> len(found), max(guide.angle for guide in found) < 1e-3
    (7, True)
    """
    if len(panel.bends):
        return ()
    traced = rulings.trace(panel.surface, count=_COUNT)
    lines = traced.on(panel.flat)
    least = _SHORT * float(rectangle(panel.flat)[1][0])
    long = np.array([arc_lengths(line)[-1] >= least for line in lines], bool)
    kept = long & traced.complete
    return tuple(_guide(lines[k]) for k in np.flatnonzero(kept if kept.any() else long))


def _guide(line: Array) -> GuideLine:
    from shapely import LineString, get_coordinates

    length, chord = float(arc_lengths(line)[-1]), line[-1] - line[0]
    across = np.array([-chord[1], chord[0]]) / max(float(np.hypot(*chord)), 1e-300)
    height = float(np.abs((line - line[0]) @ across).max())
    simple = get_coordinates(LineString(line).simplify(_SIMPLER * length))
    # The sagitta of an arc with a chord c and the angle t at its ends is c tan(t / 2) / 2.
    return GuideLine(simple, float(2.0 * np.arctan2(2.0 * height, np.hypot(*chord))))
