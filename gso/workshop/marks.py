"""Points, marks and holes of a surface, carried to its patterns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.geometry.flat_region import region
from gso.geometry.polygon import anticlockwise, densified
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.metrics import point_to_surface
from gso.typing import Array, Ints
from gso.verdict import Code, Measurement, Reason, compare
from gso.workshop.panels import Panel

#: Number of points of a mark along the diagonal of a panel, at least, before those are left out
#: from which the line is less than a share of its size away.
_STEPS, _CHORD = 4000, 1e-5
#: Largest distance of marks and holes from the design, relative to its diagonal.
_NEAR = 0.01


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


def marked(
    panels: Sequence[Panel],
    lines: Sequence[ArrayLike],
    flats: Sequence[Array],
) -> list[list[Array]]:
    """Carry polylines of the surface to the patterns; they are divided where the panel changes.

    Long segments get more points, so that a line follows the surface and ends at the seams.

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
    import shapely

    wanted = [replace(p, flat=flat) for p, flat in zip(panels, flats, strict=True)]
    most = max(panel.surface.diagonal for panel in panels) / _STEPS
    out: list[list[Array]] = [[] for _ in panels]
    for line in lines:
        number, flat = to_pattern(wanted, densified(_checked(line, 3), most))
        stops = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(number)]
        for a, b in pairwise(stops):
            if b - a > 1:
                way = shapely.LineString(flat[a:b]).simplify(_CHORD * np.ptp(flat[a:b]))
                out[int(number[a])].append(np.asarray(way.coords))
    return out


def cut(
    panels: Sequence[Panel], holes: Sequence[ArrayLike], flats: Sequence[Array]
) -> tuple[list[list[Array]], tuple[Reason, ...]]:
    """Carry holes of the surface to the patterns.

    Parameters
    ----------
    panels, flats
        As for :func:`marked`.
    holes : sequence of array_like, (k, 3)
        Closed lines: the last point is the first.

    Returns
    -------
    holes : list of list of ndarray (k, 2)
        Those of each panel, clockwise, the first point not repeated.
    reasons : tuple of Reason
        Why other holes cannot be cut.
    """
    import shapely

    wanted = [replace(p, flat=flat) for p, flat in zip(panels, flats, strict=True)]
    shapes = [region(p.flat[p.loops[0]], [p.flat[x] for x in p.loops[1:]]) for p in wanted]
    out: list[list[Array]] = [[] for _ in panels]
    bad: dict[Code, list[str]] = {
        Code.HOLE_ACROSS_SEAM: [],
        Code.HOLE_CROSSES_ITSELF: [],
        Code.HOLE_OUTSIDE: [],
    }
    for hole in holes:
        line = _checked(hole, 3)
        number, flat = to_pattern(wanted, line[:-1])
        ring, on = shapely.Polygon(flat), dict.fromkeys(panels[k].name for k in number)
        where = f"at {np.round(line[0], 6).tolist()} ({', '.join(on)})"
        if len(on) > 1:
            bad[Code.HOLE_ACROSS_SEAM].append(where)
        elif not ring.is_valid or ring.area <= 0:
            bad[Code.HOLE_CROSSES_ITSELF].append(where)
        elif not shapes[number[0]].contains_properly(ring):
            bad[Code.HOLE_OUTSIDE].append(where)
        else:
            out[number[0]].append(anticlockwise(flat)[::-1])
    return out, compare({code: Measurement.count("hole", ids) for code, ids in bad.items()}, {})


def check_lines(
    lines: Sequence[ArrayLike], meshes: Sequence[Mesh], what: str, *, closed: bool = False
) -> list[int]:
    """Return the number of the mesh that each line of points (k, 3) lies on.

    Raises
    ------
    OptionError
        A line has too few points, is not closed, or is not on a mesh.
    """
    out = []
    for k, line in enumerate(lines):
        points = np.asarray(line, float)
        least = 4 if closed else 2
        good = points.ndim == 2 and points.shape[1] == 3 and len(points) >= least
        if not good or not np.isfinite(points).all():
            raise OptionError(
                f"{what} {k} has shape {points.shape}; it must be finite points (k, 3), k at "
                f"least {least}"
            )
        away = [point_to_surface(points, mesh) for mesh in meshes]
        number = int(np.argmin([x.mean() for x in away]))
        if closed and np.linalg.norm(points[0] - points[-1]) > _NEAR * meshes[number].diagonal:
            raise OptionError(f"{what} {k} is not closed; its last point must be its first")
        if away[number].max() > _NEAR * meshes[number].diagonal:
            raise OptionError(
                f"{what} {k}: point {int(away[number].argmax())} is {away[number].max():.4g} from "
                "the surface; put it on the surface"
            )
        out.append(number)
    return out


def _checked(points: ArrayLike, count: int) -> Array:
    out = np.asarray(points, float)
    if out.ndim != 2 or out.shape[1] != count or not np.isfinite(out).all():
        raise OptionError(
            f"points have shape {out.shape}; they must be finite numbers (k, {count})"
        )
    return out
