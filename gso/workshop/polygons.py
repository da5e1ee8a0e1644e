"""Operations on the polygons of parts, which never end in an error of the geometry library."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.polygon import anticlockwise
from gso.geometry.steady import steady
from gso.typing import Array

if TYPE_CHECKING:
    from shapely import Geometry

#: Grids, in millimetres, on which polygons are united that touch but for rounding errors.
_JOINTS = (1e-9, 1e-7, 1e-5)
#: Distance of successive points that are one, in millimetres.
_REPEATED = 1e-6
#: Largest width of a hole that is a rounding error of a union, in millimetres, and the largest
#: share of the area by which a union may miss what it unites.
_SLIVER, _LOST = 1e-3, 1e-6
#: Share of the area that a neck must hold, and steps by which its width is found.
_PART, _HALVINGS = 0.01, 12


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


def common(one: Geometry, two: Geometry) -> Geometry:
    """Return the intersection of two shapes."""
    import shapely

    return steady(shapely.intersection, one, two)


def without(one: Geometry, two: Geometry) -> Geometry:
    """Return what of a shape is not in another one."""
    import shapely

    return steady(shapely.difference, one, two)


def united(one: Geometry, two: Geometry) -> Geometry | None:
    """Return the union of two shapes if it is one polygon and has the area of both, else None.

    Gaps that are rounding errors are closed.
    """
    import shapely

    area = one.area + two.area - common(one, two).area
    for grid in _JOINTS:
        whole = steady(partial(shapely.union, grid_size=grid), one, two)
        if whole.geom_type == "Polygon":
            break
    if whole.geom_type != "Polygon" or abs(whole.area - area) > _LOST * area:
        return None
    holes = [ring for ring in whole.interiors if shapely.Polygon(ring).area > _SLIVER * ring.length]
    return shapely.remove_repeated_points(shapely.Polygon(whole.exterior, holes), _REPEATED)


def largest(shape: Geometry) -> Geometry | None:
    """Return the largest polygon of a shape; None if it has no area."""
    import shapely

    parts = shapely.get_parts(shape)
    parts = parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 0)]
    return None if not len(parts) else parts[int(np.argmax(shapely.area(parts)))]


def rings(polygon: Geometry) -> tuple[Array, tuple[Array, ...]]:
    """Return the outline of a polygon, anticlockwise, and its holes, clockwise."""
    outline, *holes = (
        anticlockwise(np.asarray(ring.coords)[:-1])
        for ring in (polygon.exterior, *polygon.interiors)
    )
    return outline, tuple(hole[::-1] for hole in holes)


def roomiest(shape: Geometry) -> tuple[Array, float]:
    """Return the middle (2,) and the radius of the largest circle in a shape.

    Without an area it is the middle of its points, and 0.
    """
    import shapely

    polygon = largest(shape)
    if polygon is None:
        points = shapely.get_coordinates(shape)
        return (points.mean(axis=0) if len(points) else np.zeros(2)), 0.0
    try:
        middle, rim = np.asarray(shapely.maximum_inscribed_circle(polygon).coords)
    except (shapely.GEOSException, ValueError):
        point = polygon.representative_point()
        return np.array([point.x, point.y]), float(polygon.exterior.distance(point))
    return middle, float(np.linalg.norm(rim - middle))


def is_clear(outline: Array, low: Array, high: Array) -> bool:
    """Tell whether a rectangle between two corners lies outside a polygon (k, 2).

    >>> square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    >>> [is_clear(square, np.array([x, 0.0]), np.array([x + 1, 1.0])) for x in (1.0, 3.5, 5.0)]
    [False, False, True]
    """
    import shapely

    return bool(region(outline).disjoint(shapely.box(*low, *high)))


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
        left = moved(shape, -0.5 * width, 2.0)
        core = largest(left)
        return core is None or left.area - core.area > _PART * shape.area

    if not falls_apart(least):
        return least
    low, high = 0.0, least
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if falls_apart(middle) else (middle, high)
    return high
