"""3DM (Rhino, openNURBS) through rhino3dm."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import rhino3dm

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.spline import BSplineSurface, TrimmedSpline

_UNITS = {
    "um": "Microns",
    "mm": "Millimeters",
    "cm": "Centimeters",
    "dm": "Decimeters",
    "m": "Meters",
    "in": "Inches",
    "ft": "Feet",
    "yd": "Yards",
}

#: Absolute tolerance of the model in the file, as a fraction of the spline's size.
_TOLERANCE = 1e-5


def write(spline: BSplineSurface, unit: str) -> bytes:
    """Return the contents of a .3dm file with one surface, in double precision."""
    model = _model(unit, spline.size)
    model.Objects.AddSurface(_surface(spline))
    return base64.b64decode(model.Encode())


def write_trimmed(patches: Sequence[TrimmedSpline], unit: str) -> bytes:
    """Return the contents of a .3dm file with whole splines and the outlines to trim them by.

    rhino3dm cannot make trimmed surfaces. The layer "surfaces" has the splines, and the layer
    "outlines" closed polylines on them.
    """
    model = _model(unit, max(patch.spline.size for patch in patches))
    layers = []
    for name in ("surfaces", "outlines"):
        layer = rhino3dm.Layer()
        layer.Name = name
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex = model.Layers.Add(layer)
        layers.append(attributes)
    for patch in patches:
        model.Objects.AddSurface(_surface(patch.spline), layers[0])
        for line in patch.outlines():
            points = [rhino3dm.Point3d(*p) for p in [*line.tolist(), line[0].tolist()]]
            model.Objects.AddPolyline(rhino3dm.Polyline(points), layers[1])
    return base64.b64decode(model.Encode())


def _surface(spline: BSplineSurface) -> rhino3dm.NurbsSurface:
    n, m = spline.net.shape[:2]
    p, q = spline.degrees
    surface = rhino3dm.NurbsSurface.Create(3, False, p + 1, q + 1, n, m)
    for i, row in enumerate(spline.net.tolist()):
        for j, point in enumerate(row):
            surface.Points[i, j] = rhino3dm.Point4d(*point, 1.0)
    # openNURBS omits the first and the last knot, on which no basis function depends.
    for k, knot in enumerate(spline.knots_u[1:-1].tolist()):
        surface.KnotsU[k] = knot
    for k, knot in enumerate(spline.knots_v[1:-1].tolist()):
        surface.KnotsV[k] = knot
    if not surface.IsValid:
        raise MeshError(f"is no valid surface to openNURBS: {surface.IsValidWithLog[1]}")
    return surface


def write_faces(mesh: Mesh, unit: str) -> bytes:
    """Return the contents of a .3dm file with a ruled surface of degree one for each face.

    Their corners are the same points, so that they can be joined; rhino3dm cannot join them.
    """
    model = _model(unit, mesh.diagonal)
    for k, face in enumerate(mesh.faces.tolist()):
        # A triangle has a side without length.
        a, b, c, d = [v for v in face if v >= 0] + [face[2]] * (4 - sum(v >= 0 for v in face))
        surface = rhino3dm.NurbsSurface.Create(3, False, 2, 2, 2, 2)
        for (i, j), vertex in zip(((0, 0), (1, 0), (1, 1), (0, 1)), (a, b, c, d), strict=True):
            surface.Points[i, j] = rhino3dm.Point4d(*mesh.vertices[vertex].tolist(), 1.0)
        for end in (0, 1):
            surface.KnotsU[end] = surface.KnotsV[end] = float(end)
        if not surface.IsValid:
            raise MeshError(f"face {k} is no valid surface to openNURBS")
        model.Objects.AddSurface(surface)
    return base64.b64decode(model.Encode())


def _model(unit: str, size: float) -> rhino3dm.File3dm:
    model = rhino3dm.File3dm()
    model.ApplicationName = "gso"
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, _UNITS[unit])
    model.Settings.ModelAbsoluteTolerance = _TOLERANCE * size
    return model
