"""Strips of designs: one way for all callers, as a whole or in pieces."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso.cli import main
from gso.components import split
from gso.mesh import Mesh
from gso.result import StripsResult
from gso.ruled.paneling import LightDesign
from gso.seams import rectangle
from gso.workshop import Design, FabricationSettings
from gso.workshop import made as workshop_made
from tests.conftest import cylinder, saddle
from tests.test_pieces import ball, dome

FAST = {"options": "fast"}


def cap(count: int = 11) -> Mesh:
    """A dome that one strip does not follow within 2 % of its diagonal, and three do."""
    u, v = np.meshgrid(*[np.linspace(-1.0, 1.0, count)] * 2, indexing="ij")
    return gso.as_mesh(np.stack([u, v, 0.5 - 0.25 * (u * u + v * v)], axis=-1))


def areas(result: gso.Result) -> np.ndarray:
    """Areas of the parts of the pattern, in order."""
    return np.sort([part.area for part in split(result.pattern.mesh)])


@pytest.fixture(scope="module")
def made():
    """Strips of a dome within 2 %, and that distance."""
    design = cap()
    allowed = 0.02 * design.diagonal
    return gso.strips(design, max_deviation=allowed), allowed


@pytest.fixture(scope="module")
def pieces():
    """Strips of a closed surface, which is cut into pieces, and the distance allowed."""
    # No body of revolution.
    design = Mesh(ball(10).vertices * [1.0, 1.2, 1.4], ball(10).faces)
    allowed = 0.05 * design.diagonal
    return gso.strips(design, max_deviation=allowed), allowed


def ways(design: Mesh, allowed: float):
    yield gso.tno.optimize(design, formulation="ruled", max_deviation=allowed)
    yield gso.tno.optimize(design, options=gso.RuledOptions(), max_deviation=allowed)
    for darts in (True, False):
        found = gso.pieces(design, max_strain=1e-3, max_deviation=allowed, darts=darts)
        yield gso.strips(found, max_deviation=allowed)


def test_all_ways_give_the_same_strips_and_one_verdict(made, tmp_path):
    wanted, allowed = made
    assert wanted.usable and wanted.pieces is None
    assert 1 < wanted.ruled.strips < 6
    assert wanted.ruled.farthest <= allowed
    for other in ways(wanted.design, allowed):
        assert (other.usable, other.reasons, other.status) == (True, (), wanted.status)
        np.testing.assert_array_equal(other.mesh.vertices, wanted.mesh.vertices)
        np.testing.assert_array_equal(other.pattern.flat, wanted.pattern.flat)
        assert other.metrics == wanted.metrics
    # Parts that differ by less than a cutter can tell are the same, so that the unit matters.
    asked = {"max_deviation": allowed, "unit": "m", "formats": ("svg",), "workers": 0}
    job = gso.fabricate(wanted.design, tmp_path, **asked)
    assert job.usable
    (record,) = job.certificate["designs"]
    assert record["strips"] == [wanted.ruled.strips]
    assert record["deviation_max"] == pytest.approx(1e3 * wanted.ruled.farthest, rel=1e-12)
    made_areas = np.sort([part.area for part in job.parts])
    np.testing.assert_allclose(made_areas, 1e6 * areas(wanted), rtol=1e-9)


def test_a_closed_design_is_cut_into_pieces_without_darts(pieces, tmp_path):
    result, allowed = pieces
    assert isinstance(result, StripsResult)
    assert result.usable, result.reasons
    numbers = result.details["strips"]
    assert len(result.pieces) == len(numbers) > 1
    assert (result.pieces.sides[:, 0] != result.pieces.sides[:, 1]).all()
    assert result.ruled.strips == sum(max(n, 1) for n in numbers)
    assert result.details["seam_gap"] <= allowed
    away = gso.metrics.surface_distance(result.design, result.mesh)
    assert away.there_max <= result.ruled.farthest * (1 + 1e-9) <= allowed
    # Its vertices are those of the design, in their order.
    assert result.on_design().vertices.shape == result.design.vertices.shape
    assert gso.metrics.point_to_surface(result.on_design().vertices, result.mesh).max() < 1e-9
    owner = result.piece_of_face
    assert np.unique(owner).tolist() == list(range(len(numbers)))
    strained = max(result.metrics["strain_max"], 0.0)
    assert strained < (1e-6 if all(numbers) else 0.01)
    result.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    assert isinstance(again, StripsResult)
    assert again.usable and len(again.pieces) == len(numbers)
    np.testing.assert_array_equal(again.pieces.opened.seams, result.pieces.opened.seams)
    np.testing.assert_array_equal(again.on_design().vertices, result.on_design().vertices)
    assert again.metrics == pytest.approx(result.metrics)


def test_both_sides_of_a_seam_are_the_same():
    halves = gso.cut(dome(9, height=0.3), gso.seams.Path([4, 76]))
    result = gso.strips(halves, max_deviation="3%", **FAST)
    assert result.usable, result.reasons
    assert result.details["strips"] == [1, 1] and result.details["seam_gap"] == 0
    pattern, points = result.pattern, result.mesh.vertices
    label = pattern.mesh.components[pattern.seams[:, :, 0]]
    assert (label[:, 0] != label[:, 1]).all()
    # The seam runs from end to end of the design, without a gap.
    ends = points[pattern.vertex[pattern.seams[:, 0]]]
    assert np.ptp(ends.reshape(-1, 3), axis=0).max() > 0.95 * np.ptp(points, axis=0).max()
    sides = np.linalg.norm(np.diff(pattern.flat[pattern.seams], axis=2)[:, :, 0], axis=2)
    np.testing.assert_allclose(sides[:, 0], sides[:, 1], rtol=1e-9)
    # Both parts have lines to bend along, and no vertex inside.
    owner = pattern.mesh.components[result.folded.edges[:, 0]]
    assert len(np.unique(owner)) == 2
    assert pattern.mesh.half_edges.boundary_vertex.all()


def test_pieces_of_a_cylinder_are_bent_along_its_rulings():
    design = gso.as_mesh(cylinder(17))
    halves = gso.cut(design, gso.seams.Path([5, 17 * 17 - 7]))
    result = gso.strips(halves, max_deviation="1%")
    assert result.usable, result.reasons
    ends = result.mesh.vertices[result.ruled.rulings.edges]
    way = ends[:, 1] - ends[:, 0]
    long = np.linalg.norm(way, axis=1)
    bent = np.abs(result.ruled.rulings.angles) > np.radians(1.0)
    off = np.degrees(np.arccos(np.clip(np.abs(way[:, 1]) / long, 0.0, 1.0)))
    assert np.average(off[bent], weights=long[bent]) < 5.0


def test_parts_fit_the_sheet():
    design = cap()
    wanted = gso.strips(design, max_deviation="2%", **FAST)
    sheet = (0.5 * design.diagonal, 0.25 * design.diagonal)
    result = gso.strips(design, max_deviation="2%", sheet=sheet, **FAST)
    assert result.usable, result.reasons
    parts = split(result.pattern.mesh)
    sizes = np.array([rectangle(result.pattern.flat[part.vertices])[1] for part in parts])
    assert (sizes.max(axis=0) <= np.array(sheet) * (1 + 1e-9)).all()
    assert len(parts) == result.details["strips"] == result.ruled.strips > wanted.ruled.strips
    assert result.metrics["strain_max"] < 1e-9
    # They are next to each other, and all of the surface.
    whole = sum(part.area for part in split(result.mesh))
    assert sum(part.area for part in parts) == pytest.approx(whole, rel=1e-9)


def test_pieces_on_a_sheet_keep_their_numbers():
    t = np.linspace(0.0, np.pi / 2, 17)
    arch = gso.as_mesh(np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), 2 * t[:, None]), axis=-1))
    halves = gso.cut(arch, gso.seams.Path([8 * 17, 8 * 17 + 16]))
    result = gso.strips(halves, max_deviation="1%", sheet=(1.7, 0.7), **FAST)
    assert result.usable, result.reasons
    parts = split(result.pattern.mesh)
    numbers = result.details["strips"]
    assert len(numbers) == 2 and sum(numbers) == len(parts) == result.ruled.strips > 2
    assert np.bincount(result.piece_of_face[[part.faces[0] for part in parts]]).tolist() == numbers
    sizes = np.array([rectangle(result.pattern.flat[part.vertices])[1] for part in parts])
    assert (sizes.max(axis=0) <= np.array([1.7, 0.7]) * (1 + 1e-9)).all()


def test_a_closed_design_needs_a_distance():
    with pytest.raises(gso.MeshError, match=r"boundary.*max_deviation"):
        gso.strips(ball(16))


def test_given_pieces_stay_and_one_piece_is_the_whole():
    design = dome(9, height=0.3)
    middle = gso.cut(design, gso.seams.Path([4, 76]))
    allowed = 0.05 * design.diagonal
    halves = gso.strips(middle, max_deviation=allowed, **FAST)
    assert len(halves.pieces) == 2
    assert len(halves.details["strips"]) == 2
    named = gso.strips(middle, strips=2, **FAST)
    assert named.details["strips"] == [2, 2] and named.ruled.strips == 4
    # A dart divides nothing.
    dart = gso.cut(design, gso.seams.Path([4, 40]))
    assert len(dart) == 1
    one, whole = (gso.strips(d, max_deviation=allowed, **FAST) for d in (dart, design))
    assert one.pieces is None
    np.testing.assert_array_equal(one.mesh.vertices, whole.mesh.vertices)


def test_edges_that_are_kept_are_cut():
    design = cap(9)
    kept = gso.cut(design, gso.seams.Path([4, 76])).edges
    whole = workshop_made(
        Design("cap", design, kept=kept), FabricationSettings(max_deviation=0.05 * design.diagonal)
    )
    assert len(whole.panels) >= 2
    sides = [seam.one for seam in whole.matings]
    ends = np.concatenate([s.on(whole.panels[s.panel].surface.vertices) for s in sides])
    assert np.abs(ends[:, 1]).min() < 0.05


def test_a_named_number_of_strips_is_not_exceeded():
    design = cap(11)
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.strips(design, strips=1, max_deviation=1e-4, **FAST)
    assert result.ruled.strips == 1 and result.pieces is None
    assert result.status is gso.Status.TARGET_MISSED


def test_the_closest_is_returned_where_nothing_holds():
    design = cap(9)
    allowed = 1e-5 * design.diagonal
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.strips(design, max_deviation=allowed, max_strips=2, **FAST)
    assert not result.usable and result.reasons
    with pytest.warns(gso.ConvergenceWarning):
        whole = gso.strips(design, strips=2, max_deviation=allowed, **FAST)
    assert result.ruled.farthest <= whole.ruled.farthest


def test_parts_have_to_fit_on_the_sheet():
    design = gso.as_mesh(cylinder(17, turn=0.4))
    allowed = 0.02 * design.diagonal
    free = gso.strips(design, max_deviation=allowed, **FAST)
    assert free.usable
    long, wide = rectangle(free.pattern.flat)[1]
    enough = gso.strips(design, max_deviation=allowed, sheet=(1.5 * long, 1.5 * wide), **FAST)
    np.testing.assert_array_equal(enough.mesh.vertices, free.mesh.vertices)
    cut = gso.strips(design, max_deviation=allowed, sheet=(0.8 * long, 1.5 * wide), **FAST)
    assert cut.usable, cut.reasons
    assert cut.details["strips"] == len(split(cut.pattern.mesh)) > 1
    with pytest.warns(gso.ConvergenceWarning):
        one = gso.strips(design, strips=1, sheet=(0.1 * long, wide), **FAST)
    assert gso.verdict.Code.TOO_LONG in [why.code for why in one.reasons]


def test_large_designs_are_decimated_and_measured_as_they_are():
    u, v = np.meshgrid(*[np.linspace(-1.0, 1.0, 81)] * 2, indexing="ij")
    design = gso.as_mesh(np.stack([u, v, 0.3 * u * u + 0.03 * v * v], axis=-1))
    allowed = 0.02 * design.diagonal
    light = LightDesign.of(design, allowed)
    assert 2 * len(light.mesh.triangles) <= len(design.triangles)
    assert LightDesign.of(design, allowed, named=True).mesh is design
    result = gso.strips(design, max_deviation=allowed, **FAST)
    assert result.usable and result.design is design
    assert result.on_design().grid.shape == (81, 81, 3)
    again = result.ruled.distances(design)
    assert result.ruled.farthest == max(again.there_max, again.back_max) <= allowed


def test_a_callback_ends_strips_of_pieces():
    seen = []

    def watch(progress):
        seen.append(progress.name)
        return not progress.name.startswith("piece 1")

    halves = gso.cut(dome(9, height=0.3), gso.seams.Path([4, 76]))
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.strips(halves, callback=watch, **FAST)
    assert result.status is gso.Status.CANCELLED
    assert result.ruled is None and not result.usable
    assert seen[-1].startswith("piece 1")


@pytest.mark.parametrize(
    "wrong", [{"strips": 0}, {"max_deviation": -1.0}, {"max_strain": 0.0}, {"rulings": 3}]
)
def test_wrong_options_are_refused(wrong):
    with pytest.raises(gso.OptionError):
        gso.strips(saddle(9), **wrong)


def test_constraints_hold_and_nothing_is_cut():
    mesh = gso.as_mesh(saddle(11, strength=0.3))
    beam = gso.Ruling([55, 65])
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.strips(mesh, max_deviation=1e-5, max_strips=2, constraints=[beam], **FAST)
    assert result.pieces is None
    (missed,) = result.details["constraints"].values()
    assert missed < 1e-6 * mesh.diagonal


def test_the_command_makes_the_same_strips(tmp_path):
    design = cap(9)
    gso.save(design, tmp_path / "cap.obj")
    files = [str(tmp_path / name) for name in ("cap.obj", "out.npz")]
    run = CliRunner().invoke(
        main, ["strips", files[0], "-o", files[1], "--strips", "2", "--options", "fast"]
    )
    assert run.exit_code == 0, run.output
    made, wanted = gso.Result.load(files[1]), gso.strips(files[0], strips=2, **FAST)
    np.testing.assert_array_equal(made.pattern.flat, wanted.pattern.flat)
    wrong = CliRunner().invoke(main, ["strips", files[0], "-o", files[1], "--strips", "few"])
    assert wrong.exit_code == 1 and "it must be a number, 'auto' or None" in wrong.output


@pytest.mark.parametrize("asked", [{}, {"strips": 2}, {"strips": "auto", "max_crease": 20.0}])
def test_several_components_are_refused_before_any_solve(asked, monkeypatch):
    def begin(*args, **keywords):
        raise AssertionError("the solve began")

    for name in ("strip_ways.exact_strips", "strip_ways.LightDesign.of", "surface_strips.solve"):
        monkeypatch.setattr(f"gso.ruled.paneling.{name}", begin)
    one = cap()
    count = len(one.vertices)
    points = np.concatenate([one.vertices + 3.0 * k * np.eye(3)[0] for k in range(3)])
    mesh = Mesh(points, np.concatenate([one.faces + count * k for k in range(3)]))
    with pytest.raises(gso.MeshError, match=r"3 components: .*gso\.fabricate"):
        gso.strips(mesh, **asked)
