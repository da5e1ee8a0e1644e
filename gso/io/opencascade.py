"""STEP (AP214) and IGES (5.3) through OpenCASCADE."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import TypeVar

import numpy as np
from OCP import collections
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.Geom import Geom_BSplineSurface
from OCP.Geom2d import Geom2d_BSplineCurve
from OCP.GeomToIGES import GeomToIGES_GeomSurface
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.IGESControl import IGESControl_Writer
from OCP.IGESData import IGESData_IGESWriter
from OCP.IGESSelect import IGESSelect_WorkLibrary
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.STEPControl import (
    STEPControl_Controller,
    STEPControl_StepModelType,
    STEPControl_Writer,
)
from OCP.StepData import StepData_StepWriter
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape, TopoDS_Wire
from scipy.interpolate import make_interp_spline

from gso.errors import MeshError
from gso.io.svg import MILLIMETRES
from gso.mesh import Mesh
from gso.spline import BSplineSurface, TrimmedSpline
from gso.spline.trimmed import Loop
from gso.typing import Array, Ints

#: OpenCASCADE's names of the units that both formats know; IGES has another one for inches.
_UNITS = {"um": "UM", "mm": "MM", "cm": "CM", "m": "M", "in": "INCH", "ft": "FT"}

#: All digits of a double. The writers' default formats keep ten digits, and truncate
#: exponents when asked for more.
_FORMAT = "%.16E"

#: OpenCASCADE's smallest distance between points, in the unit of the file.
_TOLERANCE = 1e-7

#: Distance, relative to the size of the largest patch, within which edges are joined.
_SEWN = 1e-5

A = TypeVar("A", collections.Array1_double, collections.Array1_int)


def step(spline: BSplineSurface, unit: str) -> bytes:
    """Return the contents of a STEP file with one face, bounded by the edges of the surface."""
    surface, name = _converted(spline, unit)
    content = _step(BRepBuilderAPI_MakeFace(surface, _TOLERANCE).Shape(), name)
    if b"B_SPLINE_SURFACE_WITH_KNOTS" not in content:
        raise MeshError(
            f"the surface has a side shorter than {_TOLERANCE:g} {unit}, which STEP takes for a "
            "point; is the unit right?"
        )
    return content


def step_faces(mesh: Mesh, unit: str) -> bytes:
    """Return the contents of a STEP file with a shell of planar faces that share their edges."""
    return _step(*_shell(mesh, unit))


def iges_faces(mesh: Mesh, unit: str) -> bytes:
    """Return the contents of an IGES file with planar faces."""
    return _iges_shell(*_shell(mesh, unit))


def _iges_shell(shell: TopoDS_Shape, name: str) -> bytes:
    """Return the contents of an IGES file of a shell in a unit."""
    with _quiet():
        session = IGESControl_Writer("IN" if name == "INCH" else name, 1)
        session.AddShape(shell)
        return _iges(session)


def _step(shape: TopoDS_Shape, name: str) -> bytes:
    """Return the contents of a STEP file of a shape in a unit."""
    kind = STEPControl_StepModelType.STEPControl_ShellBasedSurfaceModel
    with _quiet(), _settings({"write.step.unit": name, "xstep.cascade.unit": name}):
        session = STEPControl_Writer()
        session.Transfer(shape, kind)
        writer = StepData_StepWriter(session.Model())
        writer.FloatWriter().SetFormat(_FORMAT, True)
        writer.SendModel(session.WS().Protocol())
    return _printed(writer)


def _iges(session: IGESControl_Writer) -> bytes:
    """Return the contents of the IGES file of a session."""
    writer = IGESData_IGESWriter(session.Model())
    writer.FloatWriter().SetFormat(_FORMAT, True)
    writer.SendModel(IGESSelect_WorkLibrary.DefineProtocol_s())
    return _printed(writer)


def _shell(mesh: Mesh, unit: str) -> tuple[TopoDS_Shape, str]:
    """Return a shell of planar faces, and the name of its unit."""
    known = unit in _UNITS
    points = mesh.vertices if known else mesh.vertices * MILLIMETRES[unit]
    sewing = BRepBuilderAPI_Sewing(_TOLERANCE)
    for k, face in enumerate(mesh.faces):
        polygon = BRepBuilderAPI_MakePolygon()
        for point in points[face[face >= 0]].tolist():
            polygon.Add(gp_Pnt(*point))
        polygon.Close()
        made = BRepBuilderAPI_MakeFace(polygon.Wire(), True) if polygon.IsDone() else None
        if made is None or not made.IsDone():
            raise MeshError(
                f"face {k} is not planar, or has a side shorter than {_TOLERANCE:g} {unit}, which "
                "OpenCASCADE takes for a point; is the unit right?"
            )
        sewing.Add(made.Shape())
    sewing.Perform()
    return sewing.SewedShape(), _UNITS[unit if known else "mm"]


def step_trimmed(patches: Sequence[TrimmedSpline], unit: str) -> bytes:
    """Return the contents of a STEP file with a shell of trimmed splines that share edges."""
    return _step(*_trimmed_shell(patches, unit))


def iges_trimmed(patches: Sequence[TrimmedSpline], unit: str) -> bytes:
    """Return the contents of an IGES file with trimmed splines."""
    return _iges_shell(*_trimmed_shell(patches, unit))


def _trimmed_shell(patches: Sequence[TrimmedSpline], unit: str) -> tuple[TopoDS_Shape, str]:
    """Return a shell of trimmed splines, and the name of its unit."""
    known = unit in _UNITS
    size = max(patch.spline.size for patch in patches)
    sewing = BRepBuilderAPI_Sewing(_SEWN * size * (1.0 if known else MILLIMETRES[unit]))
    for patch in patches:
        surface, _ = _converted(patch.spline, unit)
        for loops in patch.faces:
            sewing.Add(_trimmed_face(surface, loops))
    sewing.Perform()
    return sewing.SewedShape(), _UNITS[unit if known else "mm"]


def _trimmed_face(surface: Geom_BSplineSurface, loops: Sequence[Loop]) -> TopoDS_Face:
    """Return a face of a surface inside loops of its parameters.

    Where smooth curves through the points of the loops cross each other, straight segments
    between the points are used.
    """
    for straight in (False, True):
        wires = [_wire(surface, loop, straight) for loop in loops]
        if any(wire is None for wire in wires):
            continue
        face = BRepBuilderAPI_MakeFace(surface, wires[0], True)
        for hole in wires[1:]:
            face.Add(hole)
        if face.IsDone() and BRepCheck_Analyzer(face.Face()).IsValid():
            return face.Face()
    raise MeshError("a surface has an outline that crosses itself or is not closed")


def _wire(surface: Geom_BSplineSurface, loop: Loop, straight: bool) -> TopoDS_Wire | None:
    """Return the wire of a loop, of smooth curves or of straight segments; None if it is open."""
    wire = BRepBuilderAPI_MakeWire()
    for curve in loop:
        new = np.r_[True, (np.diff(curve, axis=0) != 0).any(axis=1)]
        points = curve[new]
        for part in pairwise(points) if straight else [points]:
            edge = BRepBuilderAPI_MakeEdge(_plane_curve(np.array(part)), surface)
            if not edge.IsDone():
                return None
            wire.Add(edge.Edge())
            if not wire.IsDone():
                return None
    BRepLib.BuildCurves3d_s(wire.Wire())
    return wire.Wire()


def _plane_curve(points: Array) -> Geom2d_BSplineCurve:
    """Return the curve through points (k, 2) of the parameters of a surface."""
    step = np.hypot(*np.diff(points, axis=0).T)
    along = np.r_[0.0, np.cumsum(step)]
    spline = make_interp_spline(along / along[-1], points, k=min(3, len(points) - 1))
    poles = collections.Array1_gp_Pnt2d(1, len(spline.c))
    for k, point in enumerate(spline.c.tolist(), 1):
        poles.SetValue(k, gp_Pnt2d(*point))
    knots, times = np.unique(spline.t, return_counts=True)
    arrays = _array(collections.Array1_double, knots), _array(collections.Array1_int, times)
    return Geom2d_BSplineCurve(poles, *arrays, spline.k)


def iges(spline: BSplineSurface, unit: str) -> bytes:
    """Return the contents of an IGES file with one B-spline surface (entity 128)."""
    surface, name = _converted(spline, unit)
    with _quiet():
        session = IGESControl_Writer("IN" if name == "INCH" else name, 0)
        maker = GeomToIGES_GeomSurface()
        maker.SetModel(session.Model())
        maker.SetUnit(1.0)
        ends = [k[i] for k in (spline.knots_u, spline.knots_v) for i in (0, -1)]
        session.AddEntity(maker.TransferSurface(surface, *ends))
        return _iges(session)


def _converted(spline: BSplineSurface, unit: str) -> tuple[Geom_BSplineSurface, str]:
    """Return the OpenCASCADE surface in a supported unit, and the name of that unit."""
    known = unit in _UNITS
    net = spline.net if known else spline.net * MILLIMETRES[unit]
    n, m = net.shape[:2]
    poles = collections.Array2_gp_Pnt(1, n, 1, m)
    for i, row in enumerate(net.tolist(), 1):
        for j, point in enumerate(row, 1):
            poles.SetValue(i, j, gp_Pnt(*point))
    knots, multiplicities = [], []
    for every in (spline.knots_u, spline.knots_v):
        different, count = np.unique(every, return_counts=True)
        knots.append(_array(collections.Array1_double, different))
        multiplicities.append(_array(collections.Array1_int, count))
    surface = Geom_BSplineSurface(poles, *knots, *multiplicities, *spline.degrees)
    return surface, _UNITS[unit if known else "mm"]


def _array(kind: type[A], values: Array | Ints) -> A:
    out = kind(1, len(values))
    for k, value in enumerate(values.tolist(), 1):
        out.SetValue(k, value)
    return out


def _printed(writer: StepData_StepWriter | IGESData_IGESWriter) -> bytes:
    """Return the text of a file writer."""
    text = io.BytesIO()
    if not writer.Print(text):
        raise MeshError("OpenCASCADE could not write the surface")
    return text.getvalue()


@contextmanager
def _settings(wanted: dict[str, str]) -> Iterator[None]:
    """Set global parameters of OpenCASCADE inside a block and restore them after it."""
    STEPControl_Controller.Init_s()
    before = {name: Interface_Static.CVal_s(name) for name in wanted}
    try:
        for name, value in wanted.items():
            Interface_Static.SetCVal_s(name, value)
        yield
    finally:
        for name, value in before.items():
            Interface_Static.SetCVal_s(name, value)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress OpenCASCADE's messages of success on standard output."""
    printers = list(Message.DefaultMessenger_s().Printers())
    levels = [printer.GetTraceLevel() for printer in printers]
    try:
        for printer in printers:
            printer.SetTraceLevel(Message_Gravity.Message_Fail)
        yield
    finally:
        for printer, level in zip(printers, levels, strict=True):
            printer.SetTraceLevel(level)
