"""The page of a job: its data, its drawings, and what it does in a browser."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import subprocess
import sys
import zlib
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import gso
from gso.cli import main
from gso.mesh import Mesh
from gso.workshop import (
    Drawing,
    Part,
    data_for_page,
    name_place,
    of_net,
    of_pieces,
    of_surface,
    order_of_joining,
    sheet_drawing,
    step_pictures,
)
from tests.browser import PROGRAM, Browser
from tests.page_designs import html_of, job_of, vault

ROOT = Path(__file__).resolve().parents[1]


def read(html: str, name: str) -> bytes:
    """What the page has for its script, unpacked."""
    return zlib.decompress(base64.b64decode(re.search(f'id="{name}">([^<]*)</script>', html)[1]))


def numbers(data: dict, entry: dict) -> np.ndarray:
    """An array of the page, as its script reads it; one number stands for equal ones."""
    if not isinstance(entry, dict):
        return np.array([[entry]])
    size = entry["count"] * entry["columns"]
    levels = np.frombuffer(data["bytes"], "<u2", size, entry["at"])
    table = levels.reshape(-1, entry["columns"]).astype(float)
    return np.where(table == 65535, np.nan, entry["low"] + table * entry["step"])


def indices(data: dict, entry: dict) -> np.ndarray:
    size = entry["count"] * entry["columns"]
    table = np.frombuffer(data["bytes"], f"<u{entry['bits'] // 8}", size, entry["at"])
    return table.reshape(-1, entry["columns"])


def data_of(certificate, parts, views) -> dict:
    data = data_for_page(views.shown, parts, certificate)
    return data | {"bytes": data["arrays"]}


def data_points(html: str, data: dict) -> np.ndarray:
    """The points in place of all panels of a page."""
    data = data | {"bytes": read(html, "page-arrays")}
    return np.concatenate([numbers(data, panel["points"]) for panel in data["panels"]])


def arch() -> np.ndarray:
    """A quarter of a cylinder, as a grid."""
    y, turn = np.mgrid[:9, :9] / 8
    return np.stack([np.sin(turn), y, np.cos(turn)], axis=-1)


def box() -> Mesh:
    points = [[x, y, z] for z in (0.0, 3.0) for y in (0.0, 2.0) for x in (0.0, 1.0)]
    return Mesh(
        points, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    )


@cache
def panel_in_pieces() -> gso.seams.Segmentation:
    """The panel of the examples, searched once; no test may change it."""
    return gso.pieces(ROOT / "examples" / "panel.obj")


class TestData:
    def test_panels_are_in_millimetres_in_place_and_flat(self):
        mesh, made = vault(2, 3, 8)
        data = data_of(*job_of(mesh, made))
        assert len(data["panels"]) == 6 and {p["part"] for p in data["panels"]} == set(range(6))
        for entry, panel in zip(data["panels"], made.panels, strict=True):
            points, flat = (numbers(data, entry[name]) for name in ("points", "flat"))
            # 16 bits of the size of a panel.
            np.testing.assert_allclose(points, 1000 * panel.surface.vertices, atol=0.02)
            np.testing.assert_allclose(flat, 1000 * panel.flat, atol=0.02)
            np.testing.assert_array_equal(
                indices(data, entry["triangles"]), panel.surface.triangles
            )
            np.testing.assert_array_equal(indices(data, entry["rim"]), panel.rim)
            # A cylinder of radius 2 m; the faces are its chords.
            assert entry["values"]["deviation"] == 0.0
            bending = numbers(data, entry["values"]["bending"])
            np.testing.assert_allclose(bending, 0.5, rtol=0.02)

    def test_values_are_those_of_the_certificate(self, tmp_path):
        y, x = np.mgrid[-1:1:17j, -1:1:17j]
        design = gso.as_mesh(np.stack([x, y, 0.15 * x * x + 0.1 * y * y], axis=-1))
        job = gso.fabricate(
            design,
            tmp_path,
            unit="m",
            formulation="curvature",
            max_deviation="2%",
            formats=("svg",),
            workers=0,
        )
        html = (tmp_path / "index.html").read_text()
        data = json.loads(read(html, "page-data"))
        data["bytes"] = read(html, "page-arrays")
        (record,) = job.certificate["designs"]
        largest = {}
        for name in ("deviation", "strain"):
            every = [numbers(data, p["values"][name]).ravel() for p in data["panels"]]
            largest[name] = np.nanmax(np.concatenate(every))
        assert largest["strain"] == pytest.approx(100 * record["strain_max"], rel=1e-3)
        # The largest distance of the certificate is that of all points and in both directions.
        assert (
            0.5 * record["deviation_max"] < largest["deviation"] <= 1.001 * record["deviation_max"]
        )

    def test_seams_name_both_parts(self):
        mesh, made = vault(2, 2)
        certificate, parts, views = job_of(mesh, made)
        data = data_of(certificate, parts, views)
        assert len(data["seams"]) == len(made.matings) == 4
        for entry, seam in zip(data["seams"], made.matings, strict=True):
            assert entry["panels"] == [seam.one.panel, seam.two.panel]
            assert entry["length"] == pytest.approx(1000 * seam.length)
            one, two = np.split(numbers(data, entry["line"]), 2)
            np.testing.assert_allclose(one, two, atol=0.1)
        numbers_of, others = views.mates(parts[0].name)
        assert len(numbers_of) == 2 and len(others) == 2 and parts[0].name not in others

    def test_copies_are_moved_to_their_places(self):
        mesh, made = vault(1, 2)
        turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
        copy = mesh.replaced(mesh.vertices @ turn.T + [5.0, 0, 0])
        data = data_of(*job_of(mesh, made, (mesh, copy)))
        first, second = np.array(data["designs"][0]["motions"])
        np.testing.assert_allclose(first, np.eye(3, 4), atol=1e-9)
        np.testing.assert_allclose(second, np.c_[turn, [5000.0, 0, 0]], atol=1e-6)


class TestOrder:
    def test_each_part_is_joined_to_earlier_ones_where_it_can_be(self):
        _, made = vault(3, 4)
        steps = order_of_joining(made)
        assert sorted(step.panel for step in steps) == list(range(12))
        joined = set()
        seams = {seam.number: {seam.one.panel, seam.two.panel} for seam in made.matings}
        for number, step in enumerate(steps):
            assert bool(step.seams) == bool(number)
            for seam in step.seams:
                assert seams[seam] == {step.panel} | (seams[seam] & joined)
            joined.add(step.panel)
        # Every seam is closed once.
        assert sorted(n for step in steps for n in step.seams) == sorted(seams)

    def test_the_largest_is_first(self):
        mesh = box()
        net = gso.unfold(mesh)
        made = of_net("box", net)
        (step,) = order_of_joining(made)
        assert len(step.closed) == len(made.matings) == 7

    def test_many_steps_share_pictures(self):
        _, made = vault(3, 4, 2)
        steps = order_of_joining(made)
        drawn = step_pictures(made, steps, most=5)
        assert [(shot.first, len(shot.steps)) for shot in drawn] == [
            (1, 3),
            (4, 3),
            (7, 3),
            (10, 3),
        ]
        # Names of what is new only.
        for shot in drawn:
            named = {n.title for n in shot.picture.names if n.kind == "panel"}
            assert named <= {made.panels[step.panel].name for step in shot.steps}


class TestDrawings:
    def test_names_lie_inside_their_parts_and_off_bends(self):
        import shapely

        y, turn = np.mgrid[:9, :17] / 16
        mesh = gso.as_mesh(np.stack([np.sin(turn), y, np.cos(turn)], axis=-1))
        made = of_surface(
            "arch", mesh, gso.Pattern.whole(mesh, np.stack([turn, y], -1).reshape(-1, 2)), {}
        )
        _, parts, _ = job_of(mesh, made)
        square = np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])
        bends = tuple(
            gso.workshop.Bend(np.array([[x, 0.0], [x, 60]]), 0.1, 9.0) for x in (12.0, 24.0)
        )
        for part in (*parts, Part("side", square, bends=bends)):
            middle, height, angle = name_place(part, part.name, 9.0)
            assert height > 0
            wide, high = 0.85 * len(part.name) * height, height
            c, s = np.cos(angle), np.sin(angle)
            corners = np.array([[-wide, -high], [wide, -high], [wide, high], [-wide, high]]) / 2
            text = shapely.Polygon(middle + corners @ np.array([[c, s], [-s, c]]))
            assert shapely.Polygon(part.outline).buffer(1e-6).contains(text)
            assert not any(text.intersects(shapely.LineString(b.line)) for b in part.bends)

    def test_parts_on_sheets_are_where_the_nesting_put_them(self):
        square = np.array([[0.0, 0], [60, 0], [60, 30], [0, 30]])
        part = Part("side", square)
        placed = part.turned(np.pi / 2).shifted(np.array([100.0, 20.0]))
        drawn = sheet_drawing(Drawing((placed,), sheet=(200.0, 100.0)), [part])
        a, b, c, d, e, f = map(float, re.search(r"matrix\(([^)]*)\)", drawn)[1].split())
        # The drawing of the part begins 0.9 mm left of it and above it; y points down.
        here = square * [1, -1] + [0.9, 30.9]
        there = here @ np.array([[a, b], [c, d]]) + [e, f]
        room = 0.3 * 0.015 * 200
        expected = (placed.outline - [-room, 100 + room]) * [1, -1]
        np.testing.assert_allclose(there, expected, atol=1e-4)
        at = re.search(r'<text x="([\d.]+)" y="([\d.]+)"', drawn)
        x, y = (float(v) for v in at.groups())
        assert expected[:, 0].min() < x < expected[:, 0].max()
        assert expected[:, 1].min() < y < expected[:, 1].max()

    def test_drawings_have_one_scale(self):
        html = html_of(*vault(1, 2))
        gallery = float(re.search(r'class="gallery" style="--most:([\d.]+)"', html)[1])
        own = re.findall(r'class="drawing" data-part="\d+" style="--w:([\d.]+);--h:([\d.]+)"', html)
        box = re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)" class="drawing"', html)
        assert len(own) == 2 and own == [tuple(f"{float(v):.6g}" for v in size) for size in box]
        assert gallery == pytest.approx(3141.6, rel=1e-3)


class TestPage:
    def test_it_needs_nothing_else(self):
        html = html_of(*vault(2, 2))
        script = read(html, "page-script").decode()
        for text in (html, script):
            assert "http" not in text.replace("http://www.w3.org", "")
        for address in re.findall(r'(?:href|src)="([^"]*)"', html):
            assert address.startswith(("#", "data:image/png;base64,"))
        assert "@import" not in html and "url(" not in html.split("<script")[0]
        ids = re.findall(r' id="([^"]+)"', html)
        assert len(ids) == len(set(ids))
        assert set(re.findall(r'href="#([^"]+)"', html)) <= set(ids)

    def test_it_is_small(self):
        html = html_of(*vault(2, 2))
        geometry = len(read(html, "page-arrays"))
        assert len(html) - geometry < 1.5e6

    def test_names_cannot_leave_their_place(self):
        mesh, made = vault(1, 2)
        bad = '</script><img src=x onerror="alert(1)"><!--'
        made = made.named([bad, f"{bad}2"])
        html = html_of(mesh, made)
        assert "<img" not in html and "<!--" not in html
        data = json.loads(read(html, "page-data"))
        assert data["panels"][0]["name"] == bad
        assert html.count("</script>") == 4

    def test_the_list_of_seams_says_which_parts_each_joins(self):
        html = html_of(*vault(1, 3))
        table = re.search('<table class="sortable seams">.*?</table>', html, re.S)[0]
        rows = re.findall(r"<tr data-seam.*?</tr>", table, re.S)
        assert len(rows) == 2
        assert all(len(re.findall(r">vault-\d<", row)) == 2 for row in rows)

    def test_the_script_was_built_from_its_sources(self):
        """After a change in web/: ``npm ci && npm run build`` there."""
        web, out = ROOT / "web", ROOT / "gso" / "workshop" / "web"
        names = ["build.mjs", "package-lock.json", "package.json"]
        names += [f"src/{path.name}" for path in (web / "src").iterdir()]
        digest = hashlib.sha256()
        for name in sorted(names):
            digest.update(f"{name}\n".encode())
            digest.update((web / name).read_bytes())
        said = json.loads((out / "built.json").read_text())
        assert said["sources"] == digest.hexdigest()
        for name, own in said["files"].items():
            assert hashlib.sha256((out / name).read_bytes()).hexdigest() == own
        assert "three.js authors" in (out / "LICENSE-three.txt").read_text()


def test_a_result_has_a_page(tmp_path):
    file, out = tmp_path / "arch.npz", tmp_path / "arch.html"
    gso.tno.optimize(arch()).save(file)
    words = ["view", str(file), "-o", str(out), "--unit", "m"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    data = json.loads(read(out.read_text(), "page-data"))
    (part,) = data["parts"]
    assert sorted([part["length"], part["width"]]) == pytest.approx([1000, 1000], rel=0.01)


@pytest.mark.parametrize("parts", [1, 2])
def test_a_result_without_a_pattern_is_shown_in_space(parts, tmp_path):
    file, out = tmp_path / "noisy.npz", tmp_path / "noisy.html"
    mesh = gso.as_mesh(arch() + 0.01 * np.random.default_rng(0).normal(size=arch().shape))
    every = np.concatenate([mesh.vertices + 3.0 * k for k in range(parts)])
    count = len(mesh.vertices)
    faces = np.concatenate([mesh.faces + k * count for k in range(parts)])
    result = gso.tno.optimize(gso.Mesh(every, faces), task="denoise")
    result.save(file)
    done = CliRunner().invoke(main, ["view", str(file), "-o", str(out), "--unit", "m"])
    assert done.exit_code == 0, done.output
    text = out.read_text()
    assert "noisy is as it was asked for" in text and "flat parts" not in text
    assert f"roughness {result.metrics['roughness_ratio']:.3g} times the input" in text
    assert "<h2>Parts" not in text and "<h2>Drawings" not in text and "<h2>Pictures" in text
    data = json.loads(read(text, "page-data"))
    assert len(data["panels"]) == parts and not data["parts"] and not data["seams"]
    for panel in data["panels"]:
        assert panel["part"] is None and panel["flat"] is None
        assert panel["values"]["strain"] is None
        # Vertices have moved by different distances.
        assert isinstance(panel["values"]["deviation"], dict)


def test_closed_surfaces_have_a_page(tmp_path):
    file, out = tmp_path / "ball.npz", tmp_path / "ball.html"
    ball = trimesh.creation.icosphere(1)
    gso.tno.optimize(gso.as_mesh(ball), task="denoise").save(file)
    done = CliRunner().invoke(main, ["view", str(file), "-o", str(out)])
    assert done.exit_code == 0, done.output
    (panel,) = json.loads(read(out.read_text(), "page-data"))["panels"]
    assert panel["rim"]["count"] == 0 and panel["flat"] is None


class TestCommands:
    """Commands beside ``gso fabricate`` that write the page."""

    @staticmethod
    def page(words: list[str], out: Path) -> dict:
        done = CliRunner().invoke(main, [*words, "--quiet"])
        assert done.exit_code == 0, done.output
        return json.loads(read(out.read_text(), "page-data"))

    def test_pieces(self, tmp_path):
        out = tmp_path / "cut"
        data = self.page(
            ["pieces", str(ROOT / "examples" / "panel.obj"), "-o", str(out), "--unit", "m"],
            out / "index.html",
        )
        table = json.loads((out / "pieces.json").read_text())
        names = {panel["short"]: panel["part"] for panel in data["panels"]}
        assert sorted(names) == [row["name"] for row in table["pieces"]] and len(names) > 1
        for row in table["pieces"]:
            part = data["parts"][names[row["name"]]]
            sizes = sorted([part["length"], part["width"]])
            assert sizes[1] <= 1000 * np.hypot(row["length"], row["width"])
            assert part["area"] == pytest.approx(1e6 * row["area"], rel=0.02)
        length = sum(seam["length"] for seam in data["seams"])
        assert length == pytest.approx(1000 * sum(s["length"] for s in table["seams"]))
        # The shape stays as it is.
        assert all(panel["values"]["deviation"] == 0.0 for panel in data["panels"])

    def test_pieces_without_a_pattern_are_left_out(self):
        found = panel_in_pieces()
        some = replace(found, sheets=(found.sheets[0], *[None] * (len(found) - 1)))
        assert some.pattern is None
        made = of_pieces("panel", some, {})
        assert [panel.name for panel in made.panels] == ["panel-A"] and not made.matings
        none = replace(found, sheets=(None,) * len(found))
        with pytest.raises(gso.MeshError, match="none of the pieces"):
            of_pieces("panel", none, {})

    def test_unfold(self, tmp_path):
        house, out = ROOT / "examples" / "house.obj", tmp_path / "house.html"
        svg = str(tmp_path / "house.svg")
        words = ["unfold", str(house), "-o", svg, "--page", str(out), "--tabs", "6"]
        data = self.page(words, out)
        net = gso.unfold(house)
        assert len(data["panels"]) == len(net) == 1
        assert len(data["panels"][0]["angles"]) == len(net.folds.edges)
        assert sum(s["length"] for s in data["seams"]) == pytest.approx(net.cut_length)
        # Tabs make the part larger than its panel.
        assert data["parts"][0]["area"] > 1.02 * net.areas[0]

    def test_strips_and_optimize(self, tmp_path):
        np.save(tmp_path / "arch.npy", arch())
        file, out = str(tmp_path / "arch.npy"), tmp_path / "page.html"
        more = ["-o", str(tmp_path / "out.svg"), "--page", str(out)]
        assert self.page(["strips", file, *more], out)["panels"][0]["angles"]
        data = self.page(["optimize", file, "--task", "flatten", *more], out)
        # The surface is in place, not its flat image.
        assert np.ptp(data_points(out.read_text(), data), axis=0).min() > 0.4
        more[1] = str(tmp_path / "out.obj")
        done = CliRunner().invoke(main, ["optimize", file, "--task", "denoise", *more])
        assert done.exit_code == 0, done.output
        data = json.loads(read(out.read_text(), "page-data"))
        assert data["panels"][0]["flat"] is None and not data["parts"]


class TestShow:
    """``show()`` of results, with an opener of its own in place of the browser."""

    SHOWN: ClassVar = {
        "optimize": lambda: gso.tno.optimize(arch()),
        "strips": lambda: gso.strips(arch()),
        "pieces": panel_in_pieces,
        "unfold": lambda: gso.unfold(box()),
    }

    @pytest.mark.parametrize("kind", SHOWN)
    def test_the_page_is_opened(self, kind, monkeypatch):
        opened = []
        monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
        self.SHOWN[kind]().show(unit="m", name="shape")
        (address,) = opened
        page = Path(url2pathname(urlsplit(address).path))
        data = json.loads(read(page.read_text(), "page-data"))
        assert data["designs"][0]["name"] == "shape"
        size = np.ptp(data_points(page.read_text(), data), axis=0).max()
        assert size > 500
        page.unlink()

    def test_the_page_is_there_until_the_end(self):
        code = (
            "import gso, webbrowser, numpy as np\n"
            "webbrowser.open = lambda address: print(address) or True\n"
            "points = np.moveaxis(np.mgrid[:3, :3, :1], 0, -1)[:, :, 0]\n"
            "gso.tno.optimize(points.astype(float), task='flatten').show()\n"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert not Path(url2pathname(urlsplit(done.stdout.split()[-1]).path)).exists()

    def test_without_a_browser_it_says_so(self, monkeypatch):
        monkeypatch.setattr("webbrowser.open", lambda address: False)
        with pytest.raises(gso.GSOError, match="there is no browser"):
            gso.unfold(box()).show()
        with pytest.raises(gso.GSOError, match="there is no browser"):
            gso.tno.optimize(arch(), task="denoise").show()

    def test_of_a_job(self, tmp_path, monkeypatch):
        opened, drawn = [], []
        monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
        job = gso.fabricate(arch(), tmp_path, unit="m", formats=("svg",), workers=0)
        job.show()
        assert opened == [(tmp_path / "index.html").as_uri()]
        # In a notebook both show pictures.
        shell = SimpleNamespace(kernel="a kernel")
        display = SimpleNamespace(display=drawn.append)
        ipython = SimpleNamespace(get_ipython=lambda: shell, display=display)
        monkeypatch.setitem(sys.modules, "IPython", ipython)
        monkeypatch.setitem(sys.modules, "IPython.display", display)
        job.show()
        net = gso.unfold(box())
        net.show()
        assert drawn == [job, net] and len(opened) == 1
        assert 'src="data:image/png;base64,' in job._repr_html_()


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    place = tmp_path_factory.mktemp("page") / "index.html"
    place.write_text(html_of(*vault(3, 3, 4)))
    return place


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="no Chromium, or GSO_BROWSER is not set")
class TestBrowser:
    @pytest.fixture
    def browser(self, place):
        with Browser() as browser:
            browser.open(place)
            yield browser
            browser.check()

    @staticmethod
    def middle(browser, panel: int) -> tuple[float, float]:
        """Where a panel's name is, in the window."""
        script = (
            "(() => { const v = gsoPage.viewer; const b = v.space.getBoundingClientRect();"
            f"const k = v.stage.copies.findIndex((c) => c.panel === {panel});"
            "const [x, y] = v.visible.get(k);"
            "return [b.left + x * b.width, b.top + y * b.height]; })()"
        )
        x, y = browser.run(script)
        return x, y

    def test_a_click_in_space_chooses_drawing_and_row(self, browser):
        browser.click(*self.middle(browser, 4))
        assert browser.run("gsoPage.state.part") == 4
        chosen = "[...document.querySelectorAll('.chosen')].map((x) => x.tagName + x.dataset.part)"
        assert sorted(browser.run(chosen)) == ["FIGURE4", "TR4"]
        assert "vault-5" in browser.run("document.querySelector('.details').textContent")

    def test_a_click_on_a_row_or_a_drawing_chooses_the_part_in_space(self, browser):
        browser.run(
            "document.querySelector('table.parts tr[data-part=\"2\"] td:nth-child(3)').click()"
        )
        assert browser.run("[...gsoPage.viewer.stage.markedPanels]") == [2]
        browser.run("document.querySelector('figure[data-part=\"7\"] figcaption').click()")
        assert browser.run("[...gsoPage.viewer.stage.markedPanels]") == [7]
        assert browser.run("gsoPage.viewer.stage.marked.visible")

    def test_a_seam_shows_its_mates(self, browser):
        browser.run("document.querySelector('table.seams tr[data-seam=\"3\"] td').click()")
        assert browser.run("gsoPage.state.seam.id") == 3
        assert browser.run("gsoPage.viewer.stage.seam.visible")
        # Notches of both parts.
        assert browser.run("document.querySelectorAll('#drawings .notch.marked').length") == 2

    def test_the_sliders_fold_and_explode(self, browser):
        slide = (
            "(() => { const one = gsoPage.viewer.form.elements.%s; one.value = %s;"
            "one.dispatchEvent(new Event('input'));"
            "return Array.from(gsoPage.viewer.stage.points); })()"
        )
        flat = np.reshape(browser.run(slide % ("fold", 0)), (-1, 3))
        place = np.reshape(browser.run(slide % ("fold", 1)), (-1, 3))
        copies = browser.run("gsoPage.viewer.stage.copies.map((c) => [c.panel, c.first, c.count])")
        _, made = vault(3, 3, 4)
        for panel, first, count in copies:
            own = made.panels[panel]
            np.testing.assert_allclose(
                place[first : first + count], 1000 * own.surface.vertices, atol=0.05
            )
            there = flat[first : first + count]
            # A pattern lies in a plane, with its own lengths.
            assert np.linalg.svd(there - there.mean(axis=0))[1][2] < 1.0
            edges = own.rim
            sizes = np.linalg.norm(there[edges[:, 0]] - there[edges[:, 1]], axis=1)
            expected = 1000 * np.linalg.norm(own.flat[edges[:, 0]] - own.flat[edges[:, 1]], axis=1)
            np.testing.assert_allclose(sizes, expected, rtol=1e-3)
        half = np.reshape(browser.run(slide % ("fold", 0.5)), (-1, 3))
        for panel, first, count in copies:
            edges = made.panels[panel].rim
            there = half[first : first + count]
            sizes = np.linalg.norm(there[edges[:, 0]] - there[edges[:, 1]], axis=1)
            flat_sizes = 1000 * np.linalg.norm(
                np.diff(made.panels[panel].flat[edges], axis=1)[:, 0], axis=1
            )
            np.testing.assert_allclose(sizes, flat_sizes, rtol=0.01)
        browser.run(slide % ("fold", 1))
        apart = np.reshape(browser.run(slide % ("explode", 1)), (-1, 3))
        assert np.ptp(apart, axis=0).max() > 1.5 * np.ptp(place, axis=0).max()

    def test_colours_show_values_under_the_pointer(self, browser):
        browser.run(
            "(() => { const own = gsoPage.viewer.form.elements.colours; own.value = 'bending';"
            "own.dispatchEvent(new Event('change')); })()"
        )
        browser.move(*self.middle(browser, 4))
        browser.wait("!gsoPage.viewer.hint.hidden")
        said = browser.run("gsoPage.viewer.hint.textContent")
        assert "vault-5" in said and re.search("bending 0.50?[0-9]? 1/m", said)
        assert browser.run("gsoPage.viewer.form.querySelector('.range').hidden") is False

    def test_inches_and_sorting(self, browser):
        cell = "document.querySelector('table.parts tbody tr td:nth-child(3)').textContent"
        before = float(browser.run(cell))
        browser.run("gsoPage.viewer.form.elements.inches.click()")
        assert float(browser.run(cell)) == pytest.approx(before / 25.4, abs=1e-3)
        heads = browser.run("document.querySelector('table.parts thead').textContent")
        assert "length in" in heads and "mm" not in heads
        browser.run("document.querySelector('table.parts th button').click()")
        browser.run("document.querySelector('table.parts th button').click()")
        assert browser.run("document.querySelector('table.parts tbody tr').dataset.part") == "8"

    def test_numbers_stand_at_their_seams(self, browser):
        """Of all twelve seams, and of those of a part once it is chosen."""
        ends = (
            "gsoPage.viewer.seamsShown().map((e) => [e.seam.number, e.copy.panel, e.seen,"
            "...gsoPage.viewer.stage.endOnCanvas(e).toArray()])"
        )
        every = browser.run(ends)
        assert len(every) == 24 and sum(end[2] for end in every) >= 20
        # Both sides of a seam are at one place.
        sides = {}
        for number, *_, x, y, _ in every:
            sides.setdefault(number, []).append((x, y))
        assert all(np.hypot(*np.subtract(*two)) < 1e-3 for two in sides.values())
        browser.run("gsoPage.chooseNumber(4)")
        own = browser.run(ends)
        _, made = vault(3, 3, 4)
        expected = {m.number for m in made.matings if 4 in (m.one.panel, m.two.panel)}
        assert {end[0] for end in own} == expected
        assert len(own) == 2 * len(expected) and sum(end[1] == 4 for end in own) == len(expected)
        # They move with their parts.
        browser.run("gsoPage.viewer.stage.move(1, 1)")
        apart = {}
        for number, *_, x, y, _ in browser.run(ends):
            apart.setdefault(number, []).append((x, y))
        assert all(np.hypot(*np.subtract(*two)) > 0.02 for two in apart.values())
        browser.run("gsoPage.viewer.form.elements.seams.click()")
        assert browser.run(ends) == []

    def test_keys_turn_and_choose(self, browser):
        browser.run("gsoPage.viewer.space.focus()")
        before = browser.run("gsoPage.viewer.stage.camera.position.toArray()")
        browser.press("ArrowLeft")
        assert browser.run("gsoPage.viewer.stage.camera.position.toArray()") != before
        browser.press("n")
        browser.press("n")
        assert browser.run("gsoPage.state.part") == 1
        browser.press("Escape")
        assert browser.run("gsoPage.state.part") is None

    def test_it_prints_one_part_on_a_page(self, browser):
        pypdf = pytest.importorskip("pypdf")
        pages = [p.extract_text() for p in pypdf.PdfReader(io.BytesIO(browser.pdf())).pages]
        captions = [[n for n in range(1, 10) if f"vault-{n}: " in text] for text in pages]
        assert sorted(n for own in captions for n in own) == list(range(1, 10))
        assert max(map(len, captions)) == 1
        assert any("order of joining" in text for text in pages)

    @pytest.mark.parametrize("wide", [400, 2000])
    @pytest.mark.parametrize("dark", [False, True])
    def test_nothing_is_wider_than_the_window(self, browser, wide, dark):
        browser.dark(dark)
        browser.resize(wide, 900)
        browser.wait("gsoPage.viewer.space.clientWidth > 0")
        assert browser.run("document.documentElement.scrollWidth") <= wide
