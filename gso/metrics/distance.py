"""Distances between two surfaces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.mesh.polyline import Polylines
from gso.metrics.farthest import farthest
from gso.metrics.surfaces import SurfaceLike, mesh_of, used_points
from gso.typing import Array

#: Share of the points that are asked for first: one in so many.
_FIRST = 64


class Distances(NamedTuple):
    """Distances between two surfaces in both directions, in the unit of their coordinates."""

    there_mean: float
    there_max: float
    back_mean: float
    back_max: float


def d_H(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return the published proximity, percent of the input's bounding-box diagonal.

    Mean over *output* vertices of the distance to the nearest *input* vertex. It is one-sided
    and includes tangential sliding; see :func:`surface_distance` for the true distance.
    """
    from scipy.spatial import cKDTree

    source = used_points(before)
    distance, _ = cKDTree(source).query(used_points(after))
    return float(100.0 * distance.mean() / geometry.box_diagonal(source))


def point_to_surface(points: Array, mesh: Mesh) -> Array:
    """Return the distance (n,) of points (n, 3) to the triangulated surface, in its unit."""
    return Nearest(mesh).distances(points)


def surface_distance(before: SurfaceLike, after: SurfaceLike) -> Distances:
    """Measure true point-to-surface distances: output to input ("there"), and back."""
    a, b = mesh_of(before), mesh_of(after)
    there = point_to_surface(used_points(b), a)
    back = point_to_surface(used_points(a), b)
    return Distances(float(there.mean()), float(there.max()), float(back.mean()), float(back.max()))


def largest_distance(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return the largest distance of :func:`surface_distance`, in either direction.

    It is found sooner where both surfaces are the same grid, or have the same faces.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> largest_distance(grid, grid + [0.0, 0.0, 0.5])
    0.5
    """
    a, b = mesh_of(before), mesh_of(after)
    here, there, one, two = a.grid, b.grid, a.grid_index, b.grid_index
    grids = one is not None and two is not None and np.array_equal(one, two)
    if grids and here is not None and there is not None:
        return farthest(there, here, farthest(here, there))
    if not np.array_equal(a.faces, b.faces):
        found = surface_distance(a, b)
        return max(found.there_max, found.back_max)
    bound = np.linalg.norm(a.vertices - b.vertices, axis=1)
    order = np.flatnonzero(a.used)[np.argsort(-bound[a.used])]
    known = 0.0
    for points, surface in ((b, a), (a, b)):
        tree = Nearest(surface)
        for ids in np.split(order, [len(order) // _FIRST]):
            ids = ids[bound[ids] > known]
            known = max(known, float(tree.distances(points.vertices[ids]).max(initial=0.0)))
    return known


def boundary_distance(before: SurfaceLike, after: SurfaceLike) -> tuple[float, float]:
    """Measure the largest distances between boundary curves, in the surfaces' unit.

    A slit in the output, which no distance between the surfaces shows, is seen here.

    Returns
    -------
    there, back : float
        From the boundary vertices of the output to the boundary of the input, and back;
        infinite where only the other surface has a boundary.

    Examples
    --------
    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> boundary_distance(grid, grid + [0.0, 0.0, 0.1])
    (0.1, 0.1)
    """
    points, lines = [], []
    for mesh in (mesh_of(before), mesh_of(after)):
        loops = [mesh.vertices[loop] for loop in mesh.boundary_loops]
        points.append(np.concatenate([np.empty((0, 3)), *loops]))
        lines.append(
            Polylines.join([Polylines.of(x, closed=True) for x in loops]) if loops else None
        )

    def far(k: int) -> float:
        line = lines[1 - k]
        if not len(points[k]):
            return 0.0
        if line is None:
            return float("inf")
        return float(np.linalg.norm(line.nearest(points[k]).points - points[k], axis=1).max())

    return far(1), far(0)


def displacement(before: SurfaceLike, after: SurfaceLike) -> tuple[float, float]:
    """Return the root mean square and largest vertex displacement, percent of the diagonal.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> displacement(grid, grid + [0.0, 0.0, 0.1 * np.sqrt(0.08)])
    (1.0, 1.0)
    """
    source = used_points(before)
    moved = np.linalg.norm(used_points(after) - source, axis=1)
    percent = 100.0 / geometry.box_diagonal(source)
    return float(percent * np.sqrt((moved**2).mean())), float(percent * moved.max())
