"""STEP (AP214) and IGES (5.3) through OpenCASCADE."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
from OCP import collections
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
from OCP.Geom import Geom_BSplineSurface
from OCP.Geom2d import Geom2d_BSplineCurve
from OCP.GeomToIGES import GeomToIGES_GeomSurface
from OCP.gp import gp_Ax1, gp_Dir, gp_Pln, gp_Pnt, gp_Pnt2d
from OCP.IGESControl import IGESControl_Writer
from OCP.IGESData import IGESData_IGESWriter
from OCP.IGESSelect import IGESSelect_WorkLibrary
from OCP.Interface import Interface_Protocol, Interface_Static
from OCP.Message import Message
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import (
    STEPControl_Controller,
    STEPControl_StepModelType,
    STEPControl_Writer,
)
from OCP.StepData import StepData_StepWriter
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Shell, TopoDS_Wire
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from gso.errors import MeshError
from gso.io.cad import Solid
from gso.mesh import Mesh
from gso.quantities import MILLIMETRES
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

#: Distance, relative to the size, and angle in radians within which triangles are in one plane.
_FLAT, _LEVEL = 1e-9, 1e-6
#: Distance, relative to the size, within which round faces and their neighbours are joined.
_ROUND = 1e-7

#: Distance, relative to the size of the largest patch, within which edges are joined.
_SEWN = 1e-5


def write(
    content: BSplineSurface | Mesh | Sequence[TrimmedSpline], unit: str, suffix: str
) -> bytes:
    """Return the contents of a STEP or IGES file.

    A spline becomes one face, bounded by the edges of the surface (in IGES entity 128). The
    faces of a mesh, which must be planar, and trimmed splines become a shell; in STEP files its
    faces share their edges.
    """
    scale, name = (1.0, _UNITS[unit]) if unit in _UNITS else (MILLIMETRES[unit], "MM")
    step = suffix in (".step", ".stp")
    if not step and not isinstance(content, BSplineSurface):
        # The writer of shapes converts them from millimetres itself.
        scale = MILLIMETRES[unit]
    small = f"shorter than {_TOLERANCE:g} {unit}, which OpenCASCADE takes for a point"
    if isinstance(content, Mesh):
        shape = _shell(scale * content.vertices, content.faces, small)
    elif not isinstance(content, BSplineSurface):
        shape = _trimmed_shell([patch.moved(scale) for patch in content])
    else:
        shape = _surface(content.moved(scale))
        if step:
            shape = BRepBuilderAPI_MakeFace(shape, _TOLERANCE).Shape()
    if not step:
        return _iges(shape, name, whole=isinstance(content, BSplineSurface))
    written = _step(shape, name)
    if isinstance(content, BSplineSurface) and b"B_SPLINE_SURFACE_WITH_KNOTS" not in written:
        raise MeshError(f"the surface has a side {small}; is the unit right?")
    return written


def write_solids(solids: Sequence[Solid | tuple[str, Mesh]]) -> bytes:
    """Return the contents of a STEP file of solids in millimetres; see :class:`Solid`."""
    document = TDocStd_Document(TCollection_ExtendedString("gso"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 1e-3)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    text = io.BytesIO()
    with quiet(), settings({"write.step.unit": "MM", "xstep.cascade.unit": "MM"}):
        for one in (Solid(*given) for given in solids):
            label = shapes.AddShape(_round_solid(one) or _solid(one.mesh, one.name), False)
            TDataStd_Name.Set_s(label, TCollection_ExtendedString(one.name))
        writer = STEPCAFControl_Writer()
        writer.SetNameMode(True)
        if not writer.Transfer(document):
            raise MeshError("OpenCASCADE could not write the solids")
        writer.WriteStream(text)
    return text.getvalue()


def _round_solid(given: Solid) -> TopoDS_Shape | None:
    """Return a solid with round faces; None if it has none, or if they leave gaps."""
    if not given.turned or given.kept is None:
        return None
    mesh = given.mesh
    sewing = BRepBuilderAPI_Sewing(_ROUND * mesh.diagonal)
    if len(given.kept):
        sewing.Add(_joined(mesh.vertices, mesh.triangles[given.kept], given.name))
    for face in given.turned:
        ends = (gp_Pnt(*end) for end in face.line.tolist())
        about = gp_Ax1(gp_Pnt(*face.centre.tolist()), gp_Dir(*face.axis.tolist()))
        edge = BRepBuilderAPI_MakeEdge(*ends).Edge()
        sewing.Add(BRepPrimAPI_MakeRevol(edge, about, face.angle).Shape())
    sewing.Perform()
    if sewing.NbFreeEdges() or sewing.NbMultipleEdges():
        return None
    solid = _inside(sewing.SewedShape(), mesh.diagonal)
    return solid if BRepCheck_Analyzer(solid).IsValid() else None


def _solid(mesh: Mesh, name: str) -> TopoDS_Shape:
    """Return the solid inside a closed mesh."""
    return _inside(_joined(mesh.vertices, mesh.triangles, name), mesh.diagonal)


def _inside(shell: TopoDS_Shape, size: float) -> TopoDS_Shape:
    """Return the solid inside a closed shell; neighbours on one surface become one face."""
    merged = ShapeUpgrade_UnifySameDomain(shell)
    merged.SetLinearTolerance(_FLAT * size)
    merged.SetAngularTolerance(_LEVEL)
    merged.Build()
    shells = TopExp_Explorer(merged.Shape(), TopAbs_ShapeEnum.TopAbs_SHELL)
    solid = BRepBuilderAPI_MakeSolid(TopoDS.Shell(shells.Current())).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return solid


def _joined(points: Array, triangles: Ints, name: str) -> TopoDS_Shape:
    """Return a shell of triangles that share edges as the mesh does, wherever points coincide."""
    corners = [BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex() for p in points.tolist()]
    p, q, r = points[triangles].transpose(1, 0, 2)
    normals = np.cross(q - p, r - p)
    edges: dict[tuple[int, int], TopoDS_Edge] = {}
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for k, (face, normal) in enumerate(zip(triangles.tolist(), normals.tolist(), strict=True)):
        wire = BRepBuilderAPI_MakeWire()
        for a, b in pairwise([*face, face[0]]):
            ends = min(a, b), max(a, b)
            if ends not in edges:
                made = BRepBuilderAPI_MakeEdge(*(corners[end] for end in ends))
                if not made.IsDone():
                    raise MeshError(
                        f"{name} has a side shorter than {_TOLERANCE:g} mm; is the unit right?"
                    )
                edges[ends] = made.Edge()
            wire.Add(edges[ends])
        plane = gp_Pln(gp_Pnt(*points[face[0]].tolist()), gp_Dir(*normal))
        flat = BRepBuilderAPI_MakeFace(plane, wire.Wire(), True) if wire.IsDone() else None
        if flat is None or not flat.IsDone():
            raise MeshError(f"triangle {k} of {name} is no face to OpenCASCADE")
        builder.Add(shell, flat.Face())
    shell.Closed(True)
    return shell


def _step(shape: TopoDS_Shape, name: str) -> bytes:
    """Return the contents of a STEP file of a shape in a unit."""
    kind = STEPControl_StepModelType.STEPControl_ShellBasedSurfaceModel
    with quiet(), settings({"write.step.unit": name, "xstep.cascade.unit": name}):
        session = STEPControl_Writer()
        session.Transfer(shape, kind)
        writer = StepData_StepWriter(session.Model())
        return _printed(writer, session.WS().Protocol())


def _iges(shape: TopoDS_Shape, name: str, whole: bool) -> bytes:
    """Return the contents of an IGES file of a shape, or of a whole surface, in a unit."""
    with quiet():
        session = IGESControl_Writer("IN" if name == "INCH" else name, 0 if whole else 1)
        if whole:
            maker = GeomToIGES_GeomSurface()
            maker.SetModel(session.Model())
            maker.SetUnit(1.0)
            session.AddEntity(maker.TransferSurface(shape, *shape.Bounds()))
        else:
            session.AddShape(shape)
        writer = IGESData_IGESWriter(session.Model())
        return _printed(writer, IGESSelect_WorkLibrary.DefineProtocol_s())


def _shell(points: Array, faces: Ints, small: str) -> TopoDS_Shape:
    """Return a shell of planar faces; `small` describes what is too small."""
    sewing = BRepBuilderAPI_Sewing(_TOLERANCE)
    for k, face in enumerate(faces):
        polygon = BRepBuilderAPI_MakePolygon()
        for point in points[face[face >= 0]].tolist():
            polygon.Add(gp_Pnt(*point))
        polygon.Close()
        made = BRepBuilderAPI_MakeFace(polygon.Wire(), True) if polygon.IsDone() else None
        if made is None or not made.IsDone():
            raise MeshError(f"face {k} is not planar, or has a side {small}; is the unit right?")
        sewing.Add(made.Shape())
    sewing.Perform()
    return sewing.SewedShape()


def _trimmed_shell(patches: Sequence[TrimmedSpline]) -> TopoDS_Shape:
    sewing = BRepBuilderAPI_Sewing(_SEWN * max(patch.spline.size for patch in patches))
    for patch in patches:
        surface = _surface(patch.spline)
        for loops in patch.faces:
            sewing.Add(_trimmed_face(surface, loops))
    sewing.Perform()
    return sewing.SewedShape()


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
    # Readers do not need it.
    from scipy.interpolate import make_interp_spline

    step = np.hypot(*np.diff(points, axis=0).T)
    along = np.r_[0.0, np.cumsum(step)]
    spline = make_interp_spline(along / along[-1], points, k=min(3, len(points) - 1))
    poles = collections.Array1_gp_Pnt2d(1, len(spline.c))
    for k, point in enumerate(spline.c.tolist(), 1):
        poles.SetValue(k, gp_Pnt2d(*point))
    return Geom2d_BSplineCurve(poles, *knots_of(spline.t), spline.k)


def _surface(spline: BSplineSurface) -> Geom_BSplineSurface:
    """Return the OpenCASCADE surface of a spline."""
    poles = collections.Array2_gp_Pnt(1, spline.net.shape[0], 1, spline.net.shape[1])
    for i, row in enumerate(spline.net.tolist(), 1):
        for j, point in enumerate(row, 1):
            poles.SetValue(i, j, gp_Pnt(*point))
    (u, u_times), (v, v_times) = knots_of(spline.knots_u), knots_of(spline.knots_v)
    return Geom_BSplineSurface(poles, u, v, u_times, v_times, *spline.degrees)


def knots_of(every: Array) -> tuple[collections.Array1_double, collections.Array1_int]:
    """Return the different knots and their multiplicities as arrays of OpenCASCADE."""
    knots, times = np.unique(every, return_counts=True)
    out = collections.Array1_double(1, len(knots)), collections.Array1_int(1, len(knots))
    for k, (knot, time) in enumerate(zip(knots.tolist(), times.tolist(), strict=True), 1):
        out[0].SetValue(k, knot)
        out[1].SetValue(k, time)
    return out


def _printed(
    writer: StepData_StepWriter | IGESData_IGESWriter, protocol: Interface_Protocol
) -> bytes:
    """Return the text of a file writer."""
    writer.FloatWriter().SetFormat(_FORMAT, True)
    writer.SendModel(protocol)
    text = io.BytesIO()
    if not writer.Print(text):
        raise MeshError("OpenCASCADE could not write the surface")
    return text.getvalue()


@contextmanager
def settings(wanted: dict[str, str]) -> Iterator[None]:
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
def quiet() -> Iterator[None]:
    """Suppress OpenCASCADE's messages on standard output."""
    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    try:
        for printer in printers:
            messenger.RemovePrinter(printer)
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)
