"""From designs to a folder: files, certificate, resuming, copies, the command."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import shapely
from click.testing import CliRunner

import gso
from gso import GSOError, MeshError, OptionError
from gso.cli import main
from gso.mesh import Mesh
from gso.verdict import Code, describe
from gso.workshop import Finish, Thickness, made
from tests.test_pieces import dome
from tests.test_workshop import arch

ezdxf = pytest.importorskip("ezdxf")


def row(count=3, apart=3.0):
    """Copies of an arch side by side, and one other panel."""
    one = arch(33)
    n = len(one.vertices)
    step = np.array([apart, 0.0, 0.0])
    points = [one.vertices + k * step for k in range(count)]
    other = arch(33, turn=1.0).vertices + count * step
    faces = np.concatenate([one.faces + n * k for k in range(count + 1)])
    return Mesh(np.concatenate([*points, other]), faces)


def drawn(path):
    """Outlines of a DXF drawing, as an independent reader sees them."""
    document = ezdxf.readfile(path)
    lines = document.modelspace().query('LWPOLYLINE[layer=="CUT"]')
    assert all(line.closed for line in lines)
    return [np.array(line.get_points("xy")) for line in lines]


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    return gso.fabricate(row(), folder, unit="m", workers=0, finish=Finish(kerf=0.2))


class TestFiles:
    def test_copies_are_made_once_and_counted(self, job):
        assert job.usable
        assert [part.count for part in job.parts] == [3, 1]
        assert job.certificate["parts"] == 4
        assert len(job.certificate["designs"][0]["copies"]) == 3

    def test_drawings_have_the_dimensions_of_the_certificate(self, job):
        for part in (p for d in job.certificate["designs"] for p in d["parts"]):
            (outline,) = drawn(job.folder / "parts" / f"{part['name']}.dxf")
            np.testing.assert_allclose(
                np.ptp(outline, axis=0), [part["length"], part["width"]], rtol=1e-6
            )
            assert shapely.Polygon(outline).area == pytest.approx(part["area"], rel=1e-6)
            text = (job.folder / "parts" / f"{part['name']}.svg").read_text()
            wide, high = (
                float(x) for x in re.search(r'viewBox="\S+ \S+ (\S+) (\S+)"', text).groups()
            )
            assert wide >= part["length"] and high >= part["width"]

    def test_the_certificate_says_what_was_asked_and_measured(self, job):
        said = json.loads((job.folder / "certificate.json").read_text())
        assert said["usable"] and said["unit"] == "mm"
        assert said["versions"]["numpy"] == np.__version__
        for design in said["designs"]:
            assert design["deviation_max"] <= design["allowed"]
            assert len(design["digest"]) == 64
            assert len(design["deviation_at"]) == 3
            for name in ("strain_p99", "strain_max", "curvature", "planarity_max", "overlaps"):
                assert name in design
        assert set(said["files"]) == {
            p.relative_to(job.folder).as_posix()
            for p in job.folder.rglob("*")
            if p.is_file() and p.parent.name != "work"
        }
        page = (job.folder / "index.html").read_text()
        assert "can be made as it was asked for" in page
        assert "http" not in page.replace("http://www.w3.org", "")

    def test_kerf_widens_the_part(self, tmp_path):
        plain = gso.fabricate(arch(33), tmp_path, unit="m", workers=0, formats=("svg",))
        wide = gso.fabricate(
            arch(33), tmp_path, unit="m", workers=0, formats=("svg",), finish=Finish(kerf=0.5)
        )
        # Slanted corners are mitred.
        np.testing.assert_allclose(wide.parts[0].size, np.add(plain.parts[0].size, 0.5), atol=0.02)


class TestRuns:
    def test_a_run_that_was_ended_goes_on(self, tmp_path, monkeypatch):
        calls = []

        def count(name, *rest):
            calls.append(name)
            if len(calls) == 2 and not done:
                raise KeyboardInterrupt
            return made(name, *rest)

        done = []
        monkeypatch.setattr("gso.workshop.work.made", count)
        with pytest.raises(KeyboardInterrupt):
            gso.fabricate(row(), tmp_path, unit="m", workers=0)
        done.append(True)
        job = gso.fabricate(row(), tmp_path, unit="m", workers=0)
        assert job.usable and len(calls) == 3
        # The same again needs no solve, another request does.
        again = gso.fabricate(row(), tmp_path, unit="m", workers=0)
        assert len(calls) == 3
        for one, two in zip(job.parts, again.parts, strict=True):
            np.testing.assert_allclose(one.outline, two.outline, atol=1e-9)
        assert again.reasons == job.reasons
        gso.fabricate(row(), tmp_path, unit="m", workers=0, max_deviation=0.1)
        assert len(calls) == 5
        for path in (tmp_path / "work").glob("*.npz"):
            path.write_bytes(b"damaged")
        assert gso.fabricate(row(), tmp_path, unit="m", workers=0, max_deviation=0.1).usable
        assert len(calls) == 7

    def test_files_of_an_earlier_run_are_deleted(self, tmp_path):
        gso.fabricate(row(), tmp_path, unit="m", workers=0)
        (tmp_path / "parts" / "mine.dxf").write_text("mine")
        gso.fabricate(arch(33), tmp_path, unit="m", workers=0, formats=("svg",))
        left = sorted(p.name for p in (tmp_path / "parts").iterdir())
        assert left == ["design.svg", "mine.dxf"]

    @pytest.mark.slow
    def test_processes_give_the_same_as_one(self, tmp_path, job):
        again = gso.fabricate(row(), tmp_path, unit="m", workers=2, finish=Finish(kerf=0.2))
        for one, two in zip(job.parts, again.parts, strict=True):
            np.testing.assert_allclose(one.outline, two.outline, atol=1e-9)

    @pytest.mark.slow
    def test_a_cluster_gives_the_same_as_one_process(self, tmp_path, job):
        distributed = pytest.importorskip("distributed")
        with distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster:
            address = cluster.scheduler_address
            again = gso.fabricate(
                row(), tmp_path, unit="m", scheduler=address, finish=Finish(kerf=0.2)
            )
        for one, two in zip(job.parts, again.parts, strict=True):
            np.testing.assert_allclose(one.outline, two.outline, atol=1e-9)

    def test_what_cannot_be_made_is_refused_with_the_numbers(self, tmp_path, monkeypatch):
        thick = Finish(thickness=Thickness(50.0))
        job = gso.fabricate(dome(9, 1.0), tmp_path, max_deviation=1e-6, workers=0, finish=thick)
        assert not job.usable
        (design,) = job.certificate["designs"]
        why = next(r for r in job.reasons if r.code is Code.DEVIATION)
        assert (why.value, why.bound) == (design["deviation_max"], design["allowed"])
        assert why.bound == pytest.approx(1e-6) and why.value > why.bound
        page = (tmp_path / "index.html").read_text()
        assert job.parts and "cannot be made" in page
        # Every place shows all reasons, with the same words.
        said = [describe(reason, "mm") for reason in job.reasons]
        assert len(said) > 1 and said == [r["text"] for r in job.certificate["reasons"]]
        assert all(f"<li>{html.escape(text)}</li>" in page for text in said)
        gso.save(dome(5), tmp_path / "dome.obj")
        monkeypatch.setattr("gso.workshop.fabricate.fabricate", lambda *_, **__: job)
        words = ["fabricate", str(tmp_path / "dome.obj"), "-o", str(tmp_path / "out")]
        done = CliRunner().invoke(main, words)
        told = done.output.splitlines()[-len(said) :]
        assert told == [f"not usable: {text}" for text in said]

    @pytest.mark.parametrize(
        "bad",
        [
            {"unit": "furlong"},
            {"formulation": "x"},
            {"formats": ("doc",)},
            {"max_deviation": -1},
            {"max_strips": 0},
            {"finish": "x"},
            {"sheet": (100.0,)},
            {"sheet": (-1.0, 5.0)},
            {"marks": [[1, 2]]},
        ],
    )
    def test_wrong_options_are_refused(self, tmp_path, bad):
        with pytest.raises(GSOError):
            gso.fabricate(dome(5), tmp_path, workers=0, **bad)

    def test_a_missing_file_is_named(self, tmp_path):
        with pytest.raises(MeshError, match=r"nothing\.obj"):
            gso.fabricate(tmp_path / "nothing.obj", tmp_path / "out")
        (tmp_path / "file").write_text("")
        with pytest.raises((MeshError, OptionError)):
            gso.fabricate(dome(5), tmp_path / "file")


class TestCommand:
    def test_it_writes_a_folder(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        gso.save(dome(7, 0.2), "dome.obj")
        words = "fabricate dome.obj -o out --unit m --max-deviation 0.05 --thickness 2 --workers 0"
        more = "--holes 3 8 --format dxf --layers astm --paper A4"
        done = CliRunner().invoke(main, [*words.split(), *more.split()])
        assert done.exit_code == 0, done.output
        assert "page to look at" in done.output
        assert (tmp_path / "out" / "parts.pdf").stat().st_size > 0
        shutil.rmtree(tmp_path / "out")
        gso.save(dome(5, 0.2), "dome.obj")
        most = ("--max-deviation", "1e-7", "--max-strips", "4")
        done = CliRunner().invoke(main, [*words.split(), *most])
        assert done.exit_code == 1
        assert "no: deviation, strain" in done.output
        assert done.output.count("not usable: ") == 2

    def test_a_bend_table_is_read(self, tmp_path):
        gso.save(arch(33), tmp_path / "arch.obj")
        (tmp_path / "table.csv").write_text("30,1.1\n90,3.4\n")
        words = ["fabricate", str(tmp_path / "arch.obj"), "-o", str(tmp_path / "out")]
        table = ["--unit", "m", "--thickness", "2", "--workers", "0", "--bend-table"]
        done = CliRunner().invoke(main, [*words, *table, str(tmp_path / "table.csv")])
        assert done.exit_code == 0, done.output
        (tmp_path / "table.csv").write_text("a,b,c\n")
        done = CliRunner().invoke(main, [*words, *table, str(tmp_path / "table.csv")])
        assert done.exit_code == 1
        assert "table.csv" in done.output


@pytest.mark.slow
def test_a_hemisphere_is_made_of_its_gores(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[1] / "examples"))
    import gores

    gores.write(tmp_path / "dome.obj")
    job = gso.fabricate(tmp_path / "dome.obj", tmp_path / "out", keep_groups=True, workers=0)
    assert job.usable and len(job.parts) == 12
    sizes = np.array([part.size for part in job.parts])
    np.testing.assert_allclose(sizes, sizes[:1] + 0 * sizes, rtol=2e-3)
    # A quarter of a great circle, and a twelfth of the equator.
    np.testing.assert_allclose(sizes[0], [250 * np.pi, 500 * np.pi / 6], rtol=0.02)
    (design,) = job.certificate["designs"]
    assert design["seams"] == 12
    assert design["seam_mismatch_max"] <= 1e-6 * design["diagonal"]


def test_groups_that_a_file_lacks_are_named(tmp_path):
    gso.save(dome(5), tmp_path / "dome.obj")
    with pytest.raises(MeshError, match="no groups"):
        gso.fabricate(tmp_path / "dome.obj", tmp_path / "out", keep_groups=True, workers=0)


def test_the_certificate_says_on_which_sheets_parts_lie(tmp_path):
    # Three plates, two of which are alike, on sheets that have room for one.
    plates = [
        Mesh([[x, 0, 0], [x + long, 0, 0], [x + long, 40, 0], [x, 40, 0]], [[0, 1, 2, 3]])
        for x, long in ((0, 90), (100, 80), (200, 90))
    ]
    job = gso.fabricate(
        plates, tmp_path, sheet=(100.0, 50.0), workers=0, formats=("svg",), seconds=1
    )
    parts = [part for one in job.certificate["designs"] for part in one["parts"]]
    for part in parts:
        assert len(part["sheets"]) == part["count"]
        drawn = part["same_as"] or part["name"]
        for number in part["sheets"]:
            assert [one.name for one in job.sheets[number - 1].parts] == [drawn]
    assert sorted(number for part in parts for number in part["sheets"]) == [1, 2, 3]
    assert (
        json.loads((tmp_path / "certificate.json").read_text())["designs"][0]["parts"]
        == (job.certificate["designs"][0]["parts"])
    )
    bare = gso.fabricate(plates[0], tmp_path / "bare", workers=0, formats=("svg",))
    assert bare.certificate["designs"][0]["parts"][0]["sheets"] == []


@pytest.mark.slow
def test_a_design_larger_than_a_sheet_is_cut_to_fit(tmp_path):
    pytest.importorskip("spyrrow")
    design = dome(11, 0.2)
    job = gso.fabricate(
        design, tmp_path, unit="m", sheet=(1600.0, 1600.0), workers=0, formats=("svg",), seconds=2
    )
    assert job.usable
    assert len(job.parts) > 1 and job.sheets
    for part in job.parts:
        assert max(part.size) <= 1600.0
