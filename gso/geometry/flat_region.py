"""Regions of the plane, bounded by outlines and holes, and how narrow they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.steady import steady
from gso.typing import Array

if TYPE_CHECKING:
    from shapely import Geometry

#: Share of the area that a neck must hold, and steps by which its width is found.
_PART, _HALVINGS = 0.01, 12
#: Largest length of a mitre where outlines are moved to find necks, over the distance.
_MITRE = 2.0


def region(outline: Array, holes: Sequence[Array] = ()) -> Geometry:
    """Return what an outline (k, 2) encloses but holes, as a valid polygon or several.

    Of an outline that crosses itself it is all that lies within.
    """
    import shapely

    shape = shapely.Polygon(outline, holes)
    if shape.is_valid:
        return shape

    def mended(some: Geometry) -> Geometry:
        return shapely.make_valid(some, method="structure", keep_collapsed=False)

    return steady(mended, shape)


def moved(shape: Geometry, by: float, mitre: float) -> Geometry:
    """Return a shape whose outline is moved outwards by a distance; corners are mitred."""
    import shapely

    def wider(some: Geometry) -> Geometry:
        return shapely.buffer(some, by, join_style="mitre", mitre_limit=mitre)

    return steady(wider, shape)


def largest(shape: Geometry) -> Geometry | None:
    """Return the largest polygon of a shape; None if it has no area."""
    import shapely

    parts = shapely.get_parts(shape)
    parts = parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 0)]
    return None if not len(parts) else parts[int(np.argmax(shapely.area(parts)))]


def neck(shape: Geometry, least: float) -> float:
    """Return the width of a shape at its narrowest neck if it is less than `least`, else `least`.

    At a neck a shape falls apart, or vanishes, when its outline moves inwards by half of the width.
    Corners, and what is smaller than 1 % of the area, do not count.

    Examples
    --------
    >>> halves = [[0, 0], [4, 0], [4, 4], [2.1, 4], [2.1, 4.5], [4, 4.5], [4, 9], [0, 9],
    ...           [0, 4.5], [1.9, 4.5], [1.9, 4], [0, 4]]
    >>> [round(neck(region(np.array(halves)), least), 2) for least in (1.0, 0.1)]
    [0.2, 0.1]
    """

    def falls_apart(width: float) -> bool:
        left = moved(shape, -0.5 * width, _MITRE)
        core = largest(left)
        return core is None or left.area - core.area > _PART * shape.area

    if not falls_apart(least):
        return least
    low, high = 0.0, least
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if falls_apart(middle) else (middle, high)
    return high
