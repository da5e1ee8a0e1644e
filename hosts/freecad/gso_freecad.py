"""Flat patterns of faces and solids in FreeCAD, as sketches.

Select faces or objects and run the macro ``gso_flat_pattern.FCMacro``. Each object goes as a STEP
file to gso, which unrolls planes, cylinders and cones exactly, and takes the thickness of solids of
sheet metal into account.
"""

import os
import tempfile

import FreeCAD
import Part
import Sketcher
from gso_client import Client, GsoError, lines_of, why_not

#: Segments up to which the ends of an outline are joined by constraints.
JOINED = 200


def selected():
    """Return what is selected: (label, shape); some faces of an object are one shape."""
    import FreeCADGui

    out = []
    for one in FreeCADGui.Selection.getSelectionEx():
        faces = [shape for shape in one.SubObjects if shape.ShapeType == "Face"]
        if faces:
            out.append((one.Object.Label, joined(faces)))
        elif hasattr(one.Object, "Shape"):
            out.append((one.Object.Label, one.Object.Shape))
    return out


def joined(faces):
    """Return faces as one shape."""
    return faces[0] if len(faces) == 1 else Part.makeCompound(faces)


def flat_patterns(document, shapes, client, progress=None, **params):
    """Add the flat patterns of shapes to a document.

    Parameters
    ----------
    document : Document
    shapes : list of (str, Shape)
        Labels and shapes.
    client : Client
    progress : callable, optional
        See :meth:`Client.call`.
    **params
        Parameters of the method "fabricate", such as ``max_deviation="1mm"``.

    Returns
    -------
    groups : list of DocumentObjectGroup
        One for each shape, with a sketch for each part. Lines to bend along are construction lines.
    texts : list of str
        Reasons against the parts, and notes.
    """
    groups, texts = [], []
    finish = {"notches": None, "labels": None, **params.pop("finish", {})}
    params = {"formats": ["svg"], "finish": finish, **params}
    with tempfile.TemporaryDirectory(prefix="gso-") as folder:
        for label, shape in shapes:
            path = os.path.join(folder, "part.step")
            shape.exportStep(path)
            result = client.call("fabricate", progress, mesh=path, **params)
            texts += [label + ": " + text for text in [*why_not(result), *result["notes"]]]
            groups.append(add_group(document, label, shape, result["parts"]))
    document.recompute()
    return groups, texts


def add_group(document, label, shape, parts):
    """Add the parts of a shape as sketches, beside it in the plane z = 0."""
    group = document.addObject("App::DocumentObjectGroup", "FlatPattern")
    group.Label = "Flat pattern of " + label
    box = shape.BoundBox
    x, gap = box.XMax + 0.1 * box.DiagonalLength, 0.1 * box.DiagonalLength
    for part in parts:
        sketch = add_sketch(document, part)
        sketch.Placement = FreeCAD.Placement(FreeCAD.Vector(x, box.YMin, 0.0), FreeCAD.Rotation())
        group.addObject(sketch)
        x += part["size"][0] + gap
    return group


def add_sketch(document, part):
    """Add a part as a sketch."""
    sketch = document.addObject("Sketcher::SketchObject", "Part")
    count = "" if part["count"] == 1 else " ({} times)".format(part["count"])
    sketch.Label = part["name"] + count
    for kind, points, closed in lines_of(part):
        ends = [FreeCAD.Vector(x, y, 0.0) for x, y in points]
        if closed:
            ends.append(ends[0])
        lines = [Part.LineSegment(a, b) for a, b in zip(ends, ends[1:])]  # noqa: RUF007
        numbers = sketch.addGeometry(lines, kind != "cut")
        if closed and len(numbers) <= JOINED:
            following = [*numbers[1:], numbers[0]]
            sketch.addConstraint(
                [
                    Sketcher.Constraint("Coincident", one, 2, other, 1)
                    for one, other in zip(numbers, following)
                ]
            )
    return sketch


def main():
    """Add the flat patterns of what is selected to the document."""
    shapes = selected()
    if not shapes:
        FreeCAD.Console.PrintError("gso: select faces or solids\n")
        return

    def progress(share, text):
        FreeCAD.Console.PrintMessage("gso: " + text + "\n")

    document = FreeCAD.ActiveDocument
    document.openTransaction("Flat pattern")
    try:
        with Client() as client:
            _, texts = flat_patterns(document, shapes, client, progress)
    except GsoError as error:
        document.abortTransaction()
        FreeCAD.Console.PrintError("gso: {}\n".format(error))
        return
    document.commitTransaction()
    for text in texts:
        FreeCAD.Console.PrintWarning("gso: " + text + "\n")
