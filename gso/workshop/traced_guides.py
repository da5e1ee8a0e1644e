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
#: Shortest guide line, over the smaller side of the part, if it ends inside.
_SHORT = 0.2
#: Largest angle of a guide line; parts that are curved alike in all directions have others.
_CURVED = np.radians(45.0)


def guide_lines(panel: Panel) -> tuple[GuideLine, ...]:
    """Trace the rulings of a curved panel without bend lines.

    A developable surface has straight rulings. The angles of the guide lines tell how far a
    nearly developable panel is from that. Lines that are off straight by more than 45 degrees are
    left out, and so are those that end inside the panel, if there are others: there it is curved
    alike in all directions.

    Parameters
    ----------
    panel : Panel
        In the unit of its pattern.

    Returns
    -------
    tuple of GuideLine
        None for panels with bends and for flat ones, and for those without straight lines.

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
    guides = [_guide(line) for line in traced.on(panel.flat)]
    least = _SHORT * float(rectangle(panel.flat)[1][1])
    good = [guide.angle <= _CURVED for guide in guides]
    whole = [k for k in np.flatnonzero(traced.complete) if good[k]]
    long = [k for k, g in enumerate(guides) if good[k] and arc_lengths(g.line)[-1] >= least]
    return tuple(guides[k] for k in whole or long)


def is_curved(panel: Panel) -> bool:
    """Tell whether a panel has triangles that are not flat, up to the limit of traced rulings."""
    return not bool(rulings.shape_operator(panel.surface).flat.all())


def _guide(line: Array) -> GuideLine:
    from shapely import LineString, get_coordinates

    length, chord = float(arc_lengths(line)[-1]), line[-1] - line[0]
    across = np.array([-chord[1], chord[0]]) / max(float(np.hypot(*chord)), 1e-300)
    height = float(np.abs((line - line[0]) @ across).max())
    simple = get_coordinates(LineString(line).simplify(_SIMPLER * length))
    # An arc with the chord c and the angle t at its ends has the height c tan(t / 2) / 2.
    return GuideLine(simple, float(2.0 * np.arctan2(2.0 * height, np.hypot(*chord))))
