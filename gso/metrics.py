"""Published metrics, exactly as their figures were computed, and corrected ones.

Surfaces are given as a :class:`gso.Mesh` or a grid array (H, W, 3), flat images as (H, W, 2)
or (n, 2). Functions that compare lengths also accept another surface, a :class:`gso.Mesh`,
as the image. Quantities that depend on the unit of length (``loss_gc``, ``loss_iso_cell``,
``fairness``) are measured on the surface normalised to the unit ball; pass `scale`, the
length that counts as one, to normalise differently: ``scale=1`` takes the coordinates as
they are. :data:`INFO` lists the meaning, unit and direction of every metric.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gso import geometry
from gso.errors import MeshError
from gso.mesh import topology
from gso.typing import Array

if TYPE_CHECKING:
    from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest


class Info(NamedTuple):
    """Description of a metric: unit, whether lower is better (None: neither), a line of text.

    `joined` says how the values of several components are combined: "mean" (weighted by
    area), "max", "min" or "sum".
    """

    unit: str
    lower_is_better: bool | None
    text: str
    joined: str = "mean"


INFO: dict[str, Info] = {
    "loss_gc": Info("1/size^2", True, "mean |K| over interior vertices (published)"),
    "loss_gc_before": Info("1/size^2", True, "loss_gc of the input"),
    "loss_gc_worst": Info("1/size^2", True, "loss_gc in the worse of both triangulations of quads"),
    "loss_gc_worst_before": Info("1/size^2", True, "loss_gc_worst of the input"),
    "loss_gc_half": Info("1/size^2", True, "loss_gc of every second vertex, both triangulations"),
    "mean_abs_K": Info("1/size^2", True, "mean |K|, Meyer's area, worse triangulation"),
    "mean_abs_K_before": Info("1/size^2", True, "mean_abs_K of the input"),
    "K_A_r": Info("", False, "share of loss_gc removed (published)"),
    "K_A_r_worst": Info("", False, "share of loss_gc_worst removed"),
    "nonplanarity_mean": Info("", True, "mean gap of the quads' diagonals / mean edge"),
    "nonplanarity_max": Info("", True, "largest gap of a quad's diagonals / mean edge", "max"),
    "nonplanarity_max_before": Info("", True, "nonplanarity_max of the input", "max"),
    "d_H": Info("%", True, "mean distance to the nearest input vertex / diagonal (published)"),
    "distance_mean": Info("%", True, "mean true distance to the surface, both ways / diagonal"),
    "distance_max": Info("%", True, "largest true distance, both ways / diagonal", "max"),
    "deviation_max": Info("%", True, "largest true distance of a result vertex / diagonal", "max"),
    "displacement_rms": Info("%", True, "root mean square vertex displacement / diagonal"),
    "displacement_max": Info("%", True, "largest vertex displacement / diagonal", "max"),
    "loop_ratio_min": Info("", None, "smallest length of a boundary loop, out / in", "min"),
    "loop_ratio_max": Info("", None, "largest length of a boundary loop, out / in", "max"),
    "edge_ratio_min": Info("", False, "smallest length of an edge, out / in", "min"),
    "fold_max": Info("deg", True, "largest angle between the normals of neighbouring faces", "max"),
    "fold_max_before": Info("deg", True, "fold_max of the input", "max"),
    "fairness_ratio": Info("", True, "sum of squared second differences, out / in"),
    "loss_iso_cell": Info("size", True, "isometry defect of the cells (published)"),
    "isometry_energy": Info("", True, "mean E_iso of the faces, relative (Jiang et al. 2020)"),
    "parallelogram_strain": Info("", True, "mean strain of the faces' midpoint parallelograms"),
    "edge_length_error": Info("", True, "mean |l'/l - 1| over edges"),
    "strain_mean": Info("", True, "mean of the larger principal strain"),
    "strain_p99": Info("", True, "99th percentile of the larger principal strain"),
    "strain_max": Info("", True, "largest principal strain", "max"),
    "area_error": Info("", True, "mean |A'/A - 1| over corner triangles"),
    "flipped_cells": Info("", True, "inverted cells (of grids: with an inverted corner)", "sum"),
    "angle_distortion_mean": Info("", True, "mean over faces of s1/s2 - 1, principal stretches"),
    "angle_distortion_p99": Info("", True, "99th percentile of s1/s2 - 1"),
    "scale_min": Info("", False, "smallest ratio of lengths, flat over surface", "min"),
    "scale_max": Info("", True, "largest ratio of lengths, flat over surface", "max"),
    "theta": Info("deg", True, "mean angle of the cell normals to the clean surface's (published)"),
    "normal_change": Info("deg", None, "mean angle of the cell normals to the input's; no error"),
    "roughness_ratio": Info("", True, "sum of squared second differences, out / in"),
}


class Strains(NamedTuple):
    """Larger principal strain |s - 1| pooled over corner triangles."""

    mean: float
    p99: float
    values: Array


class Distances(NamedTuple):
    """Distances between two surfaces in both directions, in the unit of their coordinates."""

    there_mean: float
    there_max: float
    back_mean: float
    back_max: float


def components(points: Array) -> tuple[Array, ...]:
    """Split an array (..., d) into a tuple of its d components."""
    return tuple(points[..., k] for k in range(points.shape[-1]))


def _points(surface: Any) -> Array:
    """Return the vertices of a mesh or grid as (n, 3)."""
    points = surface.vertices if hasattr(surface, "vertices") else np.asarray(surface, float)
    return points.reshape(-1, points.shape[-1])


def _used_points(surface: Any) -> Array:
    """Return the vertices that belong to a face, (n, 3)."""
    return surface.vertices[surface.used] if hasattr(surface, "used") else _points(surface)


def _grid(surface: Any) -> Array | None:
    """Return the grid array of a mesh or grid, or None."""
    if hasattr(surface, "grid"):
        return surface.grid
    points = np.asarray(surface, float)
    if points.ndim != 3:
        raise MeshError(f"expected a Mesh or a grid array (H, W, 3), not an array {points.shape}")
    return points


def _mesh(surface: Any) -> Mesh:
    from gso.mesh import Mesh

    return surface if isinstance(surface, Mesh) else Mesh.from_grid(surface)


def unit(surface: Any) -> float:
    """Return the largest distance of a vertex from the centroid: the default unit of length."""
    if hasattr(surface, "frame"):
        return surface.frame.scale
    return geometry.ball(_points(surface))[1]


def curvature_grid(points: Array) -> Array:
    """Return the discrete Gaussian curvature (H-2, W-2) at interior grid vertices, 1/length^2."""
    return geometry.grid_curvature(components(np.asarray(points, float)))


def curvature(surface: Any, split: int = 0) -> Array:
    """Return the discrete Gaussian curvature of every vertex (n,); NaN on the boundary, 1/length^2.

    Interior vertices may have any valence. Those of a grid come in the order of the mesh.

    Parameters
    ----------
    surface : Mesh or array (H, W, 3)
    split : {0, 1}
        Triangulation of the quads: the mesh's own one, or that along the other diagonals. On a
        mesh of triangles both are the same.
    """
    mesh = _mesh(surface)
    out = np.full(len(mesh.vertices), np.nan)
    for centre, ring in mesh.splits[min(split, len(mesh.splits) - 1)]:
        out[centre] = geometry.gaussian_curvature(
            components(mesh.vertices[centre]),
            [components(mesh.vertices[ring[:, k]]) for k in range(ring.shape[1])],
        )
    return out


def worst_curvature(surface: Any) -> Array:
    """Return the Gaussian curvature of every vertex, from the triangulation with larger |K|, (n,).

    NaN on the boundary, 1/length^2, with Meyer's area: 1 on a unit sphere.

    >>> u, v = np.mgrid[-0.2:0.2:9j, -0.2:0.2:9j]
    >>> ball = np.dstack([u, v, np.sqrt(1.0 - u**2 - v**2)])
    >>> bool(abs(np.nanmean(worst_curvature(ball)) - 1.0) < 0.02)
    True
    """
    own, other = curvature(surface), curvature(surface, 1)
    return 3.0 * np.where(np.abs(other) > np.abs(own), other, own)


def _interior_curvature(surface: Any, split: int = 0) -> Array:
    grid = _grid(surface)
    if grid is None:
        values = curvature(surface, split)
    else:
        values = geometry.grid_curvature(components(grid), split).ravel()
    values = values[~np.isnan(values)]
    return values if values.size else np.zeros(1)


def _mean_abs(surface: Any, split: int) -> float:
    return float(np.abs(_interior_curvature(surface, split)).mean())


def loss_gc(surface: Any, *, scale: float | None = None, split: int = 0) -> float:
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


def loss_gc_worst(surface: Any, *, scale: float | None = None) -> float:
    """Return :func:`loss_gc` in the triangulation of the quads where it is larger.

    On meshes of triangles it equals ``loss_gc``.

    >>> crumpled = np.dstack([*np.mgrid[:6.0, :6.0], np.indices((6, 6)).sum(axis=0) % 2])
    >>> loss_gc_worst(crumpled) >= loss_gc(crumpled)
    True
    """
    scale = unit(surface) if scale is None else scale
    return max(_mean_abs(surface, split) for split in (0, 1)) * scale**2


def loss_gc_both(surface: Any, *, scale: float | None = None) -> float:
    """Return the mean of :func:`loss_gc` over both triangulations of the quads, as in the energy.

    It does not depend on the numbering of the mesh.

    >>> saddle = np.dstack([*np.mgrid[:4.0, :4.0], np.outer(np.arange(4.0), np.arange(4.0))])
    >>> loss_gc_both(saddle) <= loss_gc_worst(saddle)
    True
    """
    scale = unit(surface) if scale is None else scale
    return 0.5 * sum(_mean_abs(surface, split) for split in (0, 1)) * scale**2


def loss_gc_half(surface: Any, *, scale: float | None = None) -> float:
    """Return :func:`loss_gc` at half the resolution, an independent check that no energy minimises.

    It is the mean over the four sub-grids of every second vertex, and over both triangulations
    of each. NaN for meshes that are not grids, and for grids smaller than 6 x 6.

    >>> u, v = np.mgrid[-1:1:16j, -1:1:16j]
    >>> saddle = np.dstack([u, v, 0.3 * u * v])
    >>> 0.9 < loss_gc_half(saddle) / loss_gc(saddle) < 1.1
    True
    """
    grid = _grid(surface)
    if grid is None or min(grid.shape[:2]) < 6:
        return float("nan")
    scale = unit(surface) if scale is None else scale
    some = [grid[i::2, j::2] for i in (0, 1) for j in (0, 1)]
    return float(np.mean([_mean_abs(g, split) for g in some for split in (0, 1)]) * scale**2)


def mean_abs_K(surface: Any, *, scale: float | None = None) -> float:
    """Return the mean absolute Gaussian curvature with the area of Meyer et al. 2003.

    It is 1 on a unit sphere, and taken from the triangulation of the quads where it is larger:
    three times :func:`loss_gc_worst`, which divides by the areas of whole stars.
    """
    return 3.0 * loss_gc_worst(surface, scale=scale)


def nonplanarity(surface: Any) -> Array:
    """Return the distance between the diagonals of every quad over the mean edge length, (q,).

    Zero for planar quads. In a mixed mesh, triangles are skipped.

    >>> nonplanarity(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])).max()
    np.float64(0.0)
    """
    mesh = _mesh(surface)
    v = mesh.vertices
    a, b = mesh.edges.T
    length = np.linalg.norm(v[a] - v[b], axis=1).mean()
    corners = (components(v[c]) for c in _cells(mesh).T)
    with np.errstate(invalid="ignore", divide="ignore"):
        gap = np.abs(np.asarray(geometry.diagonal_distance(*corners)))
    return np.nan_to_num(gap) / length


def curvature_features(surface: Any, *, scale: float | None = None) -> tuple[float, float, float]:
    """Return (K_P, K_N, K_A): means of the positive, negative and absolute curvature (Eq. 1)."""
    scale = unit(surface) if scale is None else scale
    k = _interior_curvature(surface) * scale**2
    return float(np.maximum(k, 0).mean()), float(np.minimum(k, 0).mean()), float(np.abs(k).mean())


def K_A_r(before: Any, after: Any) -> float:
    """Return the share of mean |K| removed, 1 - K_A(after) / K_A(before); 0 for a flat input."""
    return _removed(loss_gc(before, scale=1.0), loss_gc(after, scale=1.0))


def K_A_r_worst(before: Any, after: Any) -> float:
    """Return the share of :func:`loss_gc_worst` removed; 0 for a flat input."""
    return _removed(loss_gc_worst(before, scale=1.0), loss_gc_worst(after, scale=1.0))


def _removed(was: float, left: float) -> float:
    return (was - left) / was if was > 0 else 0.0


def d_H(before: Any, after: Any) -> float:
    """Return the published proximity, percent of the input's bounding-box diagonal.

    Mean over *output* vertices of the distance to the nearest *input* vertex. It is one-sided
    and includes tangential sliding; see :func:`surface_distance` for the true distance.
    """
    from scipy.spatial import cKDTree

    source = _used_points(before)
    distance, _ = cKDTree(source).query(_used_points(after))
    return float(100.0 * distance.mean() / geometry.box_diagonal(source))


def point_to_surface(points: Array, mesh: Mesh) -> Array:
    """Return the distance (n,) of points (n, 3) to the triangulated surface, in its unit."""
    return Nearest(mesh).distances(points)


def surface_distance(before: Any, after: Any) -> Distances:
    """Measure true point-to-surface distances: output to input ("there"), and back."""
    a, b = _mesh(before), _mesh(after)
    there = point_to_surface(_used_points(b), a)
    back = point_to_surface(_used_points(a), b)
    return Distances(float(there.mean()), float(there.max()), float(back.mean()), float(back.max()))


def displacement(before: Any, after: Any) -> tuple[float, float]:
    """Return the root mean square and largest vertex displacement, percent of the diagonal.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> displacement(grid, grid + [0.0, 0.0, 0.1 * np.sqrt(0.08)])
    (1.0, 1.0)
    """
    source = _used_points(before)
    moved = np.linalg.norm(_used_points(after) - source, axis=1)
    percent = 100.0 / geometry.box_diagonal(source)
    return float(percent * np.sqrt((moved**2).mean())), float(percent * moved.max())


def fairness(surface: Any, *, scale: float | None = None) -> float:
    """Return the sum of squared second differences along the polylines (Jiang et al. 2020).

    Divided by `scale` squared, the unit ball's radius when not given. A mesh with triangles
    has no polylines: there the sum runs over the interior edges of its triangulation, with
    twice the vector between the midpoints of the edge and of its two opposite vertices.
    """
    scale = unit(surface) if scale is None else scale
    p = _grid(surface)
    if p is not None:
        rows = geometry.second_difference(
            components(p[:-2]), components(p[1:-1]), components(p[2:])
        )
        cols = geometry.second_difference(
            components(p[:, :-2]), components(p[:, 1:-1]), components(p[:, 2:])
        )
        return float(sum((c**2).sum() for c in (*rows, *cols)) / scale**2)
    mesh = _mesh(surface)
    v = mesh.vertices
    if not mesh.has_triangles:
        t = topology.polyline_triples(mesh.half_edges, mesh.faces)
        d = geometry.second_difference(*(components(v[t[:, k]]) for k in range(3)))
        return float(sum((c**2).sum() for c in d) / scale**2)
    a, b, left, right = topology.hinges(mesh.triangle_edges).T
    return float(((v[a] + v[b] - v[left] - v[right]) ** 2).sum() / scale**2)


def fairness_ratio(before: Any, after: Any) -> float:
    """Return :func:`fairness` of a result over that of its input; 1 for a flat input.

    >>> bowl = np.dstack([u := np.mgrid[:3.0, :3.0][0], u.T, u**2 + u.T**2])
    >>> fairness_ratio(bowl, bowl * [1.0, 1.0, 0.5])
    0.25
    """
    was = fairness(before, scale=1.0)
    return fairness(after, scale=1.0) / was if was > 0 else 1.0


def edge_ratios(before: Any, after: Any) -> Array:
    """Return the length ratio result / input of every edge (e,); NaN where the input's is zero.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> edge_ratios(grid, 2.0 * grid).min()
    np.float64(2.0)
    """
    here, there = _mesh(before), _points(after)
    a, b = here.edges.T
    was, now = (np.linalg.norm(p[a] - p[b], axis=1) for p in (here.vertices, there))
    return np.divide(now, was, out=np.full(len(was), np.nan), where=was > 0)


def loop_ratios(before: Any, after: Any) -> Array:
    """Return the length ratio result / input of every boundary loop, longest loop first.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> loop_ratios(grid, 0.5 * grid)
    array([0.5])
    """
    here, there = _mesh(before), _points(after)
    loops = here.boundary_loops
    was, now = (np.array([_around(p[loop]) for loop in loops]) for p in (here.vertices, there))
    return now / was


def _around(points: Array) -> float:
    """Return the length of a closed polygon (n, 3)."""
    return float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())


def folds(surface: Any) -> Array:
    """Return the angle between the normals of the two faces at every interior edge, degrees, (e,).

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> folds(grid).max()
    np.float64(0.0)
    """
    mesh = _mesh(surface)
    he, normal = mesh.half_edges, face_normals(mesh)
    inner = np.flatnonzero(he.twin > np.arange(he.twin.size))
    a, b = (components(normal[he.face[h]]) for h in (inner, he.twin[inner]))
    return np.degrees(geometry.angle(a, b))


def _flat(surface: Any, flat: Any) -> Array:
    """Return an image as (n, 2), or another surface as (n, 3), in the order of the vertices."""
    if hasattr(flat, "vertices"):
        out = flat.vertices
    else:
        image = np.asarray(flat, float)
        out = image.reshape(-1, image.shape[-1])[:, :2]
    count = len(_points(surface))
    if len(out) != count:
        raise MeshError(f"the image has {len(out)} vertices and the surface {count}")
    index = getattr(surface, "grid_index", None)
    if hasattr(flat, "vertices") or image.ndim != 3 or index is None:
        return out
    ordered = np.empty_like(out)
    ordered[index.ravel()] = out
    return ordered


def _cells(surface: Any) -> NDArray[np.int64]:
    """Return the quad faces of a mesh or grid."""
    if not hasattr(surface, "faces"):
        return topology.grid_faces(*np.asarray(surface).shape[:2])
    return topology.by_size(surface.faces)[0]


def _faces(surface: Any) -> NDArray[np.int64]:
    return surface.faces if hasattr(surface, "faces") else _cells(surface)


def isometry_defect(surface: Any, flat: Any, *, scale: float | None = None) -> Array:
    """Return the defect ``||a|-|a'|| + ||b|-|b'|| + |a.b - a'.b'|`` of every quad cell (c,)."""
    scale = unit(surface) if scale is None else scale
    cells = _cells(surface)
    p = _points(surface) / scale
    q = _flat(surface, flat) / scale
    a, b = geometry.diagonals(*(components(p[cells[:, k]]) for k in range(4)))
    a2, b2 = geometry.diagonals(*(components(q[cells[:, k]]) for k in range(4)))
    return np.abs(np.stack(geometry.isometry_defect(a, b, a2, b2))).sum(axis=0)


def loss_iso_cell(surface: Any, flat: Any, *, scale: float | None = None) -> float:
    """Return the mean isometry defect of the quad cells, in the unit ball (published, Table 2).

    It does not detect folding, nor a shift of the two checkerboard sub-lattices against each
    other: read it together with strain and inverted cells. NaN on a mesh without quads.
    """
    defect = isometry_defect(surface, flat, scale=scale)
    return float(defect.mean()) if defect.size else float("nan")


def isometry_energy(surface: Any, flat: Any) -> float:
    """Return the mean over the faces of E_iso (Jiang et al. 2020), dimensionless.

    E_iso sums the squared differences of the squared diagonals and of their inner product (for
    triangles: of the squared sides). The mean is divided by the squared mean of the surface's
    squared lengths. Its square root is about twice the strain.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> isometry_energy(grid, grid[..., :2])
    0.0
    """
    p, q = _points(surface), _flat(surface, flat)
    differences, squares = [], []
    for some in topology.by_size(_faces(surface)):
        here, there = (
            np.stack(
                np.broadcast_arrays(*geometry.face_products(*(components(x[k]) for k in some.T)))
            )
            for x in (p, q)
        )
        differences.append(((here - there) ** 2).sum(axis=0))
        squares.append(here[: 2 if some.shape[1] == 4 else 3].ravel())
    return float(np.concatenate(differences).mean() / np.concatenate(squares).mean() ** 2)


def parallelogram_strain(surface: Any, flat: Any) -> Array:
    """Return the larger principal strain max |s - 1| of every face's midpoint parallelogram (m,).

    For triangles it is that of the triangle; zero where a face has no area.
    """
    large, small = stretches(surface, flat)
    return np.nan_to_num(np.maximum(np.abs(large - 1.0), np.abs(small - 1.0)))


def edge_length_error(surface: Any, flat: Any) -> float:
    """Return the mean of |l'/l - 1| over the mesh edges."""
    mesh = _mesh(surface)
    a, b = mesh.edges.T
    q = _flat(surface, flat)
    before = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    after = np.linalg.norm(q[a] - q[b], axis=1)
    ok = before > 0
    return float(np.abs(after[ok] / before[ok] - 1.0).mean())


def principal_strains(surface: Any, flat: Any) -> Strains:
    """Return the larger principal strain max |s - 1| of every corner triangle, pooled.

    There are four corner triangles per quad and one per triangle; those without area are
    left out.
    """
    values = corner_strains(surface, flat)
    values = values[~np.isnan(values)]
    if not values.size:
        values = np.full(1, np.nan)
    return Strains(float(values.mean()), float(np.percentile(values, 99)), values)


def strains(surface: Any, flat: Any) -> dict[str, float]:
    """Return maximum, 99th percentile and mean of :func:`principal_strains`, by metric name.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> strains(grid, grid[..., :2] * 1.5)["strain_max"]
    0.5
    """
    found = principal_strains(surface, flat)
    largest = float(found.values.max())
    return {"strain_max": largest, "strain_p99": found.p99, "strain_mean": found.mean}


def corner_strains(surface: Any, flat: Any) -> Array:
    """Return the larger principal strain max |s - 1| (4 q + t,) of every corner triangle.

    In the order of :func:`gso.mesh.topology.corner_triangles`; NaN for triangles without area.
    """
    tri = topology.corner_triangles(_faces(surface))
    p, q = _in_range(_points(surface), _flat(surface, flat))
    area = _space_areas(p, tri)
    keep = area > 1e-12 * area.max()
    here, there = ([components(x[k]) for k in tri[keep].T] for x in (p, q))
    if q.shape[1] == 2:
        a, b, c = there
        s1, s2 = geometry.singular_values(a, b, c, geometry.rest_frame(*here))
    else:
        s1, s2 = geometry.principal_stretches(
            geometry.first_form(*here), geometry.first_form(*there)
        )
    values = np.full(len(tri), np.nan)
    values[keep] = np.maximum(np.abs(s1 - 1.0), np.abs(s2 - 1.0))
    return values


def face_strains(surface: Any, flat: Any) -> Array:
    """Return the largest of :func:`corner_strains` of every face (m,); NaN without any area."""
    quad = topology.are_quads(_faces(surface))
    values = corner_strains(surface, flat)
    corners, triangles = np.split(values, [4 * np.count_nonzero(quad)])
    out = np.empty(len(quad))
    out[quad] = np.fmax.reduce(corners.reshape(4, -1), axis=0)
    out[~quad] = triangles
    return out


def stretches(surface: Any, flat: Any) -> tuple[Array, Array]:
    """Return the largest and the smallest principal stretch of every face, (m,) each.

    They are ratios of lengths, image over surface, for the edge-midpoint parallelograms of
    quads, and for triangles. Their product is the ratio of areas, their quotient the
    quasi-conformal ratio. NaN where a face has no area.
    """
    faces, (p, q) = _faces(surface), _in_range(_points(surface), _flat(surface, flat))
    out = np.full((2, len(faces)), np.nan)
    quad = topology.are_quads(faces)
    for which, some in zip((quad, ~quad), topology.by_size(faces), strict=True):
        rest, image = (geometry.first_form(*(components(x[k]) for k in some.T)) for x in (p, q))
        with np.errstate(divide="ignore", invalid="ignore"):
            good = rest[0] * rest[2] - rest[1] ** 2 > 1e-12 * rest[0] * rest[2]
            out[:, which] = np.where(good, geometry.principal_stretches(rest, image), np.nan)
    return out[0], out[1]


def quasi_conformal(surface: Any, flat: Any) -> Array:
    """Return the largest over the smallest stretch of every face (m,); 1 is best.

    Second-order accurate on quads, first-order on triangles; NaN where a face has no area.

    >>> grid = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> quasi_conformal(grid, grid[..., :2] * [1.0, 2.0]).round(12)
    array([2., 2., 2., 2.])
    """
    large, small = stretches(surface, flat)
    return large / np.maximum(small, 1e-300)


def area_error(surface: Any, flat: Any) -> float:
    """Return the mean of |A'/A - 1| over the corner triangles that have an area."""
    tri = topology.corner_triangles(_faces(surface))
    p, q = _in_range(_points(surface), _flat(surface, flat))
    before, after = _space_areas(p, tri), corner_areas(q, tri)
    keep = before > 1e-12 * before.max()
    return float(np.abs(after[keep] / before[keep] - 1.0).mean())


def flipped_cells(flat: Any, faces: NDArray[np.int64] | None = None, *, surface: Any = None) -> int:
    """Count the inverted cells in a flat image.

    A grid cell (`flat` is (H, W, 2)) is inverted when any of its four corner triangles has
    signed area <= 0. Any other quad (`flat` is (n, 2), `faces` given) may be concave; it is
    inverted when neither diagonal splits it into two triangles of positive area. A triangle
    is inverted when its signed area is <= 0. With `surface`, cells that have a corner without
    area in space are not counted.
    """
    image = np.asarray(flat, float)
    if faces is None and image.ndim != 3:
        raise MeshError("flipped_cells needs faces=... for an image that is no grid (H, W, 2)")
    points = image.reshape(-1, image.shape[-1])[:, :2]
    table = topology.grid_faces(*image.shape[:2]) if faces is None else faces
    space = None if surface is None else _points(surface)
    return int(_flipped(points, table, space, grid=faces is None).sum())


def _flipped(
    points: Array, faces: NDArray[np.int64], space: Array | None, *, grid: bool
) -> NDArray[np.bool_]:
    """Mark the faces (m,) that are inverted in an image (n, 2), quads first."""
    quads, tris = topology.by_size(faces)
    # Corners 1 and 3 are the split along the diagonal 0-2, corners 0 and 2 the other one.
    bad = corner_areas(points, quads).reshape(4, -1) <= 0
    turned = bad.any(axis=0) if grid else (bad[0] | bad[2]) & (bad[1] | bad[3])
    flipped = np.r_[turned, corner_areas(points, tris) <= 0]
    if space is not None:
        area = _space_areas(space, quads).reshape(4, -1).min(axis=0, initial=np.inf)
        area = np.r_[area, _space_areas(space, tris)]
        flipped &= area > 1e-12 * np.max(area, initial=0.0)
    return flipped


def flipped_faces(mesh: Mesh, flat: Array) -> NDArray[np.int64]:
    """Find the faces of a mesh that are inverted in its flat image (n, 2).

    These are the faces that :func:`flips` counts.

    >>> from gso.mesh import Mesh
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> flipped_faces(Mesh(square, [[0, 1, 2, 3]]), square[:, 1::-1])
    array([0])
    """
    quad = topology.are_quads(mesh.faces)
    order = np.r_[np.flatnonzero(quad), np.flatnonzero(~quad)]
    grid = mesh.grid_index is not None
    return np.sort(order[_flipped(flat, mesh.faces, mesh.vertices, grid=grid)])


def flips(mesh: Mesh, flat: Array) -> int:
    """Count the inverted faces in a flat image (n, 2) of a mesh; see :func:`flipped_cells`."""
    return len(flipped_faces(mesh, flat))


def area(mesh: Mesh, points: Array | None = None) -> float:
    """Return the area of a surface, or of its image (n, 2) or (n, 3) if `points` is given.

    >>> from gso.mesh import Mesh
    >>> area(Mesh.from_grid(np.dstack([*np.mgrid[:3.0, :4.0], np.zeros((3, 4))])))
    6.0
    """
    v = mesh.vertices if points is None else points
    p, q, r = (np.pad(v[k], ((0, 0), (0, 3 - v.shape[1]))) for k in mesh.triangles.T)
    return float(0.5 * np.linalg.norm(np.cross(q - p, r - p), axis=1).sum())


def _in_range(p: Array, q: Array) -> tuple[Array, Array]:
    """Rescale a surface and its image so that fourth powers of lengths do not overflow.

    The unit is a power of two, so the ratios are exact.
    """
    unit = 2.0 ** np.floor(np.log2(np.ptp(p, axis=0).max() or 1.0))
    return p / unit, q / unit


def _space_areas(points: Array, faces: NDArray[np.int64]) -> Array:
    """Return the doubled areas of the corner triangles of faces in space."""
    p, q, r = (points[k] for k in topology.corner_triangles(faces).T)
    return np.linalg.norm(np.cross(q - p, r - p), axis=1)


def corner_areas(flat: Array, faces: NDArray[np.int64]) -> Array:
    """Return the doubled signed areas of the faces' corner triangles in a flat image (n, 2)."""
    tri = topology.corner_triangles(faces)
    return geometry.corner_area2(*(components(flat[tri[:, k]]) for k in range(3)))


def face_normals(surface: Any) -> Array:
    """Return unit normals (m, 3): for quads, of the diagonals' cross product; zero without area."""
    faces, p = _faces(surface), _points(surface)
    a, b = geometry.diagonals(*(components(p[c]) for c in topology.four_corners(faces).T))
    normal = np.stack(geometry.cross(a, b), axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)


def normal_angle(clean: Any, denoised: Any) -> float:
    """Return the mean angle theta between the cell normals of two surfaces, degrees (Table 3)."""
    n1, n2 = face_normals(clean), face_normals(denoised)
    return float(np.degrees(geometry.angle(components(n1), components(n2))).mean())
