"""STEP and IGES files read through OpenCASCADE: faces in triangles, with shared edges."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from OCP import collections
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from gso.errors import MeshError
from gso.io.brep_surfaces import surface_of
from gso.io.opencascade import quiet, settings
from gso.io.raw_surface import Surface
from gso.mesh import GivenSurface, GivenSurfaces
from gso.mesh.attributes import Attributes, Labels
from gso.mesh.topology import label_components
from gso.mesh.welding import collapse
from gso.typing import Array, Ints
from gso.wording import listed

#: Chord tolerance by default, relative to the size, and the largest angle between neighbouring
#: facets, in radians: bends of 30 degrees, too, have four of them.
_CHORD, _ANGLE = 1e-4, np.radians(7.5)
#: Distance, relative to the size, within which points are one, and edges of faces are joined.
_SAME, _SEWN = 1e-8, 1e-5
#: Number of triangles from which on files are refused.
_MOST = 5_000_000
#: Number of faces that a note names.
_NAMED = 5


@dataclass(frozen=True)
class _Body:
    """A solid, a shell or loose faces, with its name."""

    name: str
    shape: TopoDS_Shape


def read(data: bytes, suffix: str, chord: float | None = None) -> Surface:
    """Read the faces in a STEP or IGES file as triangles, in millimetres.

    Neighbouring faces have the same points on their common edge. Names of bodies are labels "o",
    names of faces "g", and colours "usemtl" (``#rrggbb``).

    Parameters
    ----------
    data : bytes
    suffix : str
        ".step", ".stp", ".iges" or ".igs".
    chord : float, optional
        Largest distance between triangles and faces, in millimetres; 1e-4 of the size when not
        given. Facets meet at 7.5 degrees at most, too.

    Raises
    ------
    MeshError
        The file is damaged, or has no faces.
    """
    said = {"xstep.cascade.unit": "MM", "read.stepcaf.subshapes.name": "1"}
    with quiet(), settings(said):
        return _surface(_document(data, suffix), chord)


def _document(data: bytes, suffix: str) -> TDocStd_Document:
    """Return what OpenCASCADE reads from a file: shapes, names and colours."""
    document = TDocStd_Document(TCollection_ExtendedString("gso"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 1e-3)
    if suffix in (".step", ".stp"):
        reader = STEPCAFControl_Reader()
        status = reader.ReadStream("in", io.BytesIO(data))
    else:
        reader = IGESCAFControl_Reader()
        # Its reader takes files only.
        with tempfile.TemporaryDirectory() as folder:
            name = os.path.join(folder, "in.igs")
            with open(name, "wb") as file:
                file.write(data)
            status = reader.ReadFile(name)
    for mode in (reader.SetNameMode, reader.SetColorMode):
        mode(True)
    if status != IFSelect_ReturnStatus.IFSelect_RetDone or not reader.Transfer(document):
        kind = "STEP" if suffix in (".step", ".stp") else "IGES"
        raise MeshError(f"OpenCASCADE finds no {kind} file in it; is it cut off?")
    return document


def _surface(document: TDocStd_Document, chord: float | None) -> Surface:
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    roots = collections.Sequence_TDF_Label()
    shapes.GetFreeShapes(roots)
    bodies = [
        body
        for k in range(1, roots.Length() + 1)
        for leaf in _leaves(roots.Value(k), TopLoc_Location(), "")
        for body in _bodies(leaf)
    ]

    def of_face(face: TopoDS_Shape) -> tuple[str, str]:
        alone = face.Located(TopLoc_Location())
        label, colour = TDF_Label(), Quantity_Color()
        named = shapes.FindSubShape(shapes.FindShape(alone, False), alone, label)
        kinds = (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen)
        hit = any(colours.GetColor(x, kind, colour) for x in (alone, face) for kind in kinds)
        return (_name(label) if named else ""), _code(colour) if hit else ""

    points: list[Array] = []
    triangles: list[Ints] = []
    names: list[list[str]] = [[], [], []]
    notes: list[str] = []
    surfaces: list[GivenSurface] = []
    owners: list[Ints] = []
    images: list[Array] = []
    count = 0
    finest, coarsest = np.inf, 0.0
    for body in bodies:
        allowed = _CHORD * _size(body.shape) if chord is None else chord
        mesh = _meshed(body.shape, allowed, len(surfaces))
        if mesh is None:
            continue
        finest, coarsest = min(finest, allowed), max(coarsest, allowed)
        owners.append(mesh.face + len(surfaces))
        surfaces += mesh.surfaces
        images.append(mesh.image)
        points.append(mesh.points)
        triangles.append(mesh.triangles + count)
        count += len(mesh.points)
        said = [of_face(face) for face in mesh.faces]
        for row, values in zip(
            names,
            ([body.name] * len(said), [g for g, _ in said], [c for _, c in said]),
            strict=True,
        ):
            row += [values[k] for k in mesh.face.tolist()]
        if mesh.missing:
            notes.append(
                f"{mesh.missing} faces of {body.name or 'a body'} could not be divided into "
                "triangles, and are left out"
            )
        if sum(map(len, triangles)) > _MOST:
            raise MeshError(f"it has more than {_MOST} triangles; give a larger chord")
    if not points:
        raise MeshError("it has no faces; export the solid or its surfaces, not a drawing")
    labels = {
        kind: found
        for kind, row in zip(("o", "g", "usemtl"), names, strict=True)
        if (found := _labels(row)) is not None
    }
    image = np.concatenate(images)
    given = GivenSurfaces(tuple(surfaces), np.concatenate(owners), image[..., :2], image[..., 2:])
    notes.insert(0, _accuracy(finest, coarsest, given))
    attributes = Attributes(labels=labels, surfaces=given)
    return Surface(np.concatenate(points), np.concatenate(triangles), tuple(notes), attributes)


def _accuracy(finest: float, coarsest: float, given: GivenSurfaces) -> str:
    """Say what is exact and what is within the chord tolerance."""
    chord = " to ".join(f"{x:.3g}" for x in dict.fromkeys((finest, coarsest)))
    free = [
        x.name for x, good in zip(given.surfaces, given.is_developable, strict=True) if not good
    ]
    said = f"curved edges and faces are within {chord} mm of their chords"
    if not free:
        return said
    return f"{said}; not developable: {listed(free, _NAMED)}"


def _leaves(label: TDF_Label, place: TopLoc_Location, name: str) -> Iterator[_Body]:
    """Yield the parts of an assembly, in their places."""
    name = _name(label) or name
    if not XCAFDoc_ShapeTool.IsAssembly_s(label):
        yield _Body(name, XCAFDoc_ShapeTool.GetShape_s(label).Moved(place))
        return
    parts = collections.Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(label, parts)
    for k in range(1, parts.Length() + 1):
        part, meant = parts.Value(k), TDF_Label()
        here = place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(part))
        XCAFDoc_ShapeTool.GetReferredShape_s(part, meant)
        yield from _leaves(meant, here, _name(part) or name)


def _bodies(leaf: _Body) -> Iterator[_Body]:
    """Yield the solids of a part one by one, and its other faces together."""
    solid, face = TopAbs_ShapeEnum.TopAbs_SOLID, TopAbs_ShapeEnum.TopAbs_FACE
    for shape in _inside(leaf.shape, solid):
        yield _Body(leaf.name, shape)
    loose = list(_inside(leaf.shape, face, solid))
    if loose:
        size = max(_size(x) for x in loose) if len(loose) == 1 else _size(leaf.shape)
        sewing = BRepBuilderAPI_Sewing(_SEWN * size)
        for x in loose:
            sewing.Add(x)
        sewing.Perform()
        yield _Body(leaf.name, sewing.SewedShape())


def _inside(
    shape: TopoDS_Shape,
    kind: TopAbs_ShapeEnum,
    avoided: TopAbs_ShapeEnum = TopAbs_ShapeEnum.TopAbs_SHAPE,
) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind, avoided)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _size(shape: TopoDS_Shape) -> float:
    """Return the diagonal of the bounding box of a shape's vertices."""
    points = [
        BRep_Tool.Pnt_s(TopoDS.Vertex(x)) for x in _inside(shape, TopAbs_ShapeEnum.TopAbs_VERTEX)
    ]
    if not points:
        return 1.0
    place = np.array([[p.X(), p.Y(), p.Z()] for p in points])
    return float(np.linalg.norm(np.ptp(place, axis=0))) or 1.0


@dataclass(frozen=True)
class _Meshed:
    """Triangles of a body, the face of each, how many faces are missing, and the surfaces.

    `image` has the corners of unrolled triangles in the plane, and normals; (t, 3, 5).
    """

    points: Array
    triangles: Ints
    face: Ints
    faces: list[TopoDS_Shape]
    missing: int
    surfaces: list[GivenSurface]
    image: Array


def _meshed(shape: TopoDS_Shape, chord: float, first: int) -> _Meshed | None:
    """Divide the faces of a body, which are numbered from `first` on, into triangles."""
    size = _size(shape)
    BRepMesh_IncrementalMesh(shape, chord, False, _ANGLE)
    faces = list(_inside(shape, TopAbs_ShapeEnum.TopAbs_FACE))
    points: list[Array] = []
    triangles: list[Ints] = []
    owner: list[Ints] = []
    surfaces: list[GivenSurface] = []
    images: list[Array] = []
    count = missing = 0
    starts = np.full(len(faces), -1)
    for number, face in enumerate(faces):
        place = TopLoc_Location()
        net = BRep_Tool.Triangulation_s(TopoDS.Face(face), place)
        if net is None or not net.NbTriangles():
            missing += 1
            surfaces.append(GivenSurface(f"face {first + number}", "surface"))
            continue
        inner = [net.UVNode(k).Coord() for k in range(1, net.NbNodes() + 1)]
        surface, image = surface_of(face, first + number, np.array(inner))
        surfaces.append(surface)
        images.append(np.full((len(inner), 5), np.nan) if image is None else image)
        move = place.Transformation()
        nodes = [net.Node(k).Transformed(move) for k in range(1, net.NbNodes() + 1)]
        rows = [net.Triangle(k).Get() for k in range(1, net.NbTriangles() + 1)]
        own = np.array([row[-3:] for row in rows], np.int64) - 1 + count
        if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
            own = own[:, ::-1]
        points.append(np.array([[p.X(), p.Y(), p.Z()] for p in nodes]))
        triangles.append(own)
        owner.append(np.full(len(own), number))
        starts[number] = count
        count += len(nodes)
    if not points:
        return None
    every, corner = np.concatenate(points), np.concatenate(triangles)
    target = _joined(every, faces, starts, _SAME * size)
    done = collapse(corner, target)
    used, compact = np.unique(done.faces, return_inverse=True)
    # A triangle that is kept has its corners in the same order.
    face_of, image = np.concatenate(owner)[done.kept], np.concatenate(images)[corner[done.kept]]
    compact = compact.reshape(-1, 3)
    return _Meshed(every[used], compact, face_of, faces, missing, surfaces, image)


def _joined(points: Array, faces: list[TopoDS_Shape], starts: Ints, near: float) -> Ints:
    """Return the first of the nodes that are one, for each: those of an edge that faces share.

    Nodes that only have the same place stay apart, so that bodies may touch themselves.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Nodes of all faces.
    faces : list of TopoDS_Shape
    starts : ndarray of int
        First node of each face; -1 for faces without triangles.
    near : float
        Distance within which nodes of one edge of one face are the same, as at a pole.
    """
    seen = collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    first: dict[int, Ints] = {}
    one: list[Ints] = []
    other: list[Ints] = []
    for face, start in zip(faces, starts.tolist(), strict=True):
        if start < 0:
            continue
        place = TopLoc_Location()
        net = BRep_Tool.Triangulation_s(TopoDS.Face(face), place)
        for shape in _inside(face, TopAbs_ShapeEnum.TopAbs_EDGE):
            edge = TopoDS.Edge(shape)
            line = BRep_Tool.PolygonOnTriangulation_s(edge, net, place)
            if line is None:
                continue
            nodes = start - 1 + np.array([line.Node(k) for k in range(1, line.NbNodes() + 1)])
            same = first.setdefault(seen.Add(edge), nodes)
            if len(same) == len(nodes):
                one.append(same)
                other.append(nodes)
            ends = np.linalg.norm(np.diff(points[nodes], axis=0), axis=1) <= near
            one.append(nodes[:-1][ends])
            other.append(nodes[1:][ends])
    label = label_components(len(points), np.concatenate(one), np.concatenate(other))
    _, least, index = np.unique(label, return_index=True, return_inverse=True)
    return np.asarray(least[index.ravel()])


def _labels(row: list[str]) -> Labels | None:
    """Return labels of faces, a new one wherever the name changes; None if there are none."""
    if not any(row):
        return None
    names, index = [], np.full(len(row), -1)
    for k, name in enumerate(row):
        if name and (k == 0 or name != row[k - 1]):
            names.append(name)
        if name:
            index[k] = len(names) - 1
    return Labels(tuple(names), index)


def _name(label: TDF_Label) -> str:
    found = TDataStd_Name()
    if label.IsNull() or not label.FindAttribute(TDataStd_Name.GetID_s(), found):
        return ""
    return str(found.Get().ToExtString()).strip()


def _code(colour: Quantity_Color) -> str:
    kind = Quantity_TypeOfColor.Quantity_TOC_sRGB
    red, green, blue = colour.Values(kind)
    return "#" + "".join(f"{round(255 * x):02x}" for x in (red, green, blue))
