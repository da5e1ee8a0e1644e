"""Selection of lines that cover a surface evenly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.typing import Array, Ints

#: Largest number of k-medoids iterations.
_ROUNDS = 10


def spread(points: Array, count: int) -> Ints:
    """Select up to `count` points (n, 3) far from each other; return their indices.

    The first is the one farthest from the centroid; each further one is the farthest from those
    before it (Gonzalez 1985).

    >>> spread(np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0], [9, 0, 0]]), 3)
    array([3, 0, 2])
    """
    if not len(points):
        return np.empty(0, np.int64)
    at = int(((points - points.mean(axis=0)) ** 2).sum(axis=1).argmax())
    nearest = np.full(len(points), np.inf)
    found = []
    for _ in range(min(count, len(points))):
        found.append(at)
        np.minimum(nearest, ((points - points[at]) ** 2).sum(axis=1), out=nearest)
        at = int(nearest.argmax())
    return np.array(found)


def region_areas(mesh: Mesh, points: Array, triangles: Ints) -> Array:
    """Compute the area of the triangles (indices) whose centroids are nearest to each point."""
    from scipy.spatial import cKDTree

    if not len(points):
        return np.empty(0)
    chosen = mesh.triangles[triangles]
    p, area = mesh.vertices[chosen], geometry.doubled_areas(mesh.vertices, chosen) / 2
    owner = cKDTree(points).query(p.mean(axis=1))[1]
    return np.asarray(np.bincount(owner, area, len(points)), float)


def chosen(points: Array, lines: Sequence[Array], count: int, weights: Array) -> Ints:
    """Select up to `count` lines that are near all points; return ascending indices.

    k-medoids (Kaufman and Rousseeuw 1990) reduces the weighted sum of squared distances of the
    points to the nearest line. Lines are first added greedily. Then each is repeatedly replaced
    by the best of the lines through the points nearest to it.

    Parameters
    ----------
    points : ndarray, (s, 3)
        Points to cover.
    lines : sequence of ndarray, (k_i, 3)
        A finely sampled polyline through each point.
    count : int
        Number of lines to select.
    weights : ndarray, (s,)
        Weights of the points.
    """
    from scipy.spatial import cKDTree

    if len(lines) <= count:
        return np.arange(len(lines))
    cost = np.stack([cKDTree(line).query(points)[0] for line in lines], axis=1) ** 2
    cost *= weights[:, None]
    kept: list[int] = []
    nearest = np.full(len(lines), np.inf)
    while len(kept) < count:
        kept.append(int(np.minimum(cost, nearest[:, None]).sum(axis=0).argmin()))
        nearest = np.minimum(nearest, cost[:, kept[-1]])
    for _ in range(_ROUNDS):
        owner = cost[:, kept].argmin(axis=1)
        groups = [np.flatnonzero(owner == k) for k in range(count)]
        better = [
            int(g[cost[np.ix_(g, g)].sum(axis=0).argmin()]) if g.size else line
            for g, line in zip(groups, kept, strict=True)
        ]
        if better == kept:
            break
        kept = better
    return np.unique(kept)
