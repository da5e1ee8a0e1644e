"""Drawings of parts: read again by readers of their own."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from gso import GSOError, MeshError, OptionError
from gso.workshop import Bend, Drawing, Label, Notch, Part, writers
from gso.workshop.writers.tiles import tiled

ezdxf = pytest.importorskip("ezdxf")
pypdf = pytest.importorskip("pypdf")
pytest.importorskip("reportlab")

OUTLINE = np.array([[0.0, 0], [180.1234567, 0], [200, 60], [150, 123.456789], [0, 100]])
HOLE = np.array([[40.0, 20], [40, 30], [60, 30], [60, 20]])
PART = Part(
    "side/1",
    OUTLINE,
    holes=(HOLE,),
    bends=(
        Bend(np.array([[80.0, 0], [80, 110]]), np.radians(30), 12.5),
        Bend(np.array([[120.0, 0], [120, 118]]), -np.radians(90), np.inf),
        Bend(np.array([[130.0, 0], [130, 118]]), 0.0, np.inf),
    ),
    creases=(np.array([[0.0, 10], [20, 10]]),),
    marks=(np.array([[10.0, 50], [20, 55], [30, 50]]),),
    seams=(np.array([[5.0, 5], [150, 5], [150, 90], [5, 90], [5, 5]]),),
    notches=(Notch(np.array([100.0, 0]), np.array([0.0, 1]), "7"),),
    labels=(Label("side/1", np.array([100.0, 60]), 6.0),),
    grain=np.array([1.0, 0.0]),
    count=2,
)
DRAWING = Drawing((PART, replace(PART.shifted(np.array([300.0, 10])), name="other")), title="two")


@pytest.fixture
def dxf(tmp_path):
    path = tmp_path / "parts.dxf"
    writers.write(DRAWING, path)
    return ezdxf.readfile(path)


class TestDXF:
    def test_it_passes_the_audit(self, dxf):
        auditor = dxf.audit()
        assert not auditor.errors and not auditor.fixes
        assert dxf.header["$INSUNITS"] == 4

    def test_contours_are_closed_and_have_the_same_coordinates(self, dxf):
        lines = list(dxf.modelspace().query('LWPOLYLINE[layer=="CUT"]'))
        assert len(lines) == 4 and all(line.closed for line in lines)
        found = [np.array(line.get_points("xy")) for line in lines]
        step = np.array([300.0, 10.0])
        for want in (OUTLINE, HOLE, OUTLINE + step, HOLE + step):
            assert any(f.shape == want.shape and np.allclose(f, want, atol=1e-9) for f in found)

    def test_no_line_is_doubled(self, dxf):
        ends = [
            tuple(np.round([*line.dxf.start, *line.dxf.end], 6))
            for line in dxf.modelspace().query("LINE")
        ]
        assert len(set(ends)) == len(ends)

    def test_mountain_folds_go_down_and_valley_folds_up(self, dxf):
        (down, _), (up, _) = (
            list(dxf.modelspace().query(f'LINE[layer=="{name}"]'))
            for name in ("BEND_DOWN", "BEND_UP")
        )
        assert down.dxf.start.x == pytest.approx(80)
        assert up.dxf.start.x == pytest.approx(120)
        said = [value for _, value in down.get_xdata("GSO")]
        assert said[0] == "mountain" and said[1:] == pytest.approx([30, 12.5])

    def test_other_lines_have_their_layers(self, dxf):
        layers = {entity.dxf.layer for entity in dxf.modelspace()}
        assert {"CUT", "ENGRAVE", "LABEL", "SEW", "GRAIN", "BEND_UP", "BEND_DOWN"} == layers

    def test_layers_of_garment_software(self, tmp_path):
        writers.write(DRAWING, tmp_path / "a.dxf", layers="astm")
        document = ezdxf.readfile(tmp_path / "a.dxf")
        assert not document.audit().fixes
        layers = {entity.dxf.layer for entity in document.modelspace()}
        assert layers == {"1", "4", "7", "8", "11", "14", "15"}

    def test_a_sheet_is_shown_and_not_plotted(self, tmp_path):
        writers.write(replace(DRAWING, sheet=(600.0, 400.0)), tmp_path / "a.dxf")
        document = ezdxf.readfile(tmp_path / "a.dxf")
        assert len(document.modelspace().query('LWPOLYLINE[layer=="SHEET"]')) == 1
        assert not document.layers.get("SHEET").dxf.plot


class TestSVG:
    @pytest.fixture
    def text(self, tmp_path):
        writers.write(DRAWING, tmp_path / "a.svg", stroke=0.2)
        return (tmp_path / "a.svg").read_text()

    def test_an_independent_reader_finds_the_same_size(self, tmp_path, text):
        svgelements = pytest.importorskip("svgelements")
        drawing = svgelements.SVG.parse(tmp_path / "a.svg", ppi=25.4)
        paths = [
            e for e in drawing.elements() if isinstance(e, svgelements.Shape) and e.values.get("d")
        ] or [e for e in drawing.elements() if isinstance(e, svgelements.Shape)]
        boxes = np.array([e.bbox() for e in paths if e.bbox() is not None])
        wide = boxes[:, 2].max() - boxes[:, 0].min()
        high = boxes[:, 3].max() - boxes[:, 1].min()
        low, top = DRAWING.bounds
        assert (wide, high) == pytest.approx(tuple(top - low), rel=1e-6)

    def test_the_page_is_in_millimetres(self, text):
        size = [float(x) for x in re.search(r'width="([\d.]+)mm"', text).groups()]
        box = [float(x) for x in re.search(r'viewBox="([^"]+)"', text).group(1).split()]
        assert size[0] == pytest.approx(box[2])
        low, high = DRAWING.bounds
        assert box[2] == pytest.approx((high - low)[0] + 2 * 10 * 0.2)

    def test_layers_and_titles(self, text):
        for name in ("CUT", "BEND_UP", "BEND_DOWN", "ENGRAVE", "LABEL"):
            assert f'label="{name}"' in text
        assert "mountain 30 degrees, radius 12.5 mm" in text
        assert "side/1" in text

    def test_names_with_special_characters_stay_themselves(self, tmp_path):
        name = """9 <&"'> größe"""
        part = replace(PART, name=name, labels=(Label(name, np.array([100.0, 60]), 6.0, 0.3),))
        writers.write(Drawing((part,)), tmp_path / "a.svg")
        root = ElementTree.parse(tmp_path / "a.svg").getroot()
        svg = "{http://www.w3.org/2000/svg}"
        assert {e.text for e in root.iterfind(f"{svg}g/{svg}g/{svg}title")} == {f"{name}, 2 times"}
        assert name in {e.text for e in root.iter(f"{svg}text")}


class TestPDF:
    def test_pages_have_windows_and_a_scale_bar(self, tmp_path):
        path = tmp_path / "a.pdf"
        # Parts that fit a page have one of their own.
        writers.write(Drawing((PART, PART)), path, paper="A4")
        assert len(pypdf.PdfReader(path).pages) == 2
        drawing = Drawing(DRAWING.parts, sheet=(600.0, 300.0))
        writers.write(drawing, path, paper="A4")
        tiling = tiled(drawing, (210.0, 297.0), 10.0, 10.0)
        book = pypdf.PdfReader(path)
        assert len(book.pages) == len(tiling.tiles) + 1
        box = book.pages[0].mediabox
        size = sorted(float(x) / 72 * 25.4 for x in (box.width, box.height))
        assert size == pytest.approx([210, 297], abs=0.01)
        said = [page.extract_text() for page in book.pages]
        assert all("mm; print at 100 %" in text for text in said[1:])
        assert all(tile.name in text for tile, text in zip(tiling.tiles, said[1:], strict=True))

    def test_tiles_cover_the_drawing_and_overlap(self):
        low, high = DRAWING.bounds
        tiling = tiled(DRAWING, (210.0, 297.0), 12.0, 10.0)
        corners = np.array([[*t.low, *t.high] for t in tiling.tiles])
        assert (corners[:, :2].min(axis=0) <= low).all()
        assert (corners[:, 2:].max(axis=0) >= high).all()
        left = np.unique(corners[:, 0].round(6))
        wide = corners[0, 2] - corners[0, 0]
        assert np.allclose(np.diff(left), wide - 12.0)

    def test_one_page_is_enough_for_a_small_part(self, tmp_path):
        writers.write(Drawing((PART,)), tmp_path / "a.pdf", paper="A3")
        assert len(pypdf.PdfReader(tmp_path / "a.pdf").pages) == 1

    def test_empty_pages_are_left_out(self):
        far = Drawing((PART, PART.shifted(np.array([3000.0, 3000.0]))))
        tiling = tiled(far, (297.0, 420.0), 10.0, 10.0)
        assert len(tiling.tiles) < 0.2 * tiling.rows * tiling.columns

    def test_wrong_paper_is_named(self, tmp_path):
        with pytest.raises(OptionError, match="no paper 'A7'"):
            writers.write(DRAWING, tmp_path / "a.pdf", paper="A7")
        with pytest.raises(OptionError, match="leave no room"):
            writers.write(DRAWING, tmp_path / "a.pdf", margin=100.0)
        with pytest.raises(OptionError, match="overlap is -1"):
            writers.write(DRAWING, tmp_path / "a.pdf", overlap=-1)


class TestAll:
    @pytest.mark.parametrize("suffix", ["dxf", "svg", "pdf"])
    def test_the_same_drawing_gives_the_same_bytes(self, suffix, tmp_path):
        for name in ("one", "two"):
            writers.write(DRAWING, tmp_path / f"{name}.{suffix}")
        one, two = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("one", "two"))
        assert one == two

    @pytest.mark.parametrize("suffix", ["dxf", "svg", "pdf"])
    def test_bad_drawings_are_refused(self, suffix, tmp_path):
        path = tmp_path / f"a.{suffix}"
        with pytest.raises(MeshError, match="no parts"):
            writers.write(Drawing(()), path)
        bad = replace(PART, outline=np.array([[0, 0], [1, np.nan], [0, 1.0]]))
        with pytest.raises(MeshError, match="part 'side/1'"):
            writers.write(Drawing((bad,)), path)
        with pytest.raises(OptionError, match="layers"):
            writers.write(DRAWING, path, layers="x")
        assert not path.exists()

    def test_unknown_suffixes_and_missing_packages_are_named(self, tmp_path, monkeypatch):
        with pytest.raises(OptionError, match=r"\.dwg"):
            writers.write(DRAWING, tmp_path / "a.dwg")
        monkeypatch.setattr("gso.workshop.writers.writer_checks.find_spec", lambda name: None)
        for suffix in ("dxf", "pdf"):
            with pytest.raises(GSOError, match="pip install"):
                writers.write(DRAWING, tmp_path / f"a.{suffix}")


@pytest.mark.slow
class TestPrograms:
    def test_inkscape_opens_the_svg_at_its_size(self, tmp_path):
        program = shutil.which("inkscape")
        if program is None:
            pytest.skip("Inkscape is not installed")
        writers.write(Drawing((replace(PART, labels=(), notches=()),)), tmp_path / "a.svg")
        actions = "select-by-element:path;object-set-property:stroke,none;query-all"
        done = subprocess.run(
            [program, str(tmp_path / "a.svg"), f"--actions={actions}"],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        rows = [line.split(",") for line in done.stdout.splitlines() if line.startswith("CUT,")]
        # Inkscape counts 96 pixels to the inch.
        size = np.array(rows[0][3:5], float) * 25.4 / 96
        np.testing.assert_allclose(size, np.ptp(OUTLINE, axis=0), atol=0.01)

    def test_librecad_converts_the_dxf(self, tmp_path):
        program = shutil.which("librecad")
        if program is None:
            pytest.skip("LibreCAD is not installed")
        writers.write(Drawing((replace(PART, labels=(), notches=()),)), tmp_path / "a.dxf")
        # It draws in steps of 0.02 mm, so ten times as large.
        subprocess.run(
            [
                program,
                "dxf2pdf",
                "-s",
                "10",
                "-o",
                str(tmp_path / "a.pdf"),
                str(tmp_path / "a.dxf"),
            ],
            capture_output=True,
            timeout=120,
            check=True,
            env={"QT_QPA_PLATFORM": "offscreen", "HOME": str(tmp_path), "PATH": "/usr/bin:/bin"},
        )
        (page,) = pypdf.PdfReader(tmp_path / "a.pdf").pages
        drawn = page.get_contents().get_data().decode()
        step = float(re.search(r"([\d.]+) 0 0 -[\d.]+ 0 \d+ cm", drawn)[1]) / 72 * 25.4 / 10
        lines = re.findall(r"(-?[\d.]+) (-?[\d.]+) [ml]\n", drawn.split("SCN", 1)[1])
        size = np.ptp(np.array(lines, float), axis=0) * step
        want = np.ptp(OUTLINE, axis=0)
        # It rounds the page to whole points, which scales everything by the same factor.
        factor = float((size / want).mean())
        assert factor == pytest.approx(1.0, abs=5e-4)
        np.testing.assert_allclose(size / factor, want, atol=0.01)
