"""Holes of a surface, and the surface without them: they are filled as a thin plate bends."""

from __future__ import annotations

import numpy as np

from gso import geometry, metrics
from gso.deformation import ThinPlateField
from gso.geometry.plane import loop_axes
from gso.geometry.polygon import perimeter
from gso.mesh import Mesh
from gso.metrics.hole_defects import turning
from gso.typing import Array, Ints

#: Turning of a boundary loop, in radians, below which it is a hole. On a flat surface it is -2 pi
#: around a hole, and 0 at the end of a tube.
_AROUND = -1.5 * np.pi
#: Largest area of what fills holes, relative to the surface.
_LARGE = 0.4
#: Distance of new vertices from each other and from the outline, in mean edges of the outline.
_STEP, _AWAY = 1.0, 0.7
#: Largest number of new vertices in a hole.
_MOST = 2000
#: Times that the thin plate is solved, each on the triangles of the one before.
_SOLVES = 3


def holes(mesh: Mesh) -> list[Ints]:
    """Return the boundary loops that are holes, each anticlockwise round what fills it.

    A hole is a loop around which the surface lies on all sides, such as a window. The ends of
    tubes are none, and neither are the loops of a surface whose loops are all like holes, such as
    the mouth of a vase.

    Examples
    --------
    >>> frame = np.ones((9, 9), bool)
    >>> frame[3:6, 3:6] = False
    >>> plane = Mesh.from_grid(np.dstack([*np.mgrid[:10.0, :10.0], np.zeros((10, 10))]))
    >>> wall = Mesh(plane.vertices, plane.faces[frame.ravel()])
    >>> [len(loop) for loop in wall.boundary_loops], [len(loop) for loop in holes(wall)]
    ([36, 12], [12])
    """
    loops = mesh.boundary_loops
    found = [loop[::-1] for loop, turn in zip(loops, turning(mesh), strict=True) if turn < _AROUND]
    return found if len(found) < len(loops) else []


def filled(mesh: Mesh) -> Mesh | None:
    """Return a surface with its holes filled; None if it has none, or one that cannot be filled.

    The vertices of the surface come first. New ones are where a thin plate (Duchon 1977) would be
    that goes on from the surface.

    Examples
    --------
    >>> u, v = np.mgrid[-0.5:0.5:21j, -0.5:0.5:21j]
    >>> ball = Mesh.from_grid(np.dstack([u, v, np.sqrt(1 - u**2 - v**2)]))
    >>> middle = np.linalg.norm(ball.vertices[ball.faces].mean(axis=1)[:, :2], axis=1)
    >>> whole = filled(Mesh(ball.vertices, ball.faces[middle > 0.2]))
    >>> away = np.linalg.norm(whole.vertices, axis=1) - 1.0
    >>> len(whole.boundary_loops), bool(np.abs(away).max() < 1e-3)
    (1, True)
    """
    loops = holes(mesh)
    if not loops:
        return None
    points, faces, area = [mesh.vertices], [mesh.triangles], 0.0
    for loop in loops:
        found = _patch(mesh.vertices[loop], loop, sum(map(len, points)))
        if found is None:
            return None
        points.append(found[0])
        faces.append(found[1])
        area += found[2]
    if area > _LARGE * metrics.area(mesh):
        return None
    whole = Mesh(np.concatenate(points), np.concatenate(faces))
    given = np.arange(len(mesh.vertices))
    for _ in range(_SOLVES):
        whole = whole.replaced(ThinPlateField(whole, given)(mesh.vertices))
    if mesh.is_triangles:
        return whole
    more = whole.faces[len(mesh.triangles) :]
    width = mesh.faces.shape[1] - more.shape[1]
    every = np.concatenate([mesh.faces, np.pad(more, ((0, 0), (0, width)), constant_values=-1)])
    return Mesh(whole.vertices, every)


def _patch(corners: Array, loop: Ints, first: int) -> tuple[Array, Ints, float] | None:
    """Fill a hole with triangles; return the new vertices, the triangles, and their area.

    Parameters
    ----------
    corners : ndarray, (k, 3)
        The loop.
    loop : ndarray of int, (k,)
        Their numbers.
    first : int
        Number of the first new vertex.

    Returns
    -------
    tuple or None
        None where the hole has no simple outline in its plane, or none that triangles have.
    """
    import shapely
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay, QhullError

    axes, middle = loop_axes(corners), corners.mean(axis=0)
    local = (corners - middle) @ axes.T
    flat = local[:, :2]
    outline = shapely.Polygon(flat)
    if len(loop) < 3 or not outline.is_valid:
        return None
    step = max(_STEP * perimeter(flat) / len(flat), float(np.sqrt(outline.area / _MOST)))
    inside = _lattice(flat, step)
    room = shapely.buffer(outline, -_AWAY * step)
    inside = inside[shapely.contains_xy(room, inside)]
    try:
        triangles = Delaunay(np.concatenate([flat, inside])).simplices
        heights = LinearNDInterpolator(flat, local[:, 2])(inside)
    except QhullError:
        return None
    every = np.concatenate([flat, inside])
    triangles = triangles[shapely.contains_xy(outline, every[triangles].mean(axis=1))]
    clockwise = geometry.signed_areas(every, triangles) < 0
    triangles[clockwise] = triangles[clockwise, ::-1]
    if not _is_filled(triangles, len(loop)):
        return None
    new = middle + inside @ axes[:2] + np.outer(np.nan_to_num(heights), axes[2])
    number = np.concatenate([loop, first + np.arange(len(inside))])
    return new, number[triangles], float(outline.area)


def _lattice(outline: Array, step: float) -> Array:
    """Return a lattice (n, 2) of equilateral triangles around an outline."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    y = np.arange(low[1], high[1], np.sqrt(0.75) * step)
    x = np.arange(low[0] - step, high[0] + step, step)
    shift = 0.5 * step * (np.arange(len(y)) % 2)
    x, y = np.broadcast_arrays(x + shift[:, None], y[:, None])
    return np.stack([x, y], axis=2).reshape(-1, 2)


def _is_filled(triangles: Ints, count: int) -> bool:
    """Tell whether the outline of triangles (t, 3) is 0, 1, 2 ... and back to 0."""
    if not len(triangles):
        return False
    sides = np.stack([triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()], axis=1)
    most = int(triangles.max()) + 1
    key, twin = sides[:, 0] * most + sides[:, 1], sides[:, 1] * most + sides[:, 0]
    rim = np.sort(key[~np.isin(key, twin)])
    k = np.arange(count)
    return np.array_equal(rim, np.sort(k * most + (k + 1) % count))
