"""Tabs along seams, for paper and cardboard: they are folded and glued behind the other part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gso.typing import Array
from gso.workshop.part import Part

#: Length of a tab in widths, and the largest turn along it, in radians.
_LENGTH, _TURN = 6.0, 0.35
#: Area of a tab that may lie on the part or on another tab, relative to its own.
_ON = 1e-3


def with_tabs(part: Part, lines: Sequence[Array], width: float) -> Part:
    """Add trapezoidal tabs along lines of the outline, the part to the left of each.

    A tab that would lie on the part or on another tab is made narrower, and left out if a quarter
    of the width does not fit.

    Parameters
    ----------
    part : Part
    lines : sequence of ndarray (k, 2)
    width : float
        Width of the tabs, in millimetres.
    """
    import shapely

    whole = shapely.Polygon(part.outline, part.holes)
    creases = []
    for line in lines:
        for piece in _divided(line, width):
            for share in (1.0, 0.5, 0.25):
                tab = shapely.make_valid(shapely.Polygon(_tab(piece, share * width)))
                if shapely.intersection(whole, tab).area <= _ON * tab.area:
                    joined = shapely.union_all([whole, tab], grid_size=1e-9)
                    if joined.geom_type == "Polygon":
                        whole = joined
                        creases.append(piece)
                        break
    whole = shapely.orient_polygons(whole)
    outline, *holes = (np.asarray(r.coords)[:-1] for r in (whole.exterior, *whole.interiors))
    creases = [*part.creases, *creases]
    return replace(part, outline=outline, holes=tuple(holes), creases=tuple(creases))


def _divided(line: Array, width: float) -> list[Array]:
    """Divide a line into pieces of limited length and turn."""
    way = np.diff(line, axis=0)
    keep = np.linalg.norm(way, axis=1) > 0
    line = np.concatenate([line[:1], line[1:][keep]])
    way = way[keep]
    if not len(way):
        return []
    angle = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    along = np.cumsum(np.linalg.norm(way, axis=1))
    turned = np.cumsum(np.abs(np.diff(angle, prepend=angle[0])))
    number = np.maximum(along / (_LENGTH * width), turned / _TURN).astype(np.int64)
    ends = np.flatnonzero(np.diff(number)) + 1
    stops = [0, *ends.tolist(), len(line) - 1]
    return [line[a : b + 1] for a, b in pairwise(stops) if b > a]


def _tab(piece: Array, width: float) -> Array:
    """Return the polygon of a tab to the right of a line."""
    way = piece[-1] - piece[0]
    size = float(np.linalg.norm(way))
    along = way / max(size, 1e-300)
    out = np.array([along[1], -along[0]])
    slant = min(width, 0.4 * size)
    far = [piece[-1] + width * out - slant * along, piece[0] + width * out + slant * along]
    return np.concatenate([piece, far])
