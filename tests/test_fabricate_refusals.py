"""What ``gso fabricate`` refuses, and files that it must not replace."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import GSOError, MeshError, OptionError
from gso.cli import main
from gso.mesh import Mesh, Nearest
from gso.verdict import Code
from gso.workshop import Design, FabricationSettings, Finish, Thickness, designs_of, made, thickened
from tests.conftest import codes
from tests.test_pieces import dome
from tests.test_workshop import arch, bent, parts_of

pytest.importorskip("ezdxf")
shapely = pytest.importorskip("shapely")


def small():
    """A quarter of a cylinder of radius 1 that is solved in no time."""
    return arch(17)


@pytest.fixture(scope="module")
def cylinder():
    return made(Design("arch", arch()), FabricationSettings())


@pytest.fixture(scope="module")
def folded_cylinder(cylinder):
    """The same panel, whose bends are folded as those of strips are."""
    return replace(cylinder, panels=tuple(replace(p, zone=0 * p.zone - 1) for p in cylinder.panels))


@pytest.fixture(scope="module")
def strips():
    return made(Design("dome", dome(17, height=0.6)), FabricationSettings(max_deviation="3%"))


class TestFolder:
    def test_files_of_others_are_not_replaced(self, tmp_path):
        (tmp_path / "parts").mkdir()
        with pytest.raises(OptionError, match="has parts, which gso fabricate did not write"):
            gso.fabricate(small(), tmp_path, workers=0)
        (tmp_path / "other").mkdir()
        (tmp_path / "other" / "certificate.json").write_text("{}")
        with pytest.raises(OptionError, match=r"has certificate\.json"):
            gso.fabricate(small(), tmp_path / "other", workers=0)

    def test_a_design_in_the_folder_is_not_replaced(self, tmp_path):
        (tmp_path / "surfaces").mkdir()
        gso.save(small(), tmp_path / "surfaces" / "arch.obj")
        with pytest.raises(OptionError, match=r"arch\.obj is in .*surfaces, whose files are"):
            gso.fabricate(tmp_path / "surfaces" / "arch.obj", tmp_path, workers=0)
        gso.save(small(), tmp_path / "arch.obj")
        (tmp_path / "surfaces" / "arch.obj").unlink()
        (tmp_path / "surfaces").rmdir()
        assert gso.fabricate(tmp_path / "arch.obj", tmp_path, unit="m", workers=0).usable

    def test_a_file_in_the_way_is_named(self, tmp_path):
        (tmp_path / "work").mkdir()
        (tmp_path / "parts").write_text("")
        with pytest.raises(OptionError, match="parts is a file"):
            gso.fabricate(small(), tmp_path, workers=0)

    def test_a_run_that_fails_leaves_no_good_certificate(self, tmp_path, monkeypatch):
        job = gso.fabricate(small(), tmp_path, unit="m", workers=0, formats=("svg",))
        assert job.usable

        def end(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr("gso.workshop.work.made", end)
        with pytest.raises(KeyboardInterrupt):
            gso.fabricate(dome(5), tmp_path, workers=0)
        said = json.loads((tmp_path / "certificate.json").read_text())
        assert not said["usable"] and [r["code"] for r in said["reasons"]] == ["unfinished"]
        monkeypatch.undo()
        # The drawings of the first run are known and deleted.
        gso.fabricate(dome(5, 0.05), tmp_path, unit="m", workers=0, formats=("dxf",))
        assert [p.suffix for p in (tmp_path / "parts").iterdir()] == [".dxf"] * len(job.parts)

    @pytest.mark.parametrize(
        "bad",
        [
            {"sheet": (100.0, 100.0), "spacing": -1.0},
            {"sheet": (100.0, 100.0), "rotations": "x"},
            {"sheet": (100.0, 100.0), "seconds": 0},
            {"sheet": (100.0, 100.0), "finish": Finish(allowance=60.0)},
            {"paper": "A9"},
            {"layers": "x"},
            {"holes": [[[0, 0, 0], [1, 0, 0], [1, 1, 0]]]},
            {"holes": [[[0.2, 0, 0], [0.3, 0, 0], [0.3, 0.1, 0], [0.2, 0.1, 0]]]},
            {"marks": [[[0.2, 0.2, 5.0], [0.3, 0.2, 5.0]]]},
            {"marks": [[[0.2, 0.2, 0.0]]]},
        ],
    )
    def test_wrong_options_are_refused_before_anything_is_made(self, tmp_path, monkeypatch, bad):
        monkeypatch.setattr("gso.workshop.work.made", None)
        with pytest.raises(GSOError):
            gso.fabricate(dome(5), tmp_path / "out", workers=0, **bad)
        assert not (tmp_path / "out").exists()


class TestNames:
    def test_names_that_are_spelled_alike_differ(self, tmp_path):
        for folder, name in (("a", "left wing"), ("b", "Left_wing"), ("c", "left wing-2")):
            (tmp_path / folder).mkdir()
            gso.save(small(), tmp_path / folder / f"{name}.obj")
        names = [d.name for d in designs_of(sorted(tmp_path.rglob("*.obj")))]
        assert len({name.casefold() for name in names}) == 3

    def test_parts_of_different_designs_have_files_of_their_own(self, tmp_path):
        gso.save(dome(9, 0.6), tmp_path / "panel.obj")
        gso.save(small(), tmp_path / "panel-1.obj")
        files = [tmp_path / "panel.obj", tmp_path / "panel-1.obj"]
        job = gso.fabricate(
            files, tmp_path / "out", unit="m", max_deviation="3%", formats=("svg",), workers=0
        )
        names = [part["name"] for d in job.certificate["designs"] for part in d["parts"]]
        assert len(names) > 2 and len({n.casefold() for n in names}) == len(names)
        assert len(set(job.files)) == len(job.files)
        assert all((tmp_path / "out" / "surfaces" / f"{n}.obj").exists() for n in names)

    def test_a_welded_file_keeps_its_name(self, tmp_path):
        gso.save(small(), tmp_path / "arch.obj")
        words = ["fabricate", str(tmp_path / "arch.obj"), "-o", str(tmp_path / "out")]
        done = CliRunner().invoke(main, [*words, "--weld", "1e-9", "--workers", "0", "-q"])
        assert done.exit_code == 0, done.output
        assert (tmp_path / "out" / "parts" / "arch.dxf").exists()


class TestSheets:
    """A cylinder of radius 1, and sheets with which it cannot be made."""

    @pytest.fixture
    def reasons_for(self, tmp_path, monkeypatch):
        def reasons(whole, **thickness):
            monkeypatch.setattr("gso.workshop.work.made", lambda *_: whole)
            finish = Finish(thickness=Thickness(**thickness))
            given = {"workers": 0, "finish": finish, "formats": ("svg",)}
            return gso.fabricate(
                small(), tmp_path / f"{len(list(tmp_path.iterdir()))}", **given
            ).reasons

        return reasons

    def test_a_thin_sheet_is_fine(self, cylinder, reasons_for):
        assert reasons_for(cylinder, sheet=0.02) == ()
        assert reasons_for(cylinder, sheet=0.002, radius=0.001) == ()

    def test_a_sheet_thicker_than_the_radius_is_refused(self, cylinder, reasons_for):
        (why,) = reasons_for(cylinder, sheet=2.5, face="outside")
        assert (why.code, why.bound, why.places.ids) == (Code.TOO_THICK, 2.5, ("arch",))
        assert why.value == pytest.approx(cylinder.record["bend_radius_min"])

    def test_a_bend_beyond_the_table_is_refused(self, cylinder, folded_cylinder, reasons_for):
        assert reasons_for(cylinder, sheet=0.01, table=[[0.0, 0.0], [1e-3, 1e-4]]) == ()
        (why,) = reasons_for(folded_cylinder, sheet=0.01, table=[[0.0, 0.0], [1e-3, 1e-4]])
        assert (why.code, why.bound) == (Code.BEND_ANGLE, pytest.approx(np.degrees(1e-3)))
        assert why.value == pytest.approx(np.degrees(np.abs(cylinder.panels[0].angles).max()))

    def test_bends_without_room_for_the_tool_are_refused(
        self, cylinder, folded_cylinder, reasons_for
    ):
        assert reasons_for(cylinder, sheet=0.02, radius=3.0) == ()
        (why,) = reasons_for(folded_cylinder, sheet=0.02, radius=3.0)
        assert why.code is Code.BENDS_NEAR and why.value < why.bound

    def test_a_part_without_bend_lines_is_refused_where_the_thickness_matters(self, reasons_for):
        # Not quite a cylinder, which would have bend lines.
        points = arch().vertices
        swelled = arch().replaced(points * (1 + 0.01 * np.sin(1.5 * points[:, 1:2]) * [1, 0, 1]))
        flat = made(Design("arch", swelled), FabricationSettings(formulation="curvature"))
        assert not len(flat.panels[0].bends)
        assert flat.record["bend_radius_min"] == pytest.approx(1.0, rel=0.05)
        assert reasons_for(flat, sheet=0.02) == ()
        (why,) = reasons_for(flat, sheet=0.02, face="outside")
        assert (why.code, why.bound) == (Code.NEUTRAL_STRAIN, 1e-3)
        assert why.value == pytest.approx(0.01, rel=0.05)
        (why,) = reasons_for(flat, sheet=2.5)
        assert (why.code, why.bound) == (Code.TOO_THICK, 1.25)

    def test_seams_that_the_thickness_parts_are_refused(self, strips, reasons_for):
        assert reasons_for(strips, sheet=1e-4, face="outside") == ()
        why = reasons_for(strips, sheet=0.05, face="outside")
        assert Code.SEAM_SIDES in codes(why)

    @pytest.mark.parametrize("formulation", ["curvature", "flatten"])
    def test_the_smallest_radius_counts_without_bend_lines(self, formulation):
        flat = made(
            Design("arch", arch()), FabricationSettings(formulation=formulation, min_radius=0.5)
        )
        assert not flat.reasons
        flat = made(
            Design("arch", arch()), FabricationSettings(formulation=formulation, min_radius=2.0)
        )
        (why,) = flat.reasons
        assert (why.code, why.bound) == (Code.BEND_RADIUS, 2.0)
        assert why.value == flat.record["bend_radius_min"] < 2.0

    def test_a_bend_has_the_radius_of_its_inner_face(self):
        panel = bent([0.1, -0.1])
        panel = replace(panel, radii=np.array([5.0, 5.0]))
        outside = Thickness(0.5, face="outside")
        np.testing.assert_allclose(thickened(panel, outside).radii, [4.5, 5.0])
        np.testing.assert_allclose(thickened(panel, Thickness(0.5, radius=0.7)).radii, 0.7)

    def test_notes_on_tight_bends_have_radii_of_the_surface(self, strips, tmp_path, monkeypatch):
        radius = min(panel.radii.min() for panel in strips.panels)
        # A design so large that its tightest bend is worth a note.
        record = strips.record | {"size": 1001.0 * radius}
        monkeypatch.setattr("gso.workshop.work.made", lambda *_: replace(strips, record=record))
        finish = Finish(thickness=Thickness(2.5 * radius))
        given = {"workers": 0, "finish": finish, "formats": ("svg",)}
        job = gso.fabricate(small(), tmp_path / "out", **given)
        (note,) = (note for note in job.certificate["notes"] if "tighter" in note)
        assert f"with radii from {radius:.3g} mm" in note
        # No inner radius is negative.
        parts = job.certificate["designs"][0]["parts"]
        assert min(part["bend_radius_min"] for part in parts) == 0.0
        assert min(bend.radius for part in job.parts for bend in part.bends) == 0.0

    def test_a_table_begins_at_no_bend(self):
        sheet = Thickness(2.0, face="outside", table=[[np.pi / 2, 4.0]])
        assert sheet.change(0.0) == pytest.approx(0.0)
        assert sheet.change(np.pi / 4) == pytest.approx(-2.0)


class TestLines:
    def test_a_mark_across_seams_reaches_them(self, strips):
        surface = Mesh(*_joined(strips))
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        ends = np.array([0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high])
        ends[:, 2] = high[2]
        t = np.linspace(0, 1, 200)[:, None]
        near = Nearest.of(surface.vertices, surface.triangles)
        line = near.locate(ends[0] + t * (ends[1] - ends[0]))[2]
        parts = parts_of(strips, 100.0, Finish(), [line])
        drawn_length = sum(
            np.linalg.norm(np.diff(m, axis=0), axis=1).sum() for p in parts for m in p.marks
        )
        size = 100.0 * np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        assert sum(bool(p.marks) for p in parts) > 1
        assert drawn_length == pytest.approx(size, rel=0.02)

    def test_a_hole_across_a_seam_is_refused(self, strips, tmp_path):
        seam = strips.matings[0]
        middle = seam.one.on(strips.panels[seam.one.panel].surface.vertices)[len(seam.along) // 2]
        turn = np.linspace(0, 2 * np.pi, 30)
        ring = middle + 0.05 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        design = dome(17, height=0.6)
        ring = Nearest.of(design.vertices, design.triangles).locate(ring)[2]
        ring[-1] = ring[0]
        with pytest.raises(OptionError, match="across a seam"):
            parts_of(strips, 100.0, Finish(), [], [ring])
        job = gso.fabricate(design, tmp_path, max_deviation="3%", holes=[ring], workers=0)
        assert not job.usable and Code.HOLE_ACROSS_SEAM in codes(job.reasons)

    def test_registration_holes_are_on_both_sides_of_a_seam(self, strips):
        finish = Finish(notches=None, registration=(1.0, 3.0), labels=None)
        parts = parts_of(strips, 100.0, finish)
        ends = np.array([[seam.one.panel, seam.two.panel] for seam in strips.matings])
        holes = np.array([len(part.holes) for part in parts])
        # A strip in the middle, and one on each of its sides.
        (middle,) = np.flatnonzero(np.bincount(ends.ravel()) == 2)
        outer = ends[ends != middle]
        assert len(outer) == len(ends) == 2 and (holes > 0).all()
        assert holes[outer].sum() == holes[middle]

    def test_a_part_narrower_than_the_kerf_is_refused(self, tmp_path):
        wide = gso.fabricate(small(), tmp_path, workers=0, formats=("svg",), finish=Finish(kerf=4))
        (why,) = wide.reasons
        flat = wide.parts[0].outline
        assert (why.code, why.bound) == (Code.NECK, 4.0)
        assert why.value == pytest.approx(np.ptp(flat, axis=0).min() - 4.0, abs=0.01)

    def test_a_hole_that_the_kerf_deletes_is_refused(self):
        with pytest.raises(OptionError, match="kerf"):
            Finish(kerf=1.0, registration=(1.0, 3.0))

    def test_small_bends_are_not_lost(self, cylinder):
        panel = bent(0.002 * np.random.default_rng(0).normal(size=200))
        (part,) = parts_of(replace(cylinder, panels=(panel,)), 1.0, Finish())
        assert 0 < len(part.bends) < 100
        assert sum(b.angle for b in part.bends) == pytest.approx(
            panel.angles.sum(), abs=np.radians(0.2)
        )


def _joined(whole):
    start = np.cumsum([0, *(len(p.flat) for p in whole.panels)])
    points = np.concatenate([p.surface.vertices for p in whole.panels])
    faces = [p.surface.triangles + k for p, k in zip(whole.panels, start[:-1], strict=True)]
    return points, np.concatenate(faces)


class TestCommand:
    @pytest.mark.parametrize(
        "words, said",
        [
            ("--k-factor 0.4", "--k-factor needs --thickness"),
            ("--bend-radius 2", "--bend-radius needs --thickness"),
            ("--spacing 5", "--spacing needs --sheet"),
            ("--sheet 100 100 --rotations x", "--rotations"),
        ],
    )
    def test_options_that_would_be_ignored_are_refused(self, tmp_path, words, said):
        gso.save(dome(5), tmp_path / "dome.obj")
        command = ["fabricate", str(tmp_path / "dome.obj"), "-o", str(tmp_path / "out")]
        done = CliRunner().invoke(main, [*command, *words.split()])
        assert done.exit_code == 1 and said in done.output

    @pytest.mark.parametrize("text", ["", "angle,deduction\n90,3\n", "90\n", "90,x\n"])
    def test_a_bad_bend_table_is_named(self, tmp_path, text):
        gso.save(dome(5), tmp_path / "dome.obj")
        (tmp_path / "table.csv").write_text(text)
        command = ["fabricate", str(tmp_path / "dome.obj"), "-o", str(tmp_path / "out")]
        more = ["--thickness", "2", "--bend-table", str(tmp_path / "table.csv")]
        done = CliRunner().invoke(main, [*command, *more])
        assert done.exit_code == 1 and "table.csv" in done.output
        assert "Traceback" not in done.output

    def test_bends_can_have_texts_and_pages_their_layers(self, tmp_path):
        gso.save(small(), tmp_path / "arch.obj")
        command = ["fabricate", str(tmp_path / "arch.obj"), "-o", str(tmp_path / "out")]
        more = "--unit m --format svg --format svg --format pdf --paper A0 --bend-text --workers 0"
        done = CliRunner().invoke(main, [*command, *more.split()])
        assert done.exit_code == 0, done.output
        assert "deg" in (tmp_path / "out" / "parts" / "arch.svg").read_text()
        page = (tmp_path / "out" / "index.html").read_text()
        assert "arch can be made" in page and "bend down, away from you" in page


@pytest.mark.parametrize("mesh", [arch(17), Mesh(arch(17).vertices, arch(17).triangles)])
def test_a_developable_design_keeps_a_distance_under_isometry(mesh):
    result = gso.tno.optimize(
        mesh, formulation="isometry", max_deviation=0.01 * mesh.diagonal, max_strain=1e-3
    )
    assert result.usable
    np.testing.assert_allclose(result.mesh.vertices, mesh.vertices, atol=0.01 * mesh.diagonal)


def test_an_unwritable_folder_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(MeshError, match="file"):
        gso.fabricate(small(), tmp_path / "file" / "out", workers=0)
