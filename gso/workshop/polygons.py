"""Operations on the polygons of parts, which never end in an error of the geometry library."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.flat_region import largest, region
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
