"""Flat patterns of meshes and polysurfaces in Rhino 8: run it in the script editor (Python 3).

Unwelded edges of a mesh are its seams, unless all are unwelded. Patterns are curves on layers,
beside the object.
"""

import os
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from gso_client import Client, GsoError, lines_of, why_not

#: Units of gso by those of Rhino.
UNITS = {
    "Microns": "um",
    "Millimeters": "mm",
    "Centimeters": "cm",
    "Decimeters": "dm",
    "Meters": "m",
    "Inches": "in",
    "Feet": "ft",
    "Yards": "yd",
}
METHODS = ("pieces", "unfold", "strips", "flatten")
#: Colours of the layers, red, green and blue.
LAYERS = {
    "cut": (0, 0, 0),
    "mountain": (220, 40, 40),
    "valley": (40, 80, 220),
    "crease": (120, 120, 120),
}


def mesh_params(mesh):
    """Return a Rhino mesh as a mesh of the protocol, with its unwelded edges as seams.

    Without a welded edge there are no seams: such a mesh has copies of its vertices for each face.
    """
    points, edges = mesh.TopologyVertices, mesh.TopologyEdges
    inner = [k for k in range(edges.Count) if len(edges.GetConnectedFaces(k)) == 2]
    unwelded = [k for k in inner if edges.IsEdgeUnwelded(k)]
    pairs = [edges.GetTopologyVertices(k) for k in unwelded] if len(unwelded) < len(inner) else []
    faces = []
    for k in range(mesh.Faces.Count):
        face = list(points.IndicesFromFace(k))
        faces.append(face[:3] if len(face) == 4 and face[2] == face[3] else face)
    # Topology vertices are in single precision.
    own = [mesh.Vertices.Point3dAt(points.MeshVertexIndices(k)[0]) for k in range(points.Count)]
    return {
        "vertices": [[point.X, point.Y, point.Z] for point in own],
        "faces": faces,
        "seams": [[pair.I, pair.J] for pair in pairs],
    }


def brep_file(brep, folder):
    """Write a polysurface to a file, which gso reads with its exact faces."""
    import Rhino

    file = Rhino.FileIO.File3dm()
    # gso reads millimetres: the numbers stay those of the document.
    file.Settings.ModelUnitSystem = Rhino.UnitSystem.Millimeters
    file.Objects.AddBrep(brep)
    path = os.path.join(folder, "design.3dm")
    if not file.Write(path, 8):
        raise GsoError("{} cannot be written".format(path))
    return path


def surface_of(geometry, folder):
    """Return an object as parameter of a request; files are written to a folder."""
    import Rhino

    if isinstance(geometry, Rhino.Geometry.Mesh):
        return mesh_params(geometry)
    brep = geometry if isinstance(geometry, Rhino.Geometry.Brep) else geometry.ToBrep()
    return brep_file(brep, folder)


def add_parts(document, result, corner):
    """Add the parts of a result as curves to a document, the lower left corner at a point."""
    import Rhino
    import System

    layers = {}
    for kind, colour in LAYERS.items():
        name = "gso " + kind
        index = document.Layers.FindByFullPath(name, -1)
        if index < 0:
            index = document.Layers.Add(name, System.Drawing.Color.FromArgb(*colour))
        layers[kind] = index
    for part in result["parts"]:
        group = document.Groups.Add()
        for kind, points, closed in lines_of(part):
            ring = [*points, points[0]] if closed else points
            curve = Rhino.Geometry.PolylineCurve(
                [Rhino.Geometry.Point3d(corner.X + x, corner.Y + y, corner.Z) for x, y in ring]
            )
            attributes = Rhino.DocObjects.ObjectAttributes()
            attributes.LayerIndex = layers[kind]
            attributes.Name = part["name"]
            attributes.AddToGroup(group)
            document.Objects.AddCurve(curve, attributes)
    document.Views.Redraw()


def main():
    """Ask for an object and a method, and add its flat pattern."""
    import Rhino
    import rhinoscriptsyntax as rs
    import scriptcontext

    document = scriptcontext.doc
    id = rs.GetObject(
        "Mesh or polysurface to lay flat",
        rs.filter.mesh | rs.filter.polysurface | rs.filter.surface | rs.filter.extrusion,
        preselect=True,
    )
    if id is None:
        return
    method = rs.GetString("Method", METHODS[0], list(METHODS))
    if method is None:
        return
    unit = UNITS.get(str(document.ModelUnitSystem))
    if unit is None:
        print("gso: the unit {} is unknown; take millimetres".format(document.ModelUnitSystem))
        return
    geometry = rs.coercegeometry(id)
    box = geometry.GetBoundingBox(True)
    corner = Rhino.Geometry.Point3d(box.Max.X + 0.1 * box.Diagonal.Length, box.Min.Y, 0)

    def progress(share, text):
        Rhino.RhinoApp.SetCommandPrompt("gso: " + text)
        Rhino.RhinoApp.Wait()

    try:
        with Client() as gso, tempfile.TemporaryDirectory(prefix="gso-") as folder:
            surface = surface_of(geometry, folder)
            result = gso.call(method, progress, mesh=surface, unit=unit)
    except GsoError as error:
        print("gso: {}".format(error))
        return
    for text in [*why_not(result), *result["notes"]]:
        print("gso: {}".format(text))
    if "parts" in result:
        add_parts(document, result, corner)
        print("gso: {} parts".format(len(result["parts"])))


if __name__ == "__main__":
    main()
