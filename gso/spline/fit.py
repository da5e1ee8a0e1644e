"""Least-squares B-spline fits to grids, and their distance from the grids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso import metrics
from gso.errors import MeshError, OptionError
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.spline import BSplineSurface, Gap, basis, clamped_knots
from gso.typing import Array, Json, MeshLike

#: Samples of the spline per grid edge when the two are compared. Grids with _LARGE coordinates
#: or more get two.
_REFINED = 4
_LARGE = 100_000


def fit_spline(surface: MeshLike, controls: int | tuple[int, int] = 16) -> BSplineSurface:
    """Fit a bicubic B-spline to a grid at uniform parameters, by least squares.

    Vertex (i, j) of an (H, W) grid has the parameters (i / (H - 1), j / (W - 1)). The
    optimiser's spline unknowns use the same parameters, so the fit to a surface that was
    optimised as a spline reproduces that spline.

    Parameters
    ----------
    surface : Mesh, array (H, W, 3), path ...
        A grid, or anything that :func:`gso.as_mesh` converts to one; for a result, its `mesh`.
    controls : int or (int, int)
        Control points along both sides, 4 or more. Small grids get fewer; see
        :func:`fitting_controls`.

    Returns
    -------
    BSplineSurface
        In the grid's own coordinates; its `gap` is the distance between spline and grid.

    Raises
    ------
    MeshError
        The surface is not a grid.
    OptionError
        `controls` is not one or two integers of at least 4.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 33), np.linspace(-1, 1, 33), indexing="ij")
    >>> spline = fit_spline(np.stack([u, v, 0.3 * u * v], axis=-1), controls=8)
    >>> spline.net.shape
    (8, 8, 3)
    >>> spline.gap.vertices_max < 1e-12
    True
    """
    mesh = as_mesh(surface)
    spline = interpolated(grid_of(mesh), fitting_controls(controls, grid_of(mesh).shape[:2]))
    return replace(spline, gap=gap(spline, mesh))


def grid_of(mesh: Mesh) -> Array:
    """Return the grid (H, W, 3) of a mesh.

    Raises
    ------
    MeshError
        The mesh is not a grid.
    """
    if mesh.grid is None:
        raise MeshError(
            f"{mesh!r} is no grid, so it has no parameters u and v for a spline; resample it on "
            "a grid of quads (H, W, 3), or save it as a mesh"
        )
    return mesh.grid


def fitting_controls(controls: int | tuple[int, int], shape: tuple[int, ...]) -> tuple[int, int]:
    """Limit the numbers of control points to what the two sides of a grid support.

    A side gets at most two control points per three vertices, so that the vertices determine
    the spline between them; but at least four, or as many as it has vertices.

    >>> fitting_controls(16, (64, 9))
    (16, 6)
    """
    wanted = controls if isinstance(controls, tuple | list) else (controls, controls)
    numbers = all(isinstance(c, int | np.integer) and not isinstance(c, bool) for c in wanted)
    if len(wanted) != 2 or not numbers or min(wanted) < 4:
        raise OptionError(f"controls is {controls!r}; it must be one or two integers, 4 or more")
    low, high = (min(c, max(2 * (s + 1) // 3, min(s, 4))) for c, s in zip(wanted, shape))
    return int(low), int(high)


def interpolated(points: Array, controls: tuple[int, int]) -> BSplineSurface:
    """Fit a spline with the given numbers of control points to a grid (H, W, 3)."""
    shape = points.shape[:2]
    # Centring avoids cancellation far from the origin. The basis sums to one, so the spline
    # moves with its control points.
    centre = points.reshape(-1, 3).mean(axis=0)
    knots = [clamped_knots(c) for c in controls]
    bases = [
        basis(k, c, np.linspace(0.0, 1.0, s))
        for k, c, s in zip(knots, controls, shape, strict=True)
    ]
    net = np.linalg.lstsq(bases[0], (points - centre).reshape(shape[0], -1), rcond=None)[0]
    net = np.swapaxes(net.reshape(controls[0], shape[1], 3), 0, 1).reshape(shape[1], -1)
    net = np.linalg.lstsq(bases[1], net, rcond=None)[0]
    net = np.swapaxes(net.reshape(controls[1], controls[0], 3), 0, 1)
    return BSplineSurface(net + centre, knots[0], knots[1])


def describe_spline(
    net: Array, mesh: Mesh, design: Mesh, fitted: Array | None = None
) -> tuple[BSplineSurface, Json]:
    """Describe the spline of a solve by its curvature and distances.

    Parameters
    ----------
    net : ndarray, (p, q, 3)
        Control points.
    mesh : Mesh
        The spline's samples at uniform parameters.
    design : Mesh
        The surface that the spline should stay close to.
    fitted : ndarray, (n, 3), optional
        Vertices that the first spline of the solve was fitted to.

    Returns
    -------
    BSplineSurface
    dict
        "controls"; "curvature", the mean |K| of the smooth surface in 1/size^2, with the
        design's size; and distances (:class:`gso.spline.Gap`): "mesh" and "design" from the
        spline to these two, "fitted" from the first fit to its data.
    """
    controls = net.shape[0], net.shape[1]
    spline = BSplineSurface(net, clamped_knots(controls[0]), clamped_knots(controls[1]))
    spline = replace(spline, gap=gap(spline, mesh))
    said: Json = {
        "controls": list(controls),
        "curvature": spline.mean_gaussian_curvature() * metrics.unit(design) ** 2,
        "mesh": spline.gap._asdict(),  # type: ignore[union-attr]
        "design": gap(spline, design)._asdict(),
    }
    if fitted is not None:
        source = mesh.replaced(fitted)
        said["fitted"] = gap(interpolated(grid_of(source), controls), source)._asdict()
    return spline, said


def gap(spline: BSplineSurface, mesh: Mesh) -> Gap:
    """Measure the distances between a spline and a grid of about the same size.

    The spline is sampled at a quarter of the grid's spacing (at half of it for large grids)
    and replaced by the triangles between the samples.
    """
    shape = grid_of(mesh).shape[:2]
    finer = _REFINED if mesh.vertices.size < _LARGE else 2
    dense = Mesh.from_grid(spline.sample(*(finer * (s - 1) + 1 for s in shape)), weld=False)
    there = metrics.point_to_surface(mesh.vertices[mesh.used], dense)
    back = metrics.point_to_surface(dense.vertices, mesh)
    return Gap(*(float(f) for f in (there.mean(), there.max(), back.mean(), back.max())))
