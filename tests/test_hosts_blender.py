"""The Blender extension, without a window: it is built, installed, enabled and used.

It needs the package bpy, which holds Blender: in a new environment of Python 3.11 ``pip install bpy
pytest`` and ``pip install -e ".[workshop]"``, then ``pytest tests/test_hosts_blender.py``.
"""

from __future__ import annotations

import math
import os
import shlex
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
EXTENSION = ROOT / "hosts" / "blender" / "gso"
COMMAND = [
    sys.executable,
    "-c",
    f"import sys; sys.path.insert(0, {str(ROOT)!r}); from gso.cli import main; main()",
]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bpy(tmp_path_factory):
    """Blender, with the extension installed from its archive."""
    folder = tmp_path_factory.mktemp("blender")
    os.environ["BLENDER_USER_RESOURCES"] = str(folder)
    bpy = pytest.importorskip("bpy")
    os.environ["GSO_COMMAND"] = shlex.join(COMMAND)
    archive = built(bpy, folder)
    bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True
    )
    yield bpy
    os.environ.pop("GSO_COMMAND")


def built(bpy, folder):
    """The archive that Blender's own tool makes of the extension, after checking it."""
    scripts = Path(bpy.utils.system_resource("SCRIPTS"))
    tool = scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    archive = folder / "gso.zip"
    for words in (
        ["build", "--source-dir", EXTENSION, "--output-filepath", archive],
        ["validate", archive],
    ):
        done = subprocess.run([sys.executable, tool, *words], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    return archive


@pytest.fixture
def scene(bpy):
    """An empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    return bpy.context.scene


def add(bpy, vertices, faces, seams=(), name="design"):
    """Add an object and make it the active one."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    marked = {frozenset(edge) for edge in seams}
    for edge in mesh.edges:
        edge.use_seam = frozenset(edge.vertices) in marked
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def cube(bpy, size=2.0, seams=True):
    vertices = [tuple(p) for p in product([0.0, size], repeat=3)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    cross = [[0, 1], [2, 3], [4, 5], [6, 7], [1, 5], [5, 7], [3, 7]]
    return add(bpy, vertices, faces, cross if seams else (), "cube")


def half_cylinder(bpy, columns=33, radius=1.0, height=3.0):
    angle = np.linspace(0.0, math.pi, columns)
    ring = [(radius * math.cos(t), radius * math.sin(t)) for t in angle]
    levels = np.linspace(height, 0.0, 4).tolist()
    points = [(*p, z) for z in levels for p in ring]
    faces = [
        [i * columns + j, (i + 1) * columns + j, (i + 1) * columns + j + 1, i * columns + j + 1]
        for i in range(3)
        for j in range(columns - 1)
    ]
    return add(bpy, points, faces, name="vault")


def parts(bpy, collection):
    """Objects of parts in a collection."""
    return [o for o in bpy.data.collections[collection].objects if "surface" not in o.name]


def test_a_cube_with_marked_seams_unfolds_to_six_squares(bpy, scene):
    cube(bpy)
    assert bpy.ops.gso.unfold() == {"FINISHED"}
    (part,) = parts(bpy, "cube unfold")
    mesh = part.data
    assert [len(face.vertices) for face in mesh.polygons] == [4] * 6
    np.testing.assert_allclose([face.area for face in mesh.polygons], 4.0, rtol=1e-6)
    assert {round(v.co.z, 9) for v in mesh.vertices} == {0.0}
    # Five edges are inside the pattern: those that are not marked.
    assert len(mesh.edges) == 6 * 4 - 5
    original = mesh.attributes["gso_vertex"].data
    seams = {frozenset(e.vertices) for e in bpy.data.objects["cube"].data.edges if e.use_seam}
    ends = [frozenset(original[v].value for v in edge.vertices) for edge in mesh.edges]
    assert all((ends.count(edge) == 2) == (edge in seams) for edge in ends)


def test_world_scale_and_units(bpy, scene):
    scene.unit_settings.scale_length = 0.001
    obj = cube(bpy)
    obj.scale = (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    bpy.ops.gso.unfold()
    (part,) = parts(bpy, "cube unfold")
    np.testing.assert_allclose([face.area for face in part.data.polygons], 36.0, rtol=1e-5)


def test_flatten_a_half_cylinder(bpy, scene):
    half_cylinder(bpy)
    assert bpy.ops.gso.flatten() == {"FINISHED"}
    (part,) = parts(bpy, "vault flatten")
    width = 32 * 2 * math.sin(math.pi / 64)
    np.testing.assert_allclose(sorted(part.dimensions)[1:], [3.0, width], rtol=1e-4)


def test_pieces_of_a_cube(bpy, scene):
    cube(bpy, seams=False)
    assert bpy.ops.gso.pieces() == {"FINISHED"}
    (part,) = parts(bpy, "cube pieces")
    assert sum(face.area for face in part.data.polygons) == pytest.approx(24.0, rel=1e-5)
    surface = bpy.data.objects["cube surface"]
    assert {one.value for one in surface.data.attributes["gso_part"].data} == {0}


def test_strips_of_a_half_cylinder(bpy, scene):
    half_cylinder(bpy)
    assert bpy.ops.gso.strips() == {"FINISHED"}
    made = parts(bpy, "vault strips")
    area = sum(face.area for part in made for face in part.data.polygons)
    assert area == pytest.approx(3.0 * math.pi, rel=5e-3)


def test_drawings(bpy, scene, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    cube(bpy)
    for suffix in ("dxf", "pdf", "svg"):
        path = tmp_path / f"cube.{suffix}"
        assert bpy.ops.gso.export(filepath=str(path), method="unfold") == {"FINISHED"}
        assert path.stat().st_size > 500
    (outline,) = [
        line
        for line in ezdxf.readfile(tmp_path / "cube.dxf").modelspace().query("LWPOLYLINE")
        if line.closed
    ]
    points = np.array([p[:2] for p in outline.get_points()])
    # Fourteen sides of 2 m, in millimetres.
    long = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum()
    assert long == pytest.approx(14 * 2000.0)


def test_errors_are_reported(bpy, scene):
    # Operators that are called from Python raise what they report.
    cube(bpy, seams=False)
    with pytest.raises(RuntimeError, match="closed"):
        bpy.ops.gso.flatten()
    bpy.context.view_layer.objects.active = None
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.gso.unfold()


def test_a_missing_program_is_named(bpy, scene, monkeypatch):
    cube(bpy)
    monkeypatch.setenv("GSO_COMMAND", "no_such_gso")
    with pytest.raises(RuntimeError, match="no_such_gso is not found"):
        bpy.ops.gso.unfold()
