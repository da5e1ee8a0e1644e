"""Points, marks and holes carried between a surface and its patterns, both ways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.mesh.closest_point import Nearest
from gso.typing import Array, Ints
from gso.workshop.panels import Panel
from gso.workshop.part import Part, signed_area


def to_pattern(panels: Sequence[Panel], points: ArrayLike) -> tuple[Ints, Array]:
    """Carry points of the surface to the patterns.

    Parameters
    ----------
    panels : sequence of Panel
    points : array_like, (k, 3)
        Points on the surfaces or close to them.

    Returns
    -------
    panel : ndarray of int, (k,)
        The panel that each point is nearest to.
    flat : ndarray, (k, 2)
        Its place in that panel's pattern.
    """
    given = _checked(points, 3)
    best = np.full(len(given), np.inf)
    number, flat = np.zeros(len(given), np.int64), np.zeros((len(given), 2))
    for k, panel in enumerate(panels):
        triangles = panel.surface.triangles
        place, shares, foot = Nearest.of(panel.surface.vertices, triangles).locate(given)
        away = np.linalg.norm(foot - given, axis=1)
        closer = away < best
        own = np.einsum("kc,kcd->kd", shares, panel.flat[triangles[place]])
        best[closer], number[closer], flat[closer] = away[closer], k, own[closer]
    return number, flat


def to_surface(panel: Panel, points: ArrayLike) -> Array:
    """Carry points (k, 2) of a panel's pattern to its surface, (k, 3).

    Points outside the pattern are moved to its outline.
    """
    given = np.pad(_checked(points, 2), ((0, 0), (0, 1)))
    triangles = panel.surface.triangles
    flat = np.pad(panel.flat, ((0, 0), (0, 1)))
    place, shares, _ = Nearest.of(flat, triangles).locate(given)
    return np.asarray(np.einsum("kc,kcd->kd", shares, panel.surface.vertices[triangles[place]]))


def marked(
    panels: Sequence[Panel],
    lines: Sequence[ArrayLike],
    flats: Sequence[Array],
) -> list[list[Array]]:
    """Carry polylines of the surface to the patterns; they are divided where the panel changes.

    Parameters
    ----------
    panels : sequence of Panel
        With patterns in the unit of the surface.
    lines : sequence of array_like, (k, 3)
    flats : sequence of ndarray, (n, 2)
        The pattern of each panel in which the lines are wanted, such as that for thick sheets.

    Returns
    -------
    list of list of ndarray (k, 2)
        The lines of each panel.
    """
    wanted = [replace(p, flat=flat) for p, flat in zip(panels, flats, strict=True)]
    out: list[list[Array]] = [[] for _ in panels]
    for line in lines:
        number, flat = to_pattern(wanted, line)
        stops = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(number)]
        for a, b in pairwise(stops):
            if b - a > 1:
                out[int(number[a])].append(flat[a:b])
    return out


def with_holes(part: Part, holes: Sequence[Array]) -> Part:
    """Return a part with more holes: closed polygons (k, 2).

    Raises
    ------
    OptionError
        A hole is not inside the part.
    """
    import shapely

    shape = shapely.Polygon(part.outline, part.holes)
    own = []
    for hole in holes:
        closed = np.allclose(hole[0], hole[-1])
        ring = hole[:-1] if closed else hole
        if len(ring) < 3 or not shape.contains(shapely.Polygon(ring)):
            raise OptionError(
                f"a hole is not inside part {part.name}: move it away from seams and the outline"
            )
        own.append(ring if signed_area(ring) < 0 else ring[::-1])
    return replace(part, holes=(*part.holes, *own))


def _checked(points: ArrayLike, count: int) -> Array:
    out = np.asarray(points, float)
    if out.ndim != 2 or out.shape[1] != count or not np.isfinite(out).all():
        raise OptionError(
            f"points have shape {out.shape}; they must be finite numbers (k, {count})"
        )
    return out
