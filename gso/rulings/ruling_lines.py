"""Ruling lines of a surface."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.rulings.face_curvature import FLAT, checked_flat
from gso.rulings.spread import chosen, region_areas, spread
from gso.rulings.walk import Field, walk
from gso.typing import Array, Flags, Ints, MeshLike

#: Candidate lines per line wanted; their largest total number; their smallest number per line.
_TRIES, _ENOUGH, _FEWEST = 20, 600, 4

#: Consecutive points closer than this share of the surface's size are merged: a line through a
#: vertex touches several triangles there.
_SAME = 1e-10


@dataclass(frozen=True)
class Rulings:
    """Polylines on a surface, whose points are given by barycentric coordinates.

    Attributes
    ----------
    mesh : Mesh
        The surface.
    corners : ndarray of int, (p, 3)
        Vertices of the triangle in which each point lies; all lines one after the other.
    weights : ndarray, (p, 3)
        Barycentric coordinates of each point in its triangle.
    starts : ndarray of int, (s + 1,)
        Line i has the points ``starts[i]`` to ``starts[i + 1] - 1``.
    complete : ndarray of bool, (s,)
        Whether both ends lie on the boundary or at a flat region. Other lines end where the
        direction turns sharply, as on surfaces that are not developable, or at the largest
        length.
    """

    mesh: Mesh
    corners: Ints
    weights: Array
    starts: Ints
    complete: Flags

    def __len__(self) -> int:
        return len(self.starts) - 1

    def on(self, values: ArrayLike) -> list[Array]:
        """Interpolate values per vertex at the points of each line.

        A flat image (n, 2) of the surface gives the rulings in the pattern.

        Raises
        ------
        MeshError
            The values do not have one row per vertex of the mesh.
        """
        table = np.asarray(values, float)
        if table.ndim == 0 or len(table) != len(self.mesh.vertices):
            raise MeshError(
                f"values is an array {table.shape}; give one row per vertex "
                f"({len(self.mesh.vertices)})"
            )
        points = np.einsum("pk,pk...->p...", self.weights, table[self.corners])
        return [points[first:last] for first, last in pairwise(self.starts)]

    @property
    def lines(self) -> list[Array]:
        """Points of each line in space, (k_i, 3)."""
        return self.on(self.mesh.vertices)

    @property
    def lengths(self) -> Array:
        """Length of each line (s,)."""
        return np.array([np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in self.lines])

    @property
    def straightness(self) -> Array:
        """Largest distance of each line from its chord over the line's length (s,).

        0 for straight lines, such as the rulings of a developable surface.
        """
        return np.array([_bow(line) for line in self.lines]) / self.lengths


def trace(
    mesh: MeshLike, *, count: int = 24, seeds: ArrayLike | None = None, flat: float = FLAT
) -> Rulings:
    """Trace evenly spread ruling lines across a surface.

    A line follows the direction in which the surface's normal turns least, both ways from its
    start. It ends at the boundary (of holes too), at flat regions, where that direction turns by
    more than 60 degrees from a triangle to the next, and when the length from the start exceeds
    the surface's diagonal.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        Quads, triangles or both; the lines run on its triangulation.
    count : int
        Number of lines; fewer are returned if the surface does not have as many distinct ones.
    seeds : array_like, (s, 3), optional
        Points: one line passes near each of them, through the centroid of the triangle whose
        centroid is nearest. `count` is ignored then, and seeds in flat regions have no line.
    flat : float
        A triangle has no ruling if its curvatures times the surface's size (distance of the
        farthest vertex from the centroid) are below this.

    Returns
    -------
    Rulings

    Raises
    ------
    MeshError
        The surface cannot be used.
    OptionError
        `count`, `seeds` or `flat` is invalid.

    Notes
    -----
    Many more lines than wanted are traced, from triangles far from each other. Those are kept
    that minimise the distances of all these triangles to the nearest line (k-medoids).

    Examples
    --------
    >>> y, s = np.mgrid[:9, :17] / 8
    >>> rulings = trace(np.stack([2 * np.sin(s / 2), y, 2 * np.cos(s / 2)], axis=-1), count=5)
    >>> len(rulings), bool((rulings.straightness < 2e-3).all())
    (5, True)
    """
    surface = as_mesh(mesh)
    limit = checked_flat(flat)
    if not (isinstance(count, (int, np.integer)) and count >= 1):
        raise OptionError(f"count={count!r}: give a whole number of lines, 1 or more")
    points = None if seeds is None else _checked_seeds(seeds)
    unit = surface.replaced(surface.frame.to_unit(surface.vertices))
    field = Field.of(unit, limit)
    middles = unit.vertices[unit.triangles].mean(axis=1)
    if points is not None:
        near = _nearest(middles, surface.frame.to_unit(points))
        return _through(surface, unit, field, near[~field.flat[near]])
    bent = np.flatnonzero(~field.flat)
    tries = max(min(_TRIES * int(count), _ENOUGH), _FEWEST * int(count))
    start = bent[spread(middles[bent], tries)]
    every = _through(surface, unit, field, start)
    areas = region_areas(unit, middles[start], bent)
    lines = every.on(unit.vertices)
    return _subset(every, chosen(middles[start], lines, int(count), areas))


def _checked_seeds(seeds: ArrayLike) -> Array:
    try:
        points = np.asarray(seeds, float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise OptionError("seeds: give finite points in an array (s, 3)")
    return points


def _nearest(middles: Array, points: Array) -> Ints:
    """Return the indices of the centroids nearest to the points."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(middles).query(points)[1], np.int64).reshape(-1)


def _through(mesh: Mesh, unit: Mesh, field: Field, start: Ints) -> Rulings:
    """Trace lines both ways from the centroids of triangles, on the mesh in the unit ball."""
    count = start.size
    steps = walk(unit, field, np.tile(start, 2), np.repeat([1.0, -1.0], count))
    half, line = np.divmod(steps.line, max(count, 1))
    time = np.arange(line.size)
    # The backward half reversed, then the forward half without the centroid, which is in both.
    order = np.lexsort((np.where(half == 1, -time, time), line))
    order = order[(half[order] == 1) | (time[order] >= 2 * count)]
    line = line[order]
    corners, weights = mesh.triangles[steps.triangle[order]], steps.weights[order]
    points = (weights[..., None] * unit.vertices[corners]).sum(axis=1)
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
    fresh = np.ones(line.size, bool)
    fresh[1:] = (line[1:] != line[:-1]) | (gap > _SAME)
    starts = np.searchsorted(line[fresh], np.arange(count + 1))
    complete = steps.arrived[:count] & steps.arrived[count:]
    return Rulings(mesh, corners[fresh], weights[fresh], starts, complete)


def _subset(rulings: Rulings, which: Ints) -> Rulings:
    first, size = rulings.starts[which], np.diff(rulings.starts)[which]
    starts = np.concatenate([[0], np.cumsum(size)])
    rows = np.arange(starts[-1]) + np.repeat(first - starts[:-1], size)
    return Rulings(
        rulings.mesh,
        rulings.corners[rows],
        rulings.weights[rows],
        starts,
        rulings.complete[which],
    )


def _bow(line: Array) -> float:
    """Compute the largest distance of a polyline's points from the line through its ends."""
    off, chord = line - line[0], line[-1] - line[0]
    squared = float(chord @ chord)
    if squared > 0.0:
        off = off - (off @ chord)[:, None] * (chord / squared)
    return float(np.linalg.norm(off, axis=1).max())
