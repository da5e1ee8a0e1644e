"""Hosts: the client of ``gso serve --stdio``, and what runs in Rhino."""

from __future__ import annotations

import ast
import importlib.util
import math
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[1]
HOSTS = ROOT / "hosts"
#: Starts gso of this folder, whatever the environment of the host.
COMMAND = [
    sys.executable,
    "-c",
    f"import sys; sys.path.insert(0, {str(ROOT)!r}); from gso.cli import main; main()",
]
CUBE = {
    "vertices": [list(p) for p in product([0.0, 100.0], repeat=3)],
    "faces": [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
}
#: Programs whose Python is 3.9.
OLD = [
    HOSTS / "gso_client.py",
    HOSTS / "rhino" / "gso_rhino.py",
    HOSTS / "freecad" / "gso_freecad.py",
]


def module(path):
    """The module of a file that is in no package."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


client = module(HOSTS / "gso_client.py")


@pytest.fixture(scope="module")
def gso_client():
    with client.Client(COMMAND) as running:
        yield running


def test_copies_of_the_client_are_equal():
    copier = module(HOSTS / "copy_client.py")
    assert len(copier.COPIES) == 3
    for copy in copier.COPIES:
        assert copy.read_bytes() == copier.CLIENT.read_bytes(), "run hosts/copy_client.py"


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_syntax_of_python_3_9(path):
    tree = ast.parse(path.read_text(), feature_version=(3, 9))
    # What annotations may be has no syntax of its own.
    assert not any(isinstance(node, ast.Match) for node in ast.walk(tree))


def test_the_client_needs_no_packages():
    tree = ast.parse(OLD[0].read_text())
    found = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    assert found <= sys.stdlib_module_names


def test_python_3_9_runs_the_client(tmp_path):
    old = shutil.which("python3.9")
    if old is None or subprocess.run([old, "--version"], capture_output=True).returncode:
        pytest.skip("there is no Python 3.9")
    code = (
        f"import sys; sys.path.insert(0, {str(HOSTS)!r})\n"
        "from gso_client import Client\n"
        f"with Client({COMMAND!r}) as gso:\n"
        f"    print(gso.call('unfold', mesh={CUBE!r})['metrics']['parts'])\n"
    )
    done = subprocess.run([old, "-c", code], capture_output=True, text=True)
    assert done.stdout == "1\n", done.stderr


def test_results(gso_client):
    found = gso_client.call("unfold", mesh=CUBE, unit="cm", output=None)
    lines = client.lines_of(found["parts"][0])
    assert [kind for kind, _, _ in lines] == ["cut", *["mountain"] * 5]
    assert client.why_not(found) == []


def test_points_on_straight_lines_are_left_out():
    square = [[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1.5, 2], [0, 2], [0, 0.5]]
    assert client.corners_of(square) == [[0, 0], [2, 0], [2, 2], [0, 2]]
    assert client.corners_of(square[1:] + square[:1]) == [[2, 0], [2, 2], [0, 2], [0, 0]]
    triangle = [[0, 0], [1, 0], [0, 1]]
    assert client.corners_of(triangle) == triangle
    turn = [k * math.pi / 50 for k in range(100)]
    circle = [[math.cos(t), math.sin(t)] for t in turn]
    assert client.corners_of(circle) == circle


def test_errors_name_what_to_do(gso_client):
    with pytest.raises(client.GsoError, match="did you mean 'unfold'") as caught:
        gso_client.call("unfodl", mesh=CUBE)
    assert caught.value.kind == "OptionError"
    # The server goes on.
    assert gso_client.call("info", mesh=CUBE)["kind"] == "quads"


def test_progress_that_returns_false_cancels(gso_client):
    seen = []

    def progress(share, text):
        seen.append(text)
        return False

    panel = str(ROOT / "examples" / "panel.obj")
    with pytest.raises(client.GsoError) as caught:
        gso_client.call("strips", progress, mesh=panel, max_deviation="1%")
    assert caught.value.kind == "Cancelled"
    assert seen
    assert gso_client.call("info", mesh=CUBE)["kind"] == "quads"


def test_a_program_that_is_missing():
    with pytest.raises(client.GsoError, match=r"no_such_gso is not found; .*GSO_COMMAND"):
        client.Client("no_such_gso")


def test_a_server_that_ends_says_why():
    command = [sys.executable, "-c", "import sys; sys.exit('no module named gso')"]
    with client.Client(command) as ended, pytest.raises(client.GsoError, match="no module named"):
        ended.call("info", mesh=CUBE)


def test_commands_may_have_spaces_and_arguments(tmp_path, monkeypatch):
    program = tmp_path / "a folder" / "gso"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert client.command_of(str(program)) == [str(program)]
    monkeypatch.setenv("GSO_COMMAND", f"'{program}' --flag")
    assert client.command_of() == [str(program), "--flag"]


class RhinoMesh:
    """A cube as Rhino has it: vertices, and the topology on them."""

    def __init__(self, welded):
        faces = CUBE["faces"]
        sides = [frozenset(e) for f in faces for e in zip(f, f[1:] + f[:1], strict=True)]
        edges = [sorted(edge) for edge in dict.fromkeys(sides)]
        points = [SimpleNamespace(X=x, Y=y, Z=z) for x, y, z in CUBE["vertices"]]
        self.Faces = SimpleNamespace(Count=len(faces))
        # Rhino has a copy of a vertex for each face at it.
        self.Vertices = SimpleNamespace(Point3dAt=lambda k: points[k // 3])
        self.TopologyVertices = SimpleNamespace(
            Count=len(points),
            MeshVertexIndices=lambda k: [3 * k, 3 * k + 1, 3 * k + 2],
            IndicesFromFace=lambda k: faces[k],
        )
        self.TopologyEdges = SimpleNamespace(
            Count=len(edges),
            GetConnectedFaces=lambda k: [0, 1],
            IsEdgeUnwelded=lambda k: k >= welded,
            GetTopologyVertices=lambda k: SimpleNamespace(I=edges[k][0], J=edges[k][1]),
        )


@pytest.mark.parametrize(("welded", "seams", "parts"), [(0, 0, 1), (1, 11, 5), (12, 0, 1)])
def test_meshes_of_rhino(gso_client, welded, seams, parts):
    rhino = module(HOSTS / "rhino" / "gso_rhino.py")
    params = rhino.mesh_params(RhinoMesh(welded))
    assert params["vertices"] == CUBE["vertices"]
    assert params["faces"] == CUBE["faces"]
    assert len(params["seams"]) == seams
    assert gso_client.call("unfold", mesh=params)["metrics"]["parts"] == parts
