"""Smoothers of SciPy, trimesh, MeshLab and VTK on the inputs of the denoise task.

The parameters of each were tuned for each level of noise, on surfaces that are not part of the
report. Peers are therefore given the level of noise; the package's method is not.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from report.method import Method, Solved, combinations
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


def _trimesh(filter: str, case: Case, **parameters: float) -> Solved:
    import trimesh
    from trimesh import smoothing

    mesh = trimesh.Trimesh(case.mesh.vertices, case.mesh.triangles, process=False)
    getattr(smoothing, f"filter_{filter}")(mesh, **parameters)
    return Solved(np.asarray(mesh.vertices).reshape(case.given.shape))


def meshlab(filter: str, case: Case, repeat: int = 1, **parameters: Any) -> Solved:
    """Apply one of MeshLab's filters of coordinates."""
    import pymeshlab

    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(case.mesh.vertices, case.mesh.triangles.astype(np.int32)))
    for _ in range(repeat):
        work.apply_filter(f"apply_coord_{filter}", **parameters)
    return Solved(work.current_mesh().vertex_matrix().reshape(case.given.shape))


def _vtk(case: Case, iterations: int, band: float) -> Solved:
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkWindowedSincPolyDataFilter

    points, cells, surface = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_support.numpy_to_vtk(case.mesh.vertices))
    corners = case.mesh.triangles.astype(np.int64).ravel()
    cells.SetData(3, numpy_support.numpy_to_vtkIdTypeArray(corners))
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


def _peer(name: str, run: Any, needs: str, **ranges: Any) -> Method:
    tuned = {"note": "tuned for each level", "candidates": combinations(**ranges)}
    return Method(name, "denoise", run, peer=True, needs=(needs,), **tuned)


# The volume is not defined for a surface with a boundary.
_laplacian = partial(_trimesh, "laplacian", volume_constraint=False)
_humphrey, _taubin = partial(_trimesh, "humphrey", alpha=0.0), partial(_trimesh, "taubin")
_other_taubin = partial(meshlab, "taubin_smoothing")
_hc = partial(meshlab, "hc_laplacian_smoothing")

_STEPS = (5, 10, 20, 40, 80, 160, 320)
_SPLINE = {"degree": (3, 5), "share": (0.96, 0.98, 1.0, 1.02, 1.04, 1.07, 1.1)}
_SAVGOL = {"window": (21, 25, 29, 33, 39, 45, 53, 61, 63), "order": (3, 4, 5, 6, 7, 8, 9)}
_LAPLACIAN = {"lamb": (0.2, 0.5, 0.9), "iterations": (1, 2, 3, 5, 8, 12, 20, 40)}
_HUMPHREY = {"beta": (0.1, 0.2, 0.5, 0.8), "iterations": (12, 20, 40, 80, 160, 320)}
_TAUBIN = {"lamb": (0.5, 0.7, 0.9), "nu": (0.3, 0.5, 0.7), "iterations": _STEPS}
_OTHER = {"lambda_": (0.5, 0.7, 0.9), "mu": (-0.34, -0.53, -0.74), "stepsmoothnum": _STEPS[:-1]}
_HC = {"repeat": (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)}
_SINC = {"iterations": (20, 50, 100), "band": (5e-5, 2e-4, 1e-3, 5e-3, 2e-2, 5e-2, 0.1)}

METHODS = [
    _peer("SciPy spline", _spline, "scipy", **_SPLINE),
    _peer("Savitzky-Golay", _savgol, "scipy", **_SAVGOL),
    _peer("trimesh Laplacian", _laplacian, "trimesh", **_LAPLACIAN),
    _peer("trimesh Humphrey", _humphrey, "trimesh", **_HUMPHREY),
    _peer("trimesh Taubin", _taubin, "trimesh", **_TAUBIN),
    _peer("MeshLab Taubin", _other_taubin, "pymeshlab", **_OTHER),
    _peer("MeshLab HC Laplacian", _hc, "pymeshlab", **_HC),
    _peer("VTK windowed sinc", _vtk, "vtk", **_SINC),
]
