"""Distances between two surfaces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.mesh.polyline import Polylines
from gso.metrics.farthest_point import farthest
from gso.metrics.surfaces import SurfaceLike, mesh_of, used_points
from gso.typing import Array


class Distances(NamedTuple):
    """Distances between two surfaces in both directions, in the unit of their coordinates."""

    there_mean: float
    there_max: float
    back_mean: float
    back_max: float

    @property
    def mean(self) -> float:
        """The larger one of both means."""
        return max(self.there_mean, self.back_mean)

    @property
    def largest(self) -> float:
        """The largest distance, both ways: the deviation."""
        return max(self.there_max, self.back_max)


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
    """Measure true distances between surfaces: output to input ("there"), and back.

    The means are those of the vertices. The largest are of all points, see :func:`farthest`.
    """
    a, b = mesh_of(before), mesh_of(after)
    return Distances(*_from_vertices(b, a), *_from_vertices(a, b))


def _from_vertices(surface: Mesh, other: Mesh) -> tuple[float, float]:
    """Return the mean distance of the vertices from another surface, and that of all points."""
    used = surface.used
    foot, distance = np.zeros(len(used), np.int64), np.zeros(len(used))
    foot[used], _, place = Nearest(other).locate(surface.vertices[used])
    distance[used] = np.linalg.norm(place - surface.vertices[used], axis=1)
    return float(distance[used].mean()), farthest(surface, other, 0.0, (foot, distance))


def largest_distance(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return the largest distance of :func:`surface_distance`, in either direction.

    It is found sooner than by that function where both surfaces have the same triangles.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> largest_distance(grid, grid + [0.0, 0.0, 0.5])
    0.5
    """
    a, b = mesh_of(before), mesh_of(after)
    return farthest(a, b, farthest(b, a))


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
