"""A bent bracket and a mitred duct as STEP files, in millimetres (needs the extra ``cad``).

Both are formulas of our own. The bracket is a solid, 2 mm thick, with a bend of 90 degrees and a
hole in each flange. The duct is a quarter turn of three pieces of pipe, without thickness.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
)
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeHalfSpace,
    BRepPrimAPI_MakePrism,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.gp import gp_Ax2, gp_Dir, gp_Pln, gp_Pnt, gp_Vec
from OCP.Message import Message
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

#: Outer lengths of the bracket's flanges, its width, thickness, inner radius and holes.
FLANGES, WIDTH, THICK, INNER, HOLE = (60.0, 40.0), 50.0, 2.0, 3.0, 8.0
#: Radius of the duct, that of its turn, and the straight lengths at both ends.
PIPE, TURN, STRAIGHT = 60.0, 150.0, 80.0
#: Directions of the three pieces of pipe, and of the mitres between them, in degrees.
PIECES, MITRES = (0.0, 45.0, 90.0), (22.5, 67.5)


def bracket() -> Any:
    """Return the bracket: its section in the plane y = 0, extruded, less two holes."""
    one, two = (length - INNER - THICK for length in FLANGES)
    centre = np.array([one, INNER + THICK])
    turn = np.radians([0.0, 45.0, 90.0])
    around = np.stack([np.sin(turn), -np.cos(turn)], axis=1)
    outer, inner = centre + (INNER + THICK) * around, centre + INNER * around
    up = np.array([0.0, two])
    wire = BRepBuilderAPI_MakeWire()
    for points in (
        [(0.0, 0.0), outer[0]],
        outer,
        [outer[2], outer[2] + up],
        [outer[2] + up, inner[2] + up],
        [inner[2] + up, inner[2]],
        inner[::-1],
        [inner[0], (0.0, THICK)],
        [(0.0, THICK), (0.0, 0.0)],
    ):
        ends = [gp_Pnt(float(x), 0.0, float(z)) for x, z in points]
        curve = ends if len(ends) == 2 else [GC_MakeArcOfCircle(*ends).Value()]
        wire.Add(BRepBuilderAPI_MakeEdge(*curve).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    solid = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, WIDTH, 0.0)).Shape()
    far = FLANGES[0] + 10.0
    middle = INNER + THICK + 0.5 * two
    for point, direction in (
        (gp_Pnt(0.5 * one, 0.5 * WIDTH, -10.0), gp_Dir(0, 0, 1)),
        (gp_Pnt(far, 0.5 * WIDTH, middle), gp_Dir(-1, 0, 0)),
    ):
        tool = BRepPrimAPI_MakeCylinder(gp_Ax2(point, direction), 0.5 * HOLE, 20.0).Shape()
        solid = BRepAlgoAPI_Cut(solid, tool).Shape()
    return solid


def duct() -> Any:
    """Return the round faces of three pipes that meet at mitres; the turn is about the y axis."""
    sewing = BRepBuilderAPI_Sewing(1e-6)
    for k, degrees in enumerate(PIECES):
        turn = np.radians(degrees)
        out, along = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        # The ends of the duct are square; between them pipes go beyond the mitres.
        lengths = [STRAIGHT if k == 0 else TURN, STRAIGHT if k == len(MITRES) else TURN]
        x, z = TURN * out - lengths[0] * along
        place = gp_Ax2(gp_Pnt(x, 0, z), gp_Dir(along[0], 0, along[1]))
        pipe = BRepPrimAPI_MakeCylinder(place, PIPE, sum(lengths)).Shape()
        for mitre in MITRES[max(k - 1, 0) : k + 1]:
            a, side = np.radians(mitre), np.sign(mitre - degrees)
            normal = side * np.array([-np.sin(a), np.cos(a)])
            plane = gp_Pln(gp_Pnt(0, 0, 0), gp_Dir(normal[0], 0, normal[1]))
            beyond = gp_Pnt(*(1e4 * np.array([normal[0], 0.0, normal[1]])))
            half = BRepPrimAPI_MakeHalfSpace(BRepBuilderAPI_MakeFace(plane).Face(), beyond)
            pipe = BRepAlgoAPI_Cut(pipe, half.Solid()).Shape()
        found = TopExp_Explorer(pipe, TopAbs_ShapeEnum.TopAbs_FACE)
        while found.More():
            face = TopoDS.Face(found.Current())
            found.Next()
            if not is_flat(face):
                sewing.Add(face)
    sewing.Perform()
    return sewing.SewedShape()


def is_flat(face: Any) -> bool:
    """Return whether a face is plane."""
    return BRepAdaptor_Surface(face).GetType() == GeomAbs_SurfaceType.GeomAbs_Plane


def write(shape: Any, path: Path) -> None:
    """Write a shape as STEP."""
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer.Write(str(path))


def main() -> None:
    """Write ``bracket.step`` and ``duct.step``."""
    command = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    default = Path(__file__).resolve().parent / "out"
    command.add_argument("-o", "--out", type=Path, default=default, help="folder")
    folder = command.parse_args().out
    write(bracket(), folder / "bracket.step")
    write(duct(), folder / "duct.step")


if __name__ == "__main__":
    main()
