"""Smoothers of SciPy, trimesh, MeshLab and VTK on the inputs of the denoise task.

The parameters of each were tuned for each level of noise, on surfaces that are not part of the
report. Peers are therefore given the level of noise; the package's method is not.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from report.method import Array, Method, Solved
from report.surfaces import Case


def _spline(case: Case, degree: int, share: float) -> Solved:
    from scipy.interpolate import RectBivariateSpline

    h, w, _ = case.given.shape
    u, v = np.arange(float(h)), np.arange(float(w))
    left = share * h * w * case.sigma**2
    parts = [
        RectBivariateSpline(u, v, part, kx=degree, ky=degree, s=left)(u, v)
        for part in np.moveaxis(case.given, -1, 0)
    ]
    return Solved(np.stack(parts, axis=-1))


def _savgol(case: Case, window: int, order: int) -> Solved:
    from scipy.signal import savgol_filter

    points = case.given
    for axis in (0, 1):
        # The window must be odd and not longer than the grid.
        length = min(window, (points.shape[axis] - 1) | 1)
        points = savgol_filter(points, length, min(order, length - 1), axis=axis)
    return Solved(points)


def _triangles(case: Case) -> tuple[Array, np.ndarray]:
    return np.array(case.mesh.vertices), np.array(case.mesh.triangles)


def _trimesh(case: Case, filter: str, **parameters: float) -> Solved:
    import trimesh
    from trimesh import smoothing

    mesh = trimesh.Trimesh(*_triangles(case), process=False)
    getattr(smoothing, filter)(mesh, **parameters)
    return Solved(np.asarray(mesh.vertices).reshape(case.given.shape))


def _meshlab(case: Case, filter: str, repeat: int = 1, **parameters: float) -> Solved:
    import pymeshlab

    vertices, triangles = _triangles(case)
    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(vertices, triangles.astype(np.int32)))
    for _ in range(repeat):
        work.apply_filter(f"apply_coord_{filter}_smoothing", **parameters)
    return Solved(work.current_mesh().vertex_matrix().reshape(case.given.shape))


def _vtk(case: Case, iterations: int, band: float) -> Solved:
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkWindowedSincPolyDataFilter

    vertices, triangles = _triangles(case)
    points, cells, surface = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_support.numpy_to_vtk(vertices))
    cells.SetData(3, numpy_support.numpy_to_vtkIdTypeArray(triangles.astype(np.int64).ravel()))
    surface.SetPoints(points)
    surface.SetPolys(cells)
    smoother = vtkWindowedSincPolyDataFilter()
    smoother.SetInputData(surface)
    smoother.SetNumberOfIterations(iterations)
    smoother.SetPassBand(band)
    smoother.BoundarySmoothingOn()
    smoother.NonManifoldSmoothingOn()
    smoother.NormalizeCoordinatesOn()
    smoother.Update()
    smooth = numpy_support.vtk_to_numpy(smoother.GetOutput().GetPoints().GetData())
    return Solved(smooth.astype(float).reshape(case.given.shape))


def _grid(fixed: dict[str, Any] | None = None, **ranges: Any) -> tuple[dict[str, Any], ...]:
    """Return every combination of parameters."""
    names = list(ranges)
    combinations = product(*ranges.values())
    return tuple({**(fixed or {}), **dict(zip(names, values))} for values in combinations)


def _peer(name: str, run: Any, needs: str, candidates: tuple[dict[str, Any], ...]) -> Method:
    note = "tuned for each level"
    return Method(
        name,
        "denoise",
        run,
        peer=True,
        note=note,
        needs=(needs,),
        candidates=candidates,
        files=(Path(__file__),),
    )


_STEPS = (1, 2, 3, 5, 8, 12, 20, 40)

METHODS = [
    _peer(
        "SciPy spline",
        _spline,
        "scipy",
        _grid(degree=(3, 5), share=(0.96, 0.98, 1.0, 1.02, 1.04, 1.07, 1.1)),
    ),
    _peer(
        "Savitzky-Golay",
        _savgol,
        "scipy",
        _grid(window=(21, 25, 29, 33, 39, 45, 53, 61, 63), order=(3, 4, 5, 6, 7, 8, 9)),
    ),
    _peer(
        "trimesh Laplacian",
        _trimesh,
        "trimesh",
        _grid(
            # The volume is not defined for a surface with a boundary.
            {"filter": "filter_laplacian", "volume_constraint": False},
            lamb=(0.2, 0.5, 0.9),
            iterations=_STEPS,
        ),
    ),
    _peer(
        "trimesh Humphrey",
        _trimesh,
        "trimesh",
        _grid(
            {"filter": "filter_humphrey", "alpha": 0.0},
            beta=(0.1, 0.2, 0.5, 0.8),
            iterations=(12, 20, 40, 80, 160, 320),
        ),
    ),
    _peer(
        "trimesh Taubin",
        _trimesh,
        "trimesh",
        _grid(
            {"filter": "filter_taubin"},
            lamb=(0.5, 0.7, 0.9),
            nu=(0.3, 0.5, 0.7),
            iterations=(5, 10, 20, 40, 80, 160, 320),
        ),
    ),
    _peer(
        "MeshLab Taubin",
        _meshlab,
        "pymeshlab",
        _grid(
            {"filter": "taubin"},
            lambda_=(0.5, 0.7, 0.9),
            mu=(-0.34, -0.53, -0.74),
            stepsmoothnum=(5, 10, 20, 40, 80, 160),
        ),
    ),
    _peer(
        "MeshLab HC Laplacian",
        _meshlab,
        "pymeshlab",
        _grid({"filter": "hc_laplacian"}, repeat=(1, 2, 3, 4, 6, 8, 12, 16, 24, 32)),
    ),
    _peer(
        "VTK windowed sinc",
        _vtk,
        "vtk",
        _grid(iterations=(20, 50, 100), band=(5e-5, 2e-4, 1e-3, 5e-3, 2e-2, 5e-2, 0.1)),
    ),
]
