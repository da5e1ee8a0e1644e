"""Budgets, preferences and constraints of pieces in fabrications and strips."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import OptionError
from gso.cli import main
from gso.mesh import Mesh
from gso.verdict import Code
from gso.workshop import Design, FabricationSettings, made
from tests.conftest import codes
from tests.test_pieces import dome
from tests.test_seams import ball
from tests.test_workshop import arch

#: Over the ridge of the dome below.
RIDGE = [[-1, 0, 0], [-0.5, 0, 0.375], [0, 0, 0.5], [0.5, 0, 0.375], [1, 0, 0]]
QUICK = {"unit": "m", "workers": 0, "formats": ("svg",)}


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return dome(9, 0.5)


def share_on_ridge(parts) -> float:
    """The share of the vertices of the ridge that are on the rim of a panel."""
    ends = [panel.surface.vertices[np.unique(panel.rim)] for panel in parts.panels]
    points = np.unique(np.round(np.concatenate(ends), 6), axis=0)
    inner = points[np.abs(points[:, 0]) < 0.99]
    return int((np.abs(inner[:, 1]) < 1e-6).sum()) / 7


def test_seams_follow_and_avoid_lines(mesh):
    settings = FabricationSettings("flatten", max_strain=0.03)
    line = gso.seams.Polyline(RIDGE)
    along = made(Design("d", mesh, along=line.edges(mesh)), settings)
    away = made(Design("d", mesh, avoid=line.faces(mesh)), settings)
    assert share_on_ridge(along) > max(share_on_ridge(away), 0.6)


def test_budgets_that_are_not_held_are_reasons(mesh, tmp_path):
    budgets = {"max_pieces": 1, "min_size": 3.0, "min_neck": "50%"}
    job = gso.fabricate(mesh, tmp_path, **QUICK, formulation="flatten", max_strain=0.03, **budgets)
    assert set(codes(job.reasons)) == {Code.PIECES, Code.NECK, Code.TOO_SHORT}
    assert len(job.parts) > 1 and (tmp_path / "parts").is_dir()
    asked = json.loads((tmp_path / "certificate.json").read_text())["asked"]
    assert asked["max_pieces"] == 1 and asked["min_size"] == 3.0
    assert asked["min_neck"] == pytest.approx(0.5 * mesh.diagonal)


def test_constraints_hold_on_pieces(mesh):
    rim = np.flatnonzero(mesh.half_edges.boundary_vertex)
    settings = FabricationSettings("curvature", "2%", 0.01)
    constraints = (gso.FixedBoundary(), gso.Fixed([40]))
    one = made(Design("d", mesh, constraints=constraints), settings)
    assert not one.reasons and len(one.panels) > 1
    points = np.concatenate([panel.surface.vertices for panel in one.panels])
    away = np.linalg.norm(points[:, None] - mesh.vertices[[*rim, 40]], axis=2).min(axis=0)
    assert away.max() < 1e-8
    assert 0.0 < one.record["deviation_max"] <= one.record["allowed"]


def test_a_design_as_it_is_meets_its_constraints_or_changes():
    sheet = arch(17)
    settings = FabricationSettings("curvature", "5%", 0.01)
    held = made(Design("d", sheet, constraints=(gso.FixedBoundary(),)), settings)
    assert held.record["deviation_max"] == 0.0
    goal = sheet.vertices[:1] + np.array([0, 0, 0.02])
    moved = made(Design("d", sheet, constraints=(gso.Handle([0], goal),)), settings)
    points = moved.panels[0].surface.vertices
    assert np.linalg.norm(points - goal, axis=1).min() < 1e-8


def test_seams_are_searched_for_once(tmp_path):
    said = []
    # No body of revolution.
    design, allowed = Mesh(ball(10).vertices * [1.0, 1.2, 1.4], ball(10).faces), "5%"
    job = gso.fabricate(design, tmp_path, max_deviation=allowed, callback=said.append, **QUICK)
    assert job.usable, job.reasons
    assert sum(text.endswith("seams and shape, attempt 1") for text in said) == 1
    (record,) = job.certificate["designs"]
    assert record["pieces"] > 1 and record["deviation_max"] <= record["allowed"]


def test_preferences_without_effect_are_noted(tmp_path):
    line = arch(17).vertices[[4, 76]]
    job = gso.fabricate(arch(17), tmp_path, **QUICK, along=[line], symmetric=True)
    assert job.usable
    assert any("no seams were searched for, so that symmetric, along" in note
               for note in job.certificate["notes"])  # fmt: skip


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"constraints": [gso.FixedBoundary()], "formulation": "flatten"}, "flatten"),
        ({"constraints": [gso.FixedBoundary()], "cut": [[4, 5]]}, "constraints of strips"),
        ({"constraints": [gso.Fixed([999])]}, "names vertex 999"),
        ({"constraints": "all"}, "constraint 0 .* is none of those"),
        ({"along": [[[0, 0, 5], [1, 0, 5]]]}, "along, line 1: point . of a polyline is"),
        ({"avoid": [999]}, "avoid names face 999"),
        ({"max_pieces": 0}, "max_pieces is 0"),
        ({"min_neck": -1.0}, "min_neck"),
        ({"effort": "bets"}, "no effort 'bets'; did you mean 'best'"),
        ({"min_size": 3.0, "sheet": (1000, 500)}, "min_size is 3.0, more than the length"),
    ],
)
def test_wrong_options_are_refused(mesh, tmp_path, given, said):
    with pytest.raises(OptionError, match=said):
        gso.fabricate(mesh, tmp_path / "job", **QUICK, **given)
    assert not (tmp_path / "job").exists()


def test_places_are_on_one_design_and_constraints_on_one_component(mesh, tmp_path):
    for name in ("along", "avoid"):
        with pytest.raises(OptionError, match=f"{name} is about places of one design"):
            gso.fabricate([mesh, mesh], tmp_path, **QUICK, **{name: [RIDGE]})
    count = len(mesh.vertices)
    two = Mesh(
        np.concatenate([mesh.vertices, mesh.vertices + np.array([5.0, 0, 0])]),
        np.concatenate([mesh.faces, mesh.faces + count]),
    )
    with pytest.raises(OptionError, match="constraints are about one surface, and design has 2"):
        gso.fabricate(two, tmp_path, **QUICK, constraints=[gso.FixedBoundary()])


def test_seams_of_a_design_that_is_not_symmetric_are_refused(tmp_path):
    p = dome(9, 0.5).vertices.reshape(9, 9, 3)
    skew = p * (2.0 + p[..., :1] + 0.6 * p[..., 1:2])
    job = gso.fabricate(skew, tmp_path, **QUICK, formulation="flatten", symmetric=True)
    assert set(codes(job.reasons)) == {Code.FAILED}
    assert "symmetric: no plane of symmetry" in str(job.reasons[0])


def test_other_options_make_designs_again(tmp_path, monkeypatch):
    calls = []

    def count(*given):
        calls.append(given)
        return made(*given)

    monkeypatch.setattr("gso.workshop.work.made", count)
    sheet = arch(9)
    line = sheet.vertices[[4, 40]]
    several = (
        {}, {"max_pieces": 3}, {"min_neck": 0.1}, {"min_size": 0.1}, {"symmetric": True},
        {"effort": "draft"}, {"along": [line]}, {"avoid": [line]}, {"avoid": [0]},
        {"constraints": [gso.Fixed([0])]}, {"constraints": [gso.Fixed([1])]},
    )  # fmt: skip
    for number, given in enumerate(several, start=1):
        assert gso.fabricate(sheet, tmp_path, **QUICK, **given).usable
        assert len(calls) == number
    gso.fabricate(sheet, tmp_path, **QUICK, **several[-1])
    assert len(calls) == len(several)


def test_the_command_passes_on_what_is_asked_of_seams(mesh, tmp_path):
    gso.save(arch(17), tmp_path / "arch.obj")
    gso.io.save_lines([arch(17).vertices[[4, 76]]], tmp_path / "line.obj")
    (tmp_path / "held.json").write_text('[{"type": "Fixed", "ids": [0]}]')
    words = ["fabricate", "arch.obj", "-o", "job", "--unit", "m", "--format", "svg"]
    more = ["--max-pieces", "2", "--min-neck", "1mm", "--min-size", "1%", "--symmetric"]
    more += ["--along", "line.obj", "--avoid", "line.obj", "--effort", "draft"]
    more += ["--constraints", "held.json", "--workers", "0"]
    words = [str(tmp_path / w) if w in ("arch.obj", "job") else w for w in words]
    more = [str(tmp_path / w) if w in ("line.obj", "held.json") else w for w in more]
    done = CliRunner().invoke(main, [*words, *more])
    assert done.exit_code == 0, done.output
    asked = json.loads((tmp_path / "job" / "certificate.json").read_text())["asked"]
    assert (asked["max_pieces"], asked["min_neck"], asked["effort"]) == (2, 0.001, "draft")
    assert asked["symmetric"] and asked["constraints"] == [{"type": "Fixed", "ids": [0]}]
    done = CliRunner().invoke(main, [*words, "--min-size", "9m"])
    assert done.exit_code == 1 and "not usable" in done.output


def test_strips_take_budgets_and_places_of_seams(mesh):
    whole = gso.strips(arch(17), max_deviation="1%", seams_along=[arch(17).vertices[[4, 76]]])
    assert whole.usable and "so that seams_along had no effect" in whole.notes[-1]
    with pytest.warns(gso.ConvergenceWarning):
        long = gso.strips(arch(17), max_deviation="1%", min_size=9.0, min_neck=3.0)
    assert {reason.code for reason in long.reasons} == {Code.TOO_SHORT, Code.NECK}
    for given in ({"strips": 3}, {"constraints": [gso.FixedBoundary()]}, {"along": "x"}):
        with pytest.raises(OptionError, match="symmetric is about seams that are searched for"):
            gso.strips(mesh, max_deviation="1%", symmetric=True, **given)
    with pytest.raises(OptionError, match="seams_along is about seams"):
        gso.strips(mesh, seams_along=[RIDGE])
    with pytest.raises(OptionError, match="seams_along, line 1"):
        gso.strips(mesh, seams_along=[[[0, 0, 5], [1, 0, 5]]])


def test_boundary_constraints_of_pieces_leave_seams_free(mesh):
    halves = gso.cut(mesh, gso.seams.Path([36, 44]))
    result = gso.tno.optimize(halves, constraints=[gso.FixedBoundary()], verdict=False)
    moved = np.linalg.norm(result.pieces.design.vertices - mesh.vertices, axis=1)
    rim = mesh.half_edges.boundary_vertex
    assert moved[rim].max() < 1e-9 < moved[37:44].max()
