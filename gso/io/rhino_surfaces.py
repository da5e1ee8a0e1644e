"""Equations of the faces of a 3DM file, through OpenCASCADE."""

from __future__ import annotations

import numpy as np
import rhino3dm
from OCP import collections
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.Geom import Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.ShapeAnalysis import ShapeAnalysis_Surface

from gso.io.brep_surfaces import surface_of
from gso.io.opencascade import knots_of
from gso.mesh import GivenSurface
from gso.typing import Array

#: Distance relative to the size within which a surface is a plane or a quadric, and points are on
#: a surface.
_SAME = 1e-7


def surface_of_face(
    surface: rhino3dm.NurbsSurface,
    number: int,
    points: Array,
    nodes: Array | None,
    scale: float,
) -> tuple[GivenSurface, Array | None]:
    """Return the surface of a face; if it is unrolled, its points in the plane, and normals.

    Parameters
    ----------
    surface : rhino3dm.NurbsSurface
        The whole surface, in the unit of the file.
    number : int
        Its number in the file.
    points : ndarray, (n, 3)
        Points of the face, in millimetres.
    nodes : ndarray, (n, 2), or None
        Their parameters, where they are known.
    scale : float
        Millimetres in the unit of the file.

    Returns
    -------
    surface : GivenSurface
    image : ndarray, (n, 5), or None
        As of :func:`gso.io.brep_surfaces.surface_of`.
    """
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    near = _SAME * size / scale
    kinds = {
        "plane": surface.IsPlanar,
        "sphere": surface.IsSphere,
        "torus": surface.IsTorus,
    }
    for kind, is_one in kinds.items():
        if is_one(near):
            return GivenSurface(f"face {number} ({kind})", kind), None
    spline = _spline(surface, scale)
    face = BRepBuilderAPI_MakeFace(spline, _SAME * size)
    if nodes is None:
        inverse = ShapeAnalysis_Surface(spline)
        found = [inverse.ValueOfUV(gp_Pnt(*p), _SAME * size) for p in points.tolist()]
        nodes = np.array([[p.X(), p.Y()] for p in found])
    return surface_of(face.Face(), number, nodes)


def _spline(surface: rhino3dm.NurbsSurface, scale: float) -> Geom_BSplineSurface:
    """Return OpenCASCADE's copy of a surface, scaled."""
    net = surface.Points
    n, m = net.CountU, net.CountV
    poles, weights = collections.Array2_gp_Pnt(1, n, 1, m), collections.Array2_double(1, n, 1, m)
    for i in range(n):
        for j in range(m):
            # Its coordinates are multiplied by the weight.
            p = net[i, j]
            poles.SetValue(i + 1, j + 1, gp_Pnt(*(scale * x / p.W for x in (p.X, p.Y, p.Z))))
            weights.SetValue(i + 1, j + 1, p.W)
    (u, u_times), (v, v_times) = (
        # openNURBS omits the first and the last knot, on which no basis function depends.
        knots_of(np.array([row[0], *row, row[-1]]))
        for row in (list(surface.KnotsU), list(surface.KnotsV))
    )
    degrees = surface.OrderU - 1, surface.OrderV - 1
    return Geom_BSplineSurface(poles, weights, u, v, u_times, v_times, *degrees)
