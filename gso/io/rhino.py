"""3DM (Rhino, openNURBS) through rhino3dm."""

from __future__ import annotations

import base64
from typing import Any

from gso.errors import MeshError
from gso.spline import BSplineSurface

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
    import rhino3dm

    # The type stubs of rhino3dm lack some setters.
    rhino: Any = rhino3dm
    n, m = spline.net.shape[:2]
    p, q = spline.degrees
    surface = rhino.NurbsSurface.Create(3, False, p + 1, q + 1, n, m)
    for i, row in enumerate(spline.net.tolist()):
        for j, point in enumerate(row):
            surface.Points[i, j] = rhino.Point4d(*point, 1.0)
    # openNURBS omits the first and the last knot, on which no basis function depends.
    for k, knot in enumerate(spline.knots_u[1:-1].tolist()):
        surface.KnotsU[k] = knot
    for k, knot in enumerate(spline.knots_v[1:-1].tolist()):
        surface.KnotsV[k] = knot
    if not surface.IsValid:
        raise MeshError(f"is no valid surface to openNURBS: {surface.IsValidWithLog[1]}")
    model = rhino.File3dm()
    model.ApplicationName = "gso"
    model.Settings.ModelUnitSystem = getattr(rhino.UnitSystem, _UNITS[unit])
    model.Settings.ModelAbsoluteTolerance = _TOLERANCE * spline.size
    model.Objects.AddSurface(surface)
    return base64.b64decode(model.Encode())
