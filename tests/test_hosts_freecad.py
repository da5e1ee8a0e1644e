"""The FreeCAD macro, run by FreeCAD without a window (Debian: ``apt-get install freecad``)."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("OCP")
ROOT = Path(__file__).resolve().parents[1]
MACRO = ROOT / "hosts" / "freecad"
PROGRAM = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
COMMAND = [
    sys.executable,
    "-c",
    f"import sys; sys.path.insert(0, {str(ROOT)!r}); from gso.cli import main; main()",
]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="FreeCAD is not installed"),
]
#: Run by FreeCAD: shapes, their patterns, and what is in the sketches.
SCRIPT = """
import json, os, sys
sys.path.insert(0, {folder!r})
import FreeCAD, Part
from FreeCAD import Vector
import gso_freecad
from gso_client import Client, GsoError

def angle(t, radius, length, width):
    '''A bracket of sheet metal: two flanges and a bend of 90 degrees about y.'''
    inner, outer = radius, radius + t
    flat = Part.makeBox(length, width, t, Vector(-length, 0, -outer))
    up = Part.makeBox(t, width, length, Vector(radius, 0, 0))
    ring = Part.makeCylinder(outer, width, Vector(0, 0, 0), Vector(0, 1, 0))
    ring = ring.cut(Part.makeCylinder(inner, width, Vector(0, 0, 0), Vector(0, 1, 0)))
    quarter = Part.makeBox(outer, width, outer, Vector(0, 0, -outer))
    return flat.fuse(up).fuse(ring.common(quarter)).removeSplitter()

half = Part.makeCylinder(50, 80, Vector(0, 0, 0), Vector(0, 0, 1), 180)
curved = [f for f in half.Faces if isinstance(f.Surface, Part.Cylinder)]
box = Part.makeBox(30, 40, 50)
shapes = [
    ("half cylinder", gso_freecad.joined(curved)),
    ("box", box),
    ("two faces", gso_freecad.joined([box.Faces[0], box.Faces[2]])),
    ("bracket", angle(2.0, 3.0, 40.0, 60.0)),
]
document = FreeCAD.newDocument()
out = {{}}
with Client() as client:
    for shape in shapes:
        (group,), texts = gso_freecad.flat_patterns(document, [shape], client, workers=0)
        sketches = []
        for sketch in group.Group:
            wires = sketch.Shape.Wires
            face = Part.Face(wires)
            construction = [g for k, g in enumerate(sketch.Geometry) if sketch.getConstruction(k)]
            box = sketch.Shape.BoundBox
            sketches.append({{
                "size": sorted([box.XLength, box.YLength]), "area": face.Area,
                "closed": all(w.isClosed() for w in wires), "bends": len(construction),
                "edges": len(sketch.Geometry) - len(construction), "label": sketch.Label,
            }})
        out[shape[0]] = {{"sketches": sketches, "texts": texts, "label": group.Label}}
    try:
        gso_freecad.flat_patterns(document, shapes[:1], client, max_deviatoin="1mm")
    except GsoError as error:
        out["error"] = str(error)
json.dump(out, open({result!r}, "w"))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("freecad")
    script, result = folder / "script.py", folder / "result.json"
    script.write_text(SCRIPT.format(folder=str(MACRO), result=str(result)))
    # FreeCAD has a Python of its own.
    away = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")
    env = {k: v for k, v in os.environ.items() if k not in away}
    env |= {"GSO_COMMAND": shlex.join(COMMAND), "HOME": str(folder), "PATH": os.defpath}
    done = subprocess.run(
        [PROGRAM, script], env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    assert result.exists(), done.stdout + done.stderr
    return json.loads(result.read_text())


def test_half_cylinder(found):
    (sketch,) = found["half cylinder"]["sketches"]
    assert sketch["size"] == pytest.approx([80.0, 50.0 * math.pi], rel=1e-6)
    assert sketch["area"] == pytest.approx(80.0 * 50.0 * math.pi, rel=1e-6)
    assert sketch["edges"] == 4 and sketch["closed"]
    assert sketch["bends"] > 5


def test_box(found):
    (sketch,) = found["box"]["sketches"]
    assert sketch["area"] == pytest.approx(2 * (30 * 40 + 40 * 50 + 30 * 50))
    assert sketch["bends"] == 5 and sketch["closed"]


def test_some_faces_of_a_solid(found):
    sketches = found["two faces"]["sketches"]
    assert sum(one["area"] for one in sketches) == pytest.approx(40 * 50 + 30 * 50)
    assert len(sketches) == 1 and sketches[0]["bends"] == 1


def test_sheet_metal(found):
    """The bend is as long as the neutral surface, half-way through the sheet."""
    (sketch,) = found["bracket"]["sketches"]
    long = 40 + 40 + 0.5 * math.pi * (3.0 + 0.5 * 2.0)
    assert sketch["size"] == pytest.approx([60.0, long], rel=1e-4)


def test_errors(found):
    assert "did you mean 'max_deviation'" in found["error"]
