"""Where a part's name is written: inside it, and between its bend lines where there is room."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.flat_region import region
from gso.geometry.polygon import rectangle
from gso.typing import Array
from gso.workshop.part import Part
from gso.workshop.polygons import roomiest, without

if TYPE_CHECKING:
    from shapely import Geometry

#: Width of a letter over the height of a capital one, in wide fonts.
_LETTER = 0.85
#: Share of the wanted height down to which a name is written between bend lines; number of cells
#: between bend lines that are tried; steps down to the smallest height.
_LEAST, _CELLS, _STEPS = 0.4, 8, (1.0, 0.7, 0.4)
#: Half of the free width beside a bend line, over the height.
_BESIDE = 0.15
_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def name_place(part: Part, text: str, height: float) -> tuple[Array, float, float]:
    """Find the place of a text in a part.

    It does not cross bend lines where it fits between them with at least 0.4 of the wanted
    height, level or along them. Otherwise it is where there is most room.

    Parameters
    ----------
    part : Part
    text : str
    height : float
        Largest height of its capital letters.

    Returns
    -------
    middle : ndarray, (2,)
    height : float
        0 where there is no room.
    angle : float
        Direction of the text, in radians.

    Examples
    --------
    >>> from gso.pattern import Bend
    >>> square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
    >>> bend = Bend(np.array([[40.0, 0], [40, 60]]), 1.0, 5.0)
    >>> middle, height, angle = name_place(Part("a", square, bends=(bend,)), "side", 8.0)
    >>> bool(middle[0] < 30), height, angle
    (True, 8.0, 0.0)
    """
    shape = region(part.outline, part.holes)
    middle, room = roomiest(shape)
    found = _between(part, shape, text, height, middle) if part.bends else None
    if found is not None:
        return found
    return middle, min(height, 2.0 * room / max(_LETTER * len(text), 1.0)), 0.0


def _between(
    part: Part, shape: Geometry, text: str, height: float, near: Array
) -> tuple[Array, float, float] | None:
    """Find a place between bend lines, the nearest to a point; None if there is none."""
    import shapely

    # Together, lines that meet at the apex of a cone would take seconds.
    lines = shapely.linestrings([bend.line for bend in part.bends])
    beside = shapely.union_all(shapely.buffer(lines, _BESIDE * _LEAST * height))
    free = shapely.get_parts(without(shape, beside))
    least = (_LEAST * height) ** 2 * _LETTER * max(len(text), 1)
    free = free[(shapely.get_type_id(free) == 3) & (shapely.area(free) >= least)]
    free = free[np.argsort(shapely.distance(free, shapely.Point(near)), kind="stable")][:_CELLS]
    ways = [_readable(rectangle(np.asarray(cell.exterior.coords)[:-1])[0]) for cell in free]
    middles = shapely.get_coordinates(shapely.centroid(free))
    for share in _STEPS:
        box = share * height * np.array([_LETTER * max(len(text), 1), 1.0])
        for cell, way, middle in zip(free, ways, middles, strict=True):
            if cell.area < box.prod():
                continue
            for angle in (0.0, way):
                c, s = np.cos(angle), np.sin(angle)
                corners = middle + box * _CORNERS @ np.array([[c, s], [-s, c]])
                if cell.contains(shapely.Polygon(corners)):
                    return middle, share * height, angle
    return None


def _readable(angle: float) -> float:
    """Turn a direction so that a text is read from below or from the right."""
    angle = (angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return float(angle if angle > -0.5 * np.pi + 1e-9 else 0.5 * np.pi)
