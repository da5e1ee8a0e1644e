"""Ruling lines of a surface: what they are, and how they are found."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gso.io import as_mesh
from gso.mesh import Mesh
from gso.rulings.shape import FLAT, checked_flat
from gso.rulings.spread import chosen, region_areas, spread
from gso.rulings.walk import Field, walk
from gso.status import MeshError, OptionError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Lines that are tried for each one that is kept; how many are enough; but so many for each.
_TRIES, _ENOUGH, _FEWEST = 20, 600, 4

#: Points closer than this share of the surface's size are one: lines that pass a vertex touch
#: several triangles there.
_SAME = 1e-10


@dataclass(frozen=True)
class Rulings:
    """Polylines on a surface, each point given by a triangle of vertices.

    Attributes
    ----------
    mesh : Mesh
        The surface.
    corners : ndarray of int, (p, 3)
        For the points of all lines in their order: the triangle of vertices they lie in.
    weights : ndarray, (p, 3)
        Their barycentric coordinates there.
    starts : ndarray of int, (s + 1,)
        Line i has the points ``starts[i]`` to ``starts[i + 1] - 1``.
    complete : ndarray of bool, (s,)
        Both ends lie on the boundary or at a flat region. Other lines have come to a place
        where the ruling is not defined, as they do on surfaces that are not developable.
    """

    mesh: Mesh
    corners: Ints
    weights: Array
    starts: Ints
    complete: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.starts) - 1

    def on(self, values: ArrayLike) -> list[Array]:
        """Values per vertex, interpolated along each line.

        With a flat image (n, 2) of the surface these are the rulings in the pattern.

        Raises
        ------
        MeshError
            Not one row per vertex of the mesh.
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

        0 for straight lines, which the rulings of a developable surface are.
        """
        return np.array([_bow(line) for line in self.lines]) / self.lengths


def trace(
    mesh: Any, *, count: int = 24, seeds: ArrayLike | None = None, flat: float = FLAT
) -> Rulings:
    """Ruling lines across a surface, evenly spread.

    A line follows the direction in which the surface's normal turns least. It ends at the
    boundary (of holes too), at flat regions, where that direction turns by more than 60
    degrees from a triangle to the next, and when it is as long as the surface's diagonal.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        Quads, triangles or both; the lines run on its triangulation.
    count : int
        Number of lines. Fewer come back when the surface has not as many different ones.
    seeds : array_like, (s, 3), optional
        Points: one line passes near each of them, through the middle of the nearest
        triangle. `count` does not matter then, and seeds in flat regions have no line.
    flat : float
        A triangle has no ruling when its curvatures times the surface's size (distance of the
        farthest vertex from the centroid) are below it.

    Returns
    -------
    Rulings

    Raises
    ------
    MeshError
        The surface cannot be used.
    OptionError
        `count`, `seeds` or `flat` make no sense.

    Notes
    -----
    Lines are spread like this: many times as many are drawn through triangles that are far from
    each other, and those are kept to which all these triangles are near (k-medoids).

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
    """Numbers of the middles that are nearest to the points."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(middles).query(points)[1], np.int64).reshape(-1)


def _through(mesh: Mesh, unit: Mesh, field: Field, start: Ints) -> Rulings:
    """Lines through the middles of triangles, both ways, found on the mesh in the unit ball."""
    count = start.size
    steps = walk(unit, field, np.tile(start, 2), np.repeat([1.0, -1.0], count))
    half, line = np.divmod(steps.line, max(count, 1))
    time = np.arange(line.size)
    # The way back turned round, then the way there without the middle, which is in both.
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
    """Largest distance of a polyline's points from its chord."""
    off, chord = line - line[0], line[-1] - line[0]
    squared = float(chord @ chord)
    if squared > 0.0:
        off = off - (off @ chord)[:, None] * (chord / squared)
    return float(np.linalg.norm(off, axis=1).max())
