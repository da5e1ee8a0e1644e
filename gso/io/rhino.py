"""3DM (Rhino, openNURBS) through rhino3dm: meshes and surfaces read, surfaces written."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import rhino3dm

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.mesh import GivenSurface, GivenSurfaces, Mesh, topology
from gso.mesh.attributes import Attributes, Labels
from gso.mesh.welding import collapse, near
from gso.quantities import MILLIMETRES
from gso.spline import BSplineSurface, TrimmedSpline
from gso.typing import Array, Ints

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

#: Chord tolerance by default, and distance within which points are one, relative to the size.
_CHORD, _SAME = 1e-4, 1e-6
#: Largest number of divisions of a surface along one direction.
_MOST = 1024


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


def read(data: bytes, suffix: str, chord: float | None = None) -> Surface:
    """Read meshes and surfaces in a .3dm file, in millimetres.

    Trimmed faces have the triangles that Rhino saved with them (its render meshes): rhino3dm makes
    none. Whole surfaces are divided evenly. Names of objects are labels "o", names of layers "g".
    Where OpenCASCADE is installed, planes and developable surfaces are known by their equations.

    Parameters
    ----------
    data : bytes
    suffix : str
    chord : float, optional
        Largest distance between the faces of the mesh and a whole surface, in millimetres; 1e-4 of
        its size when not given.

    Raises
    ------
    MeshError
        The file is damaged, has no faces, or has a trimmed face without a render mesh.
    """
    model = rhino3dm.File3dm.FromByteArray(data)
    if model is None:
        raise MeshError("rhino3dm finds no .3dm file in it; is it cut off?")
    unit = str(model.Settings.ModelUnitSystem).rpartition(".")[2]
    known = {name: key for key, name in _UNITS.items()}
    if unit not in known:
        raise MeshError(f"its unit is {unit}; save it in millimetres")
    scale = MILLIMETRES[known[unit]]
    layers = {layer.Index: layer.FullPath for layer in model.Layers}
    bodies: list[_Body] = []
    left_out = 0
    for number, thing in enumerate(model.Objects):
        name = thing.Attributes.Name or f"object {number}"
        found = list(_pieces(thing.Geometry, name, None if chord is None else chord / scale))
        left_out += not found
        if found:
            bodies.append(_Body(name, layers.get(thing.Attributes.LayerIndex, ""), found))
    if not bodies:
        raise MeshError("it has no surfaces and no meshes; curves and points are not read")
    notes = (f"{left_out} objects without faces were left out",) if left_out else ()
    return _together(bodies, scale, notes)


class _Piece(NamedTuple):
    """Vertices and faces (m, 4) of a face, -1 in triangles; its surface and their parameters.

    The surface is None for meshes, and the parameters are unknown in render meshes.
    """

    points: Array
    faces: Ints
    surface: rhino3dm.NurbsSurface | None = None
    nodes: Array | None = None


class _Body(NamedTuple):
    """An object of the file with its name and that of its layer."""

    name: str
    layer: str
    pieces: list[_Piece]


def _together(bodies: Sequence[_Body], scale: float, notes: tuple[str, ...]) -> Surface:
    """Return the faces of all bodies, whose vertices are joined in each."""
    pieces = [piece for body in bodies for piece in body.pieces]
    surfaces, images = _equations(pieces, scale)
    tables = [piece.faces for piece in pieces]
    if surfaces:
        tables = [topology.triangulate(table, np.zeros(len(table), bool)) for table in tables]
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    points = scale * np.concatenate([piece.points for piece in pieces])
    faces = np.concatenate(
        [np.where(t < 0, -1, t + k) for t, k in zip(tables, starts, strict=False)]
    )
    target, first = np.arange(len(points)), 0
    for body in bodies:
        own = slice(starts[first], starts[first := first + len(body.pieces)])
        size = float(np.linalg.norm(np.ptp(points[own], axis=0)))
        target[own] = target[own][near(points[own], _SAME * size, np.arange(own.stop - own.start))]
    done = collapse(faces, target)
    piece_of = np.repeat(np.arange(len(pieces)), [len(table) for table in tables])[done.kept]
    body_of = np.repeat(np.arange(len(bodies)), [len(body.pieces) for body in bodies])[piece_of]
    used, corners = np.unique(done.faces, return_inverse=True)
    compact = corners.reshape(done.faces.shape)
    if used[0] < 0:
        used, compact = used[1:], compact - 1
    rows = ("o", [body.name for body in bodies]), ("g", [body.layer for body in bodies])
    known = None
    if surfaces:
        # A triangle that is kept has its corners in the same order.
        image = np.concatenate(images)[faces[done.kept]]
        known = GivenSurfaces(surfaces, piece_of, image[..., :2], image[..., 2:])
    labels = {kind: Labels(tuple(row), body_of) for kind, row in rows}
    if (compact[:, 3:] < 0).all():
        compact = compact[:, :3]
    return Surface(points[used], compact, notes, Attributes(labels=labels, surfaces=known))


def _equations(
    pieces: Sequence[_Piece], scale: float
) -> tuple[tuple[GivenSurface, ...], list[Array]]:
    """Return the surfaces of faces, and their images (n, 5); none if none can be unrolled."""
    try:
        from gso.io.rhino_surfaces import surface_of_face
    except ImportError:
        # Without OpenCASCADE surfaces are found in the triangles.
        return (), []
    surfaces, images = [], []
    for number, piece in enumerate(pieces):
        known, image = GivenSurface(f"face {number}", "surface"), None
        if piece.surface is not None:
            points = scale * piece.points
            known, image = surface_of_face(piece.surface, number, points, piece.nodes, scale)
        surfaces.append(known)
        images.append(np.full((len(piece.points), 5), np.nan) if image is None else image)
    unrolled = any(surface.rulings is not None for surface in surfaces)
    return (tuple(surfaces), images) if unrolled else ((), [])


def _pieces(thing: rhino3dm.GeometryBase, name: str, chord: float | None) -> Iterator[_Piece]:
    """Yield the faces of an object."""
    if isinstance(thing, rhino3dm.Mesh):
        yield _Piece(*_of_mesh(thing))
    elif isinstance(thing, rhino3dm.Extrusion):
        mesh = thing.GetMesh(rhino3dm.MeshType.Any)
        if mesh is not None:
            yield _Piece(*_of_mesh(mesh))
        else:
            yield from _pieces(thing.ToBrep(True), name, chord)
    elif isinstance(thing, rhino3dm.Brep):
        whole = len(thing.Faces) == 1 and thing.IsSurface
        for k in range(len(thing.Faces)):
            face = thing.Faces[k]
            mesh = face.GetMesh(rhino3dm.MeshType.Any)
            surface = face.UnderlyingSurface().ToNurbsSurface()
            if mesh is not None and len(mesh.Faces):
                yield _Piece(*_of_mesh(mesh), surface)
            elif whole:
                yield _of_surface(surface, chord)
            else:
                raise MeshError(
                    f"face {k} of {name} is trimmed and has no render mesh; in Rhino, shade the "
                    "model before saving it and do not save it small, or export it as STEP"
                )
    elif isinstance(thing, rhino3dm.Surface):
        yield _of_surface(thing.ToNurbsSurface(), chord)


def _of_mesh(mesh: rhino3dm.Mesh) -> tuple[Array, Ints]:
    count = len(mesh.Vertices)
    points = [mesh.Vertices.Point3dAt(k) for k in range(count)]
    faces = np.array([mesh.Faces[k] for k in range(len(mesh.Faces))], np.int64).reshape(-1, 4)
    faces[faces[:, 2] == faces[:, 3], 3] = -1
    return np.array([[p.X, p.Y, p.Z] for p in points]).reshape(-1, 3), faces


def _of_surface(surface: rhino3dm.NurbsSurface, chord: float | None) -> _Piece:
    """Divide a whole surface evenly in both directions, within a chord tolerance."""
    divisions = [1, 1]
    grid = _grid(surface, divisions)
    size = float(np.linalg.norm(np.ptp(grid.reshape(-1, 3), axis=0)))
    divisions = [max(1, 2 * int(surface.SpanCount(k))) for k in (0, 1)]
    grid = _grid(surface, divisions)
    size = max(size, float(np.linalg.norm(np.ptp(grid.reshape(-1, 3), axis=0))))
    allowed = _CHORD * size if chord is None else chord
    for k in (0, 1):
        while divisions[k] < _MOST:
            finer = list(divisions)
            finer[k] *= 2
            fine = np.moveaxis(_grid(surface, finer), k, 0)
            off = np.linalg.norm(fine[1::2] - 0.5 * (fine[:-1:2] + fine[2::2]), axis=-1)
            if off.max() <= allowed:
                break
            divisions = finer
    grid = _grid(surface, divisions)
    nodes = np.stack(np.meshgrid(*_parameters(surface, divisions), indexing="ij"), axis=-1)
    faces = topology.grid_faces(*grid.shape[:2])
    return _Piece(grid.reshape(-1, 3), faces, surface, nodes.reshape(-1, 2))


def _parameters(surface: rhino3dm.NurbsSurface, divisions: Sequence[int]) -> list[Array]:
    domains = [surface.Domain(k) for k in (0, 1)]
    return [np.linspace(d.T0, d.T1, n + 1) for d, n in zip(domains, divisions, strict=True)]


def _grid(surface: rhino3dm.NurbsSurface, divisions: Sequence[int]) -> Array:
    rows = _parameters(surface, divisions)
    places = [[surface.PointAt(u, v) for v in rows[1].tolist()] for u in rows[0].tolist()]
    return np.array([[[p.X, p.Y, p.Z] for p in row] for row in places])
