"""``gso serve --stdio``: requests and answers as lines of JSON."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import gso
from gso.serving import PROTOCOL, Server

ROOT = Path(__file__).resolve().parents[1]
CUBE = {
    "vertices": [list(p) for p in product([0.0, 100.0], repeat=3)],
    "faces": [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
}
#: Edges that leave a cross of six squares: the upright ones, and three of the four at the top.
CROSS = [[0, 1], [2, 3], [4, 5], [6, 7], [1, 5], [5, 7], [3, 7]]


def half_cylinder(columns=25, radius=50.0, height=80.0):
    """A half cylinder of quads."""
    angle = np.linspace(0.0, math.pi, columns)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    rows = [np.pad(ring, ((0, 0), (0, 1)), constant_values=z) for z in np.linspace(height, 0, 5)]
    mesh = gso.Mesh.from_grid(np.array(rows))
    return {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()}


def answers(*lines):
    """What the server says to some lines: answers by id, and the progress lines."""
    said = []
    Server(lambda line: said.append(json.loads(line))).run(
        line if isinstance(line, str | bytes) else json.dumps(line) for line in lines
    )
    progress = [one for one in said if "progress" in one]
    return {one["id"]: one for one in said if "progress" not in one}, progress


def ask(method, **params):
    """The answer to one request."""
    found, _ = answers({"id": 1, "method": method, "params": params})
    return found[1]


def result(method, **params):
    answer = ask(method, **params)
    assert "error" not in answer, answer
    return answer["result"]


def message(method, **params):
    """The message of an error."""
    return ask(method, **params)["error"]["message"]


def area(polygon):
    x, y = np.asarray(polygon).T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


class TestUnfold:
    def test_marked_edges_are_cut_and_the_others_folded(self):
        found = result("unfold", mesh=CUBE | {"seams": CROSS})
        assert found["metrics"]["parts"] == 1
        flat = found["flat"]
        pairs = zip(flat["faces"], CUBE["faces"], strict=True)
        for face, given in pairs:
            assert [flat["vertex"][corner] for corner in face] == given
            corners = np.array(flat["vertices"])[face]
            assert area(corners) == pytest.approx(1e4)
            sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
            np.testing.assert_allclose(sides, 100.0)
        uses = {}
        for face in flat["faces"]:
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                uses.setdefault(frozenset((a, b)), []).append((a, b))
        joined = {
            frozenset(flat["vertex"][v] for v in edge) for edge, n in uses.items() if len(n) == 2
        }
        assert len(joined) == 5
        assert not joined & {frozenset(edge) for edge in CROSS}

    def test_polygons_with_many_corners(self):
        turn = 2 * math.pi * np.arange(6) / 6
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        points = [[*p, z] for z in (0.0, 1.0) for p in ring.tolist()]
        sides = [[k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6] for k in range(6)]
        faces = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides]
        found = result("unfold", mesh={"vertices": points, "faces": faces})
        assert [len(face) for face in found["flat"]["faces"]] == [6, 6, *[4] * 6]
        (part,) = found["parts"]
        assert part["area"] == pytest.approx(6 + 2 * 1.5 * math.sqrt(3))
        assert area(part["outline"]) == pytest.approx(part["area"])

    def test_bends_and_their_angles(self):
        (part,) = result("unfold", mesh=CUBE, unit="cm")["parts"]
        assert [round(bend["angle"], 9) for bend in part["bends"]] == [90.0] * 5
        assert {round(math.dist(*bend["line"]), 9) for bend in part["bends"]} == {100.0}
        assert sorted(part["size"])[-1] <= 500.0 + 1e-9

    def test_drawings_are_written(self, tmp_path):
        pytest.importorskip("ezdxf")
        paths = [str(tmp_path / f"net.{suffix}") for suffix in ("dxf", "svg")]
        assert result("unfold", mesh=CUBE, output=paths)["files"] == paths
        assert all(Path(path).stat().st_size > 1000 for path in paths)

    def test_parts_have_the_numbers_of_the_faces(self):
        mesh = CUBE | {"seams": [[a, b] for a, b in [(0, 1), (1, 3), (3, 2), (2, 0)]]}
        found = result("unfold", mesh=mesh)
        assert sorted(found["flat"]["part"]) == [0] * 5 + [1]
        assert [round(part["area"]) for part in found["parts"]] == [50_000, 10_000]

    def test_merged_vertices(self):
        corners = [v for face in CUBE["faces"] for v in face]
        apart = {
            "vertices": [CUBE["vertices"][v] for v in corners],
            "faces": np.arange(24).reshape(6, 4).tolist(),
        }
        assert result("unfold", mesh=apart, weld=1e-6)["metrics"]["parts"] == 1
        # Seams are named by the vertices that are sent, here those of the face at z = 1.
        rim = [[20, 21], [21, 22], [22, 23], [23, 20]]
        found = result("unfold", mesh=apart | {"seams": rim}, weld=1e-6)
        assert [round(part["area"]) for part in found["parts"]] == [50_000, 10_000]

    def test_faces_have_the_numbers_of_the_given_ones(self):
        # The first two sides as triangles, which are one face of the net.
        split = [[0, 1, 3], [0, 3, 2], *CUBE["faces"][1:]]
        flat = result("unfold", mesh=CUBE | {"faces": split})["flat"]
        assert flat["face"] == list(range(7))
        sizes = [area(np.array(flat["vertices"])[face]) for face in flat["faces"]]
        assert sizes == pytest.approx([5e3, 5e3, *[1e4] * 5])


class TestOtherMethods:
    def test_flatten_a_half_cylinder(self):
        found = result("flatten", mesh=half_cylinder())
        assert found["usable"]
        # The chords of the 24 columns.
        width = 24 * 2 * 50.0 * math.sin(math.pi / 48)
        assert sorted(found["parts"][0]["size"]) == pytest.approx([80.0, width], rel=1e-6)
        assert len(found["flat"]["vertices"]) == len(half_cylinder()["vertices"])

    def test_flatten_along_seams(self):
        found = result("flatten", mesh=CUBE | {"seams": CROSS})
        assert len(found["parts"]) == 1
        assert found["parts"][0]["area"] == pytest.approx(6e4)

    def test_pieces_of_a_box(self, tmp_path):
        found = result("pieces", mesh=CUBE, folder=str(tmp_path / "pieces"))
        assert found["usable"]
        assert found["parts"][0]["area"] == pytest.approx(6e4)
        assert str(tmp_path / "pieces" / "pieces.obj") in found["files"]
        surface, flat = found["mesh"], found["flat"]
        assert max(flat["vertex"]) < len(surface["vertices"])
        assert len(flat["faces"]) == len(surface["faces"])

    def test_optimize_tells_its_progress(self):
        u, v = np.mgrid[-1:1:9j, -1:1:9j]
        points = np.stack([u, v, 0.3 * u * v], axis=-1)
        mesh = gso.Mesh.from_grid(points)
        given = {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()}
        asked = {"id": "a", "method": "optimize", "params": {"mesh": given, "options": "fast"}}
        found, progress = answers(asked)
        known = found["a"]["result"]["metrics"]
        assert known["loss_gc"] < known["loss_gc_before"], known
        assert progress and all(one["id"] == "a" for one in progress)
        assert all(0 <= one["progress"] <= 1 and one["text"] for one in progress)

    def test_constraints_of_a_result(self):
        u, v = np.mgrid[-1:1:9j, -1:1:9j]
        mesh = gso.Mesh.from_grid(np.stack([u, v, 0.3 * u * v], axis=-1))
        given = {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()}
        held = [{"type": "Fixed", "ids": [0, 8]}]
        found = result("optimize", mesh=given, options="fast", constraints=held)
        kept = np.array(found["mesh"]["vertices"])[[0, 8]]
        np.testing.assert_allclose(kept, mesh.vertices[[0, 8]], atol=1e-9)

    def test_fabricate_takes_the_thickness_into_account(self, tmp_path):
        found = result(
            "fabricate",
            mesh=half_cylinder(),
            folder=str(tmp_path / "job"),
            formats=["svg"],
            finish={"thickness": {"sheet": 2.0, "k": 0.5, "face": "outside"}, "labels": None},
            workers=0,
        )
        assert found["usable"]
        # The neutral surface is 1 mm inside the surface, whose radius is 50 mm.
        (part,) = found["parts"]
        assert sorted(part["size"]) == pytest.approx([80.0, 49.0 * math.pi], rel=2e-3)
        assert str(tmp_path / "job" / "index.html") in found["files"]
        assert Path(found["files"][0]).exists()

    def test_info_of_a_file(self):
        found = result("info", mesh=str(ROOT / "examples" / "panel.obj"))
        assert found["kind"] == "grid 33 x 33"

    def test_describe(self):
        found = result("describe")
        assert found["protocol"] == PROTOCOL
        assert {"unfold", "strips", "pieces", "flatten", "optimize", "fabricate"} <= set(
            found["methods"]
        )
        assert {"mesh", "max_deviation", "output"} <= set(found["methods"]["strips"])
        assert "callback" not in found["methods"]["strips"]


class TestErrors:
    @pytest.mark.parametrize(
        ("line", "said"),
        [
            ("what?", "line 1 is no JSON"),
            ("[1]", "line 1 is no JSON object"),
            (b"\xff\xfe\x00", "line 1 is no JSON"),
            ("[" * 100_000, "line 1 is no JSON"),
            ('{"method": "info"}', 'has no "id"'),
            ('{"id": true, "method": "info"}', 'has no "id"'),
            ('{"id": 1}', 'has no "method"'),
            ('{"id": 1, "method": "info", "params": [1]}', '"params" that are no object'),
            ('{"id": 1, "method": "info", "parms": {}}', "did you mean 'params'"),
            ('{"id": 1, "method": "cancel"}', 'has no "id" in its "params"'),
            ('{"id": 1, "method": "cancel", "params": {"id": [1]}}', 'has no "id" in its "params"'),
        ],
    )
    def test_bad_lines(self, line, said):
        found, _ = answers(line)
        (answer,) = found.values()
        assert said in answer["error"]["message"]
        assert answer["error"]["line"] == 1

    @pytest.mark.parametrize(
        ("method", "params", "said"),
        [
            ("unfodl", {}, "did you mean 'unfold'"),
            ("unfold", {"mesh": CUBE, "efort": 1}, "did you mean 'effort'"),
            ("unfold", {}, 'there is no "mesh"'),
            ("unfold", {"mesh": [1, 2]}, '"mesh" is not written as one'),
            ("unfold", {"mesh": CUBE | {"seam": []}}, "did you mean 'seams'"),
            ("unfold", {"mesh": CUBE | {"seams": [[0, 7, 1]]}}, "edges are pairs of vertices"),
            ("unfold", {"mesh": CUBE | {"seams": [[0, 7]]}}, "0-7"),
            ("unfold", {"mesh": CUBE, "unit": "mile"}, "mile"),
            ("unfold", {"mesh": CUBE, "output": "net.dwg"}, "no writer for '.dwg'"),
            ("unfold", {"mesh": CUBE, "output": 7}, "output is 7"),
            ("unfold", {"mesh": CUBE, "output": "no/such/folder/net.svg"}, "no/such/folder"),
            ("unfold", {"mesh": CUBE, "chord": 1}, "chord is for CAD files"),
            (
                "unfold",
                {"mesh": CUBE | {"seams": [[0, 70]]}, "weld": 0},
                "vertex that is not there",
            ),
            ("info", {"mesh": "no such.obj"}, "no such.obj"),
            ("info", {"mesh": {"vertices": [[0, 0, 0]], "faces": [[0, 1, 2, 3, 4]]}}, "face 0"),
            ("flatten", {"mesh": CUBE}, "closed"),
            ("flatten", {"mesh": CUBE, "task": "bend"}, "takes no 'task'"),
            ("pieces", {"mesh": CUBE, "max_pieces": "three"}, "max_pieces"),
            ("fabricate", {"mesh": CUBE, "finish": {"kref": 1}}, "did you mean 'kerf'"),
            ("optimize", {"mesh": CUBE, "constraints": [{"type": "Fixd"}]}, "did you mean 'Fixed'"),
        ],
    )
    def test_bad_requests(self, method, params, said):
        assert said in message(method, **params)

    def test_the_server_goes_on_after_errors(self):
        found, _ = answers(
            "what?",
            {"id": 1, "method": "unfold", "params": {"mesh": CUBE, "sheet": {"a": 1}}},
            {"id": 2, "method": "info", "params": {"mesh": CUBE}},
        )
        assert "error" in found[None] and "error" in found[1]
        assert found[2]["result"]["kind"] == "quads"

    def test_faults_are_no_tracebacks(self, monkeypatch):
        def fail(*given):
            raise ZeroDivisionError("division by zero")

        monkeypatch.setattr("gso.serving.server.call", fail)
        said = message("info", mesh=CUBE)
        assert said.startswith("ZeroDivisionError: division by zero; ")


class TestCancel:
    def test_a_running_request(self, monkeypatch):
        said = []

        def write(line):
            said.append(json.loads(line))

        def read():
            """Cancel the request as soon as it tells what it does."""
            asked = {"mesh": str(ROOT / "examples" / "panel.obj"), "max_deviation": "1%"}
            yield json.dumps({"id": 1, "method": "strips", "params": asked})
            while not said:
                time.sleep(0.01)
            yield json.dumps({"id": 2, "method": "cancel", "params": {"id": 1}})

        Server(write).run(read())
        found = {one["id"]: one for one in said if "progress" not in one}
        assert found[1]["error"]["kind"] == "Cancelled"
        assert found[2]["result"] == {"cancelled": True}

    def test_a_request_that_waits(self):
        asked = {"mesh": str(ROOT / "examples" / "panel.obj"), "options": "fast"}
        found, _ = answers(
            {"id": 1, "method": "optimize", "params": asked},
            {"id": 2, "method": "unfold", "params": {"mesh": CUBE}},
            {"id": 3, "method": "cancel", "params": {"id": 2}},
        )
        assert "result" in found[1]
        assert found[2]["error"]["kind"] == "Cancelled"

    def test_an_unknown_request(self):
        found, _ = answers({"id": 2, "method": "cancel", "params": {"id": 1}})
        assert found[2]["result"] == {"cancelled": False}


def test_the_command():
    """Standard output has the lines of the protocol only."""
    asked = [
        {"id": 1, "method": "unfold", "params": {"mesh": CUBE}},
        {"id": "b", "method": "info", "params": {"mesh": "ä.obj"}},
    ]
    text = "".join(f"{json.dumps(one, ensure_ascii=False)}\n" for one in asked)
    command = [sys.executable, "-m", "gso", "serve", "--stdio"]
    done = subprocess.run(command, input=text.encode(), capture_output=True, check=True)
    first, second = map(json.loads, done.stdout.decode().splitlines())
    assert first["id"] == 1 and first["result"]["metrics"]["parts"] == 1
    assert second["id"] == "b" and "ä.obj" in second["error"]["message"]
    assert not done.stderr


def test_the_command_needs_to_be_told_how():
    done = subprocess.run([sys.executable, "-m", "gso", "serve"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "give --stdio" in done.stderr
