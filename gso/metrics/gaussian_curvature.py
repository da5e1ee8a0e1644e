"""Gaussian curvature."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.metrics.surfaces import SurfaceLike, components, grid_of, mesh_of, unit
from gso.typing import Array


def curvature_grid(points: Array) -> Array:
    """Return the discrete Gaussian curvature (H-2, W-2) at interior grid vertices, 1/length^2."""
    return geometry.grid_curvature(components(np.asarray(points, float)))


def curvature(surface: SurfaceLike, split: int = 0) -> Array:
    """Return the discrete Gaussian curvature of every vertex (n,); NaN on the boundary, 1/length^2.

    Interior vertices may have any valence. Those of a grid come in the order of the mesh.

    Parameters
    ----------
    surface : Mesh or array (H, W, 3)
    split : {0, 1}
        Triangulation of the quads: the mesh's own one, or that along the other diagonals. On a
        mesh of triangles both are the same.
    """
    mesh = mesh_of(surface)
    out = np.full(len(mesh.vertices), np.nan)
    stars = mesh.stars_by_triangulation
    for centre, ring in stars[min(split, len(stars) - 1)]:
        (own,) = geometry.corners(mesh.vertices, centre[:, None])
        out[centre] = geometry.gaussian_curvature(own, geometry.corners(mesh.vertices, ring))
    return out


def worst_curvature(surface: SurfaceLike) -> Array:
    """Return the Gaussian curvature of every vertex, from the triangulation with larger |K|, (n,).

    NaN on the boundary, 1/length^2, with Meyer's area: 1 on a unit sphere.

    >>> u, v = np.mgrid[-0.2:0.2:9j, -0.2:0.2:9j]
    >>> ball = np.dstack([u, v, np.sqrt(1.0 - u**2 - v**2)])
    >>> bool(abs(np.nanmean(worst_curvature(ball)) - 1.0) < 0.02)
    True
    """
    own, other = curvature(surface), curvature(surface, 1)
    return 3.0 * np.where(np.abs(other) > np.abs(own), other, own)


def _interior_curvature(surface: SurfaceLike, split: int = 0) -> Array:
    grid = grid_of(surface)
    if grid is None:
        values = curvature(surface, split)
    else:
        values = geometry.grid_curvature(components(grid), split).ravel()
    values = values[~np.isnan(values)]
    return values if values.size else np.zeros(1)


#: Mean |K| of meshes by triangulation: several metrics need it.
_known: WeakKeyDictionary[Mesh, dict[int, float]] = WeakKeyDictionary()


def _mean_abs(surface: SurfaceLike, split: int) -> float:
    known = _known.setdefault(surface, {}) if isinstance(surface, Mesh) else {}
    if split not in known:
        known[split] = float(np.abs(_interior_curvature(surface, split)).mean())
    return known[split]


def loss_gc(surface: SurfaceLike, *, scale: float | None = None, split: int = 0) -> float:
    """Return the mean absolute Gaussian curvature K_A of interior vertices (Wang et al. 2024).

    This is Eq. 1 of the paper, multiplied by `scale` squared. Without `scale` it is that of
    the surface in the unit ball.

    Only one triangulation of the quads is used, so curvature along the other diagonals is not
    seen: see :func:`loss_gc_worst`.

    Parameters
    ----------
    surface : Mesh or array (H, W, 3)
    scale : float, optional
        Length that counts as one.
    split : {0, 1}
        Triangulation of the quads; 0 is the published figure.

    Examples
    --------
    >>> flat = np.zeros((4, 4, 3)); flat[..., :2] = np.mgrid[:4, :4].transpose(1, 2, 0)
    >>> round(loss_gc(flat), 12)
    0.0
    """
    scale = unit(surface) if scale is None else scale
    return _mean_abs(surface, split) * scale**2


def loss_gc_worst(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return :func:`loss_gc` in the triangulation of the quads where it is larger.

    On meshes of triangles it equals ``loss_gc``.

    >>> crumpled = np.dstack([*np.mgrid[:6.0, :6.0], np.indices((6, 6)).sum(axis=0) % 2])
    >>> loss_gc_worst(crumpled) >= loss_gc(crumpled)
    True
    """
    scale = unit(surface) if scale is None else scale
    return max(_mean_abs(surface, split) for split in (0, 1)) * scale**2


def loss_gc_image(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return :func:`loss_gc` by the normals of the quads, a third discretisation.

    The curvature of a vertex is the area that the normals of the faces around it sweep on the unit
    sphere (:func:`gso.geometry.image_curvature`). Quads that are bent along one of their diagonals
    lower the curvature of both triangulations, but not this one. On meshes of triangles it equals
    ``loss_gc``.

    Its ratio to :func:`loss_gc_worst` says whether quads hide curvature, where the larger one is
    above 1e-3 in the unit ball. Below, all of them count as none: a cap of radius 1 with that
    curvature (``mean_abs_K`` is three times that) is flattened with a strain of K / 8, or 0.04 %.

    >>> u, v = np.mgrid[-1:1:33j, -1:1:33j]
    >>> saddle = np.dstack([u, v, 0.3 * u * v])
    >>> 0.98 < loss_gc_image(saddle) / loss_gc_worst(saddle) < 1.02
    True
    """
    mesh = mesh_of(surface)
    scale = unit(surface) if scale is None else scale
    if mesh.is_triangles:
        return _mean_abs(surface, 0) * scale**2
    values = [np.zeros(0)]
    for centre, ring in mesh.face_stars:
        (own,) = geometry.corners(mesh.vertices, centre[:, None])
        values.append(geometry.image_curvature(own, geometry.corners(mesh.vertices, ring)))
    every = np.abs(np.concatenate(values))
    return float(every.mean()) * scale**2 if len(every) else 0.0


def loss_gc_mean(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return the mean of :func:`loss_gc` over both triangulations of the quads, as in the energy.

    It does not depend on the numbering of the mesh.

    >>> saddle = np.dstack([*np.mgrid[:4.0, :4.0], np.outer(np.arange(4.0), np.arange(4.0))])
    >>> loss_gc_mean(saddle) <= loss_gc_worst(saddle)
    True
    """
    scale = unit(surface) if scale is None else scale
    return 0.5 * sum(_mean_abs(surface, split) for split in (0, 1)) * scale**2


def loss_gc_half(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return :func:`loss_gc` at half the resolution, an independent check that no energy minimises.

    It is the mean over the four sub-grids of every second vertex, and over both triangulations
    of each. NaN for meshes that are not grids, and for grids smaller than 6 x 6.

    >>> u, v = np.mgrid[-1:1:16j, -1:1:16j]
    >>> saddle = np.dstack([u, v, 0.3 * u * v])
    >>> 0.9 < loss_gc_half(saddle) / loss_gc(saddle) < 1.1
    True
    """
    grid = grid_of(surface)
    if grid is None or min(grid.shape[:2]) < 6:
        return float("nan")
    scale = unit(surface) if scale is None else scale
    some = [grid[i::2, j::2] for i in (0, 1) for j in (0, 1)]
    return float(np.mean([_mean_abs(g, split) for g in some for split in (0, 1)]) * scale**2)


def mean_abs_K(surface: SurfaceLike, *, scale: float | None = None) -> float:
    """Return the mean absolute Gaussian curvature with the area of Meyer et al. 2003.

    It is 1 on a unit sphere, and taken from the triangulation of the quads where it is larger:
    three times :func:`loss_gc_worst`, which divides by the areas of whole stars.
    """
    return 3.0 * loss_gc_worst(surface, scale=scale)


def curvature_features(
    surface: SurfaceLike, *, scale: float | None = None
) -> tuple[float, float, float]:
    """Return (K_P, K_N, K_A): means of the positive, negative and absolute curvature (Eq. 1)."""
    scale = unit(surface) if scale is None else scale
    k = _interior_curvature(surface) * scale**2
    return float(np.maximum(k, 0).mean()), float(np.minimum(k, 0).mean()), float(np.abs(k).mean())


def K_A_r(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return the share of mean |K| removed, 1 - K_A(after) / K_A(before); 0 for a flat input."""
    return _removed(loss_gc(before, scale=1.0), loss_gc(after, scale=1.0))


def K_A_r_worst(before: SurfaceLike, after: SurfaceLike) -> float:
    """Return the share of :func:`loss_gc_worst` removed; 0 for a flat input."""
    return _removed(loss_gc_worst(before, scale=1.0), loss_gc_worst(after, scale=1.0))


def _removed(was: float, left: float) -> float:
    return (was - left) / was if was > 0 else 0.0
