"""3DM (Rhino, openNURBS) through rhino3dm."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import numpy as np
import rhino3dm

from gso.errors import MeshError
from gso.mesh import Mesh, topology
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

#: Knots of one span of degree one.
_ENDS = np.array([0.0, 0.0, 1.0, 1.0])

#: Absolute tolerance of the model in the file, as a fraction of the spline's size.
_TOLERANCE = 1e-5


def write(
    content: BSplineSurface | Mesh | Sequence[TrimmedSpline], unit: str, suffix: str
) -> bytes:
    """Return the contents of a .3dm file, in double precision.

    A mesh becomes a ruled surface of degree one for each face. Their corners are the same points,
    so that they can be joined; rhino3dm cannot join them. It cannot make trimmed surfaces either:
    for trimmed splines, the layer "surfaces" has the whole splines, and the layer "outlines"
    closed polylines on them.
    """
    model = rhino3dm.File3dm()
    model.ApplicationName = "gso"
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, _UNITS[unit])
    if isinstance(content, BSplineSurface):
        size = content.size
        model.Objects.AddSurface(_surface(content, "the spline"))
    elif isinstance(content, Mesh):
        size = content.diagonal
        # A triangle has a side without length.
        corners = content.vertices[topology.four_corners(content.faces)]
        for k, (a, b, c, d) in enumerate(corners):
            surface = BSplineSurface(np.array([[a, d], [b, c]]), _ENDS, _ENDS)
            model.Objects.AddSurface(_surface(surface, f"face {k}"))
    else:
        size = max(patch.spline.size for patch in content)
        surfaces, outlines = (_layer(model, name) for name in ("surfaces", "outlines"))
        for k, patch in enumerate(content):
            model.Objects.AddSurface(_surface(patch.spline, f"patch {k}"), surfaces)
            for line in patch.outlines():
                points = [rhino3dm.Point3d(*p) for p in [*line.tolist(), line[0].tolist()]]
                model.Objects.AddPolyline(rhino3dm.Polyline(points), outlines)
    model.Settings.ModelAbsoluteTolerance = _TOLERANCE * size
    return base64.b64decode(model.Encode())


def _layer(model: rhino3dm.File3dm, name: str) -> rhino3dm.ObjectAttributes:
    """Add a layer, and return the attributes of objects on it."""
    layer = rhino3dm.Layer()
    layer.Name = name
    attributes = rhino3dm.ObjectAttributes()
    attributes.LayerIndex = model.Layers.Add(layer)
    return attributes


def _surface(spline: BSplineSurface, what: str) -> rhino3dm.NurbsSurface:
    n, m = spline.net.shape[:2]
    p, q = spline.degrees
    surface = rhino3dm.NurbsSurface.Create(3, False, p + 1, q + 1, n, m)
    for i, row in enumerate(spline.net.tolist()):
        for j, point in enumerate(row):
            surface.Points[i, j] = rhino3dm.Point4d(*point, 1.0)
    # openNURBS omits the first and the last knot, on which no basis function depends.
    for places, knots in ((surface.KnotsU, spline.knots_u), (surface.KnotsV, spline.knots_v)):
        for k, knot in enumerate(knots[1:-1].tolist()):
            places[k] = knot
    if not surface.IsValid:
        raise MeshError(f"{what} is no valid surface to openNURBS: {surface.IsValidWithLog[1]}")
    return surface
