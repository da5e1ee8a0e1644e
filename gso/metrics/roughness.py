"""Fairness, planarity, and lengths of edges and loops."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.geometry.polygon import perimeter
from gso.mesh import topology
from gso.metrics.surfaces import (
    SurfaceLike,
    cells_of,
    components,
    grid_of,
    mesh_of,
    points_of,
    unit,
)
from gso.typing import Array


def nonplanarity(surface: SurfaceLike) -> Array:
    """Return the distance between the diagonals of every quad over the mean edge length, (q,).

    Zero for planar quads. In a mixed mesh, triangles are skipped.

    >>> nonplanarity(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])).max()
    np.float64(0.0)
    """
    mesh = mesh_of(surface)
    v = mesh.vertices
    length = float(mesh.edge_lengths.mean())
    corners = (components(v[c]) for c in cells_of(mesh).T)
    with np.errstate(invalid="ignore", divide="ignore"):
        gap: Array = np.abs(np.asarray(geometry.diagonal_distance(*corners)))
    return np.nan_to_num(gap) / length


def fairness(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return the sum of squared second differences along the polylines (Jiang et al. 2020).

    Divided by `scale` squared, the unit ball's radius when not given. A mesh with triangles
    has no polylines: there the sum runs over the interior edges of its triangulation, with
    twice the vector between the midpoints of the edge and of its two opposite vertices.
    """
    scale = unit(surface) if scale is None else scale
    p = grid_of(surface)
    if p is not None:
        rows = geometry.second_difference(
            components(p[:-2]), components(p[1:-1]), components(p[2:])
        )
        cols = geometry.second_difference(
            components(p[:, :-2]), components(p[:, 1:-1]), components(p[:, 2:])
        )
        return float(sum((c**2).sum() for c in (*rows, *cols)) / scale**2)
    mesh = mesh_of(surface)
    v = mesh.vertices
    if not mesh.has_triangles:
        t = topology.polyline_triples(mesh.half_edges, mesh.faces)
        d = geometry.second_difference(*(components(v[t[:, k]]) for k in range(3)))
        return float(sum((c**2).sum() for c in d) / scale**2)
    a, b, left, right = topology.hinges(mesh.triangle_edges).T
    return float(((v[a] + v[b] - v[left] - v[right]) ** 2).sum() / scale**2)


def fairness_ratio(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return :func:`fairness` of a result over that of its input; 1 for a flat input.

    >>> bowl = np.dstack([u := np.mgrid[:3.0, :3.0][0], u.T, u**2 + u.T**2])
    >>> fairness_ratio(bowl, bowl * [1.0, 1.0, 0.5])
    0.25
    """
    was = fairness(before, scale=1.0)
    return fairness(after, scale=1.0) / was if was > 0 else 1.0


def edge_ratios(before: SurfaceLike, after: SurfaceLike) -> Array:
    """Return the length ratio result / input of every edge (e,); NaN where the input's is zero.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> edge_ratios(grid, 2.0 * grid).min()
    np.float64(2.0)
    """
    here, there = mesh_of(before), points_of(after)
    a, b = here.edges.T
    was, now = (np.linalg.norm(p[a] - p[b], axis=1) for p in (here.vertices, there))
    return np.asarray(np.divide(now, was, out=np.full(len(was), np.nan), where=was > 0))


def loop_ratios(before: SurfaceLike, after: SurfaceLike) -> Array:
    """Return the length ratio result / input of every boundary loop, longest loop first.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> loop_ratios(grid, 0.5 * grid)
    array([0.5])
    """
    here, there = mesh_of(before), points_of(after)
    loops = here.boundary_loops
    was, now = (np.array([perimeter(p[loop]) for loop in loops]) for p in (here.vertices, there))
    return np.asarray(now / was)
