"""Principal strains and stretches of flat images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.metrics.surfaces import SurfaceLike, components, faces_of, image_of, in_range, points_of
from gso.typing import Array

#: Triangles per block: their numbers stay in the processor's cache.
_BLOCK = 16384


class Strains(NamedTuple):
    """Larger principal strain |s - 1| pooled over corner triangles."""

    mean: float
    p99: float
    values: Array


def parallelogram_strain(surface: SurfaceLike, flat: SurfaceLike) -> Array:
    """Return the larger principal strain max |s - 1| of every face's midpoint parallelogram (m,).

    For triangles it is that of the triangle; zero where a face has no area.
    """
    large, small = stretches(surface, flat)
    return np.nan_to_num(np.maximum(np.abs(large - 1.0), np.abs(small - 1.0)))


def principal_strains(surface: SurfaceLike, flat: SurfaceLike) -> Strains:
    """Return the larger principal strain max |s - 1| of every corner triangle, pooled.

    There are four corner triangles per quad and one per triangle; those without area are
    left out.
    """
    values = corner_strains(surface, flat)
    values = values[~np.isnan(values)]
    if not values.size:
        values = np.full(1, np.nan)
    return Strains(float(values.mean()), float(np.percentile(values, 99)), values)


def strains(surface: SurfaceLike, flat: SurfaceLike) -> dict[str, float]:
    """Return maximum, 99th percentile and mean of :func:`principal_strains`, by metric name.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> strains(grid, grid[..., :2] * 1.5)["strain_max"]
    0.5
    """
    found = principal_strains(surface, flat)
    largest = float(found.values.max())
    return {"strain_max": largest, "strain_p99": found.p99, "strain_mean": found.mean}


def corner_strains(surface: SurfaceLike, flat: SurfaceLike) -> Array:
    """Return the larger principal strain max |s - 1| (4 q + t,) of every corner triangle.

    In the order of :func:`gso.mesh.topology.corner_triangles`; NaN for triangles without area.
    """
    p, q = in_range(points_of(surface), image_of(surface, flat))
    rows = np.ascontiguousarray(p.T), np.ascontiguousarray(q.T)
    triangles = topology.corner_triangles(faces_of(surface)).T
    area, values = np.empty(triangles.shape[1]), np.empty(triangles.shape[1])
    for start in range(0, len(area), _BLOCK):
        at = slice(start, start + _BLOCK)
        here, there = ([tuple(x.take(k, axis=1)) for k in triangles[:, at]] for x in rows)
        sides = geometry.sub(here[1], here[0]), geometry.sub(here[2], here[0])
        area[at] = np.sqrt(geometry.norm2(geometry.cross(*sides)))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            if q.shape[1] == 2:
                s1, s2 = geometry.singular_values(
                    there[0], there[1], there[2], geometry.rest_frame(*here)
                )
            else:
                s1, s2 = geometry.principal_stretches(
                    geometry.first_form(*here), geometry.first_form(*there)
                )
            values[at] = np.maximum(np.abs(s1 - 1.0), np.abs(s2 - 1.0))
    values[~(area > 1e-12 * area.max(initial=0.0))] = np.nan
    return values


def face_strains(surface: SurfaceLike, flat: SurfaceLike) -> Array:
    """Return the largest of :func:`corner_strains` of every face (m,); NaN without any area."""
    quad = topology.are_quads(faces_of(surface))
    values = corner_strains(surface, flat)
    corners, triangles = np.split(values, [4 * np.count_nonzero(quad)])
    out = np.empty(len(quad))
    out[quad] = np.fmax.reduce(corners.reshape(4, -1), axis=0)
    out[~quad] = triangles
    return out


def stretches(surface: SurfaceLike, flat: SurfaceLike) -> tuple[Array, Array]:
    """Return the largest and the smallest principal stretch of every face, (m,) each.

    They are ratios of lengths, image over surface, for the edge-midpoint parallelograms of
    quads, and for triangles. Their product is the ratio of areas, their quotient the
    quasi-conformal ratio. NaN where a face has no area.
    """
    faces, (p, q) = faces_of(surface), in_range(points_of(surface), image_of(surface, flat))
    out = np.full((2, len(faces)), np.nan)
    quad = topology.are_quads(faces)
    for which, some in zip((quad, ~quad), topology.by_size(faces), strict=True):
        rest, image = (geometry.first_form(*(components(x[k]) for k in some.T)) for x in (p, q))
        with np.errstate(divide="ignore", invalid="ignore"):
            good = rest[0] * rest[2] - rest[1] ** 2 > 1e-12 * rest[0] * rest[2]
            out[:, which] = np.where(good, geometry.principal_stretches(rest, image), np.nan)
    return out[0], out[1]


def quasi_conformal(surface: SurfaceLike, flat: SurfaceLike) -> Array:
    """Return the largest over the smallest stretch of every face (m,); 1 is best.

    Second-order accurate on quads, first-order on triangles; NaN where a face has no area.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> quasi_conformal(grid, grid[..., :2] * [1.0, 2.0]).round(12)
    array([2., 2., 2., 2.])
    """
    large, small = stretches(surface, flat)
    return large / np.maximum(small, 1e-300)
