"""Results are usable when they are what was asked for; otherwise there is a reason."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import Pattern, Status, metrics, tasks, verdict
from gso.cli import main
from gso.dataset import generate
from gso.mesh import Mesh
from gso.pipeline import add_verdict, lay_out
from gso.result import headline
from gso.tasks import Limits
from gso.verdict import Code
from tests.conftest import codes, cylinder, saddle, shuffled

pytestmark = pytest.mark.filterwarnings("ignore::gso.ConvergenceWarning")

FLAT = np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))])


def result_of(design, after, task="developable", **more):
    """A result as a solver would leave it that says all is well."""
    design = design if isinstance(design, Mesh) else Mesh.from_grid(design)
    mesh = design.replaced(np.asarray(after).reshape(-1, 3))
    more = {"flat": None, "status": Status.CONVERGED} | more
    return gso.Result(task, "", design, mesh, **more)


def tried(design, after, task="developable", limits=Limits(), violation=0.0, **more):  # noqa: B008
    with np.errstate(all="raise", under="ignore"):
        return add_verdict(result_of(design, after, task, **more), limits, violation)


@pytest.fixture(scope="module")
def good():
    return gso.tno.optimize(saddle(17, strength=0.1))


def test_a_good_result_has_no_reasons(good):
    assert good.usable and good.reasons == ()
    assert good.status is not Status.UNUSABLE
    assert {"pattern", "verdict"} <= set(good.seconds)
    assert good.pattern.flat.shape == (289, 2) and good.flat is None


def test_strain_is_that_of_the_pattern_and_comes_first(good):
    assert next(iter(good.metrics)) == "strain_max"
    values = metrics.principal_strains(good.mesh, good.pattern.flat).values
    assert good.metrics["strain_max"] == values.max()
    assert 0 < good.metrics["strain_mean"] < good.metrics["strain_p99"] < values.max() < 0.01
    assert good.details["verdict"]["strain_max"] == pytest.approx(values.max())


def test_without_a_verdict_nothing_is_judged_or_laid_out(good):
    plain = gso.tno.optimize(saddle(17, strength=0.1), verdict=False)
    assert plain.pattern is None and plain.reasons == () and "strain_max" not in plain.metrics
    assert not {"pattern", "verdict"} & set(plain.seconds)
    np.testing.assert_array_equal(plain.mesh.vertices, good.mesh.vertices)


def test_reasons_and_pattern_are_saved(tmp_path):
    result = gso.tno.optimize(saddle(9), max_deviation=0.01)
    assert result.status is Status.UNUSABLE and not result.converged
    assert codes(result.reasons) == [Code.STRAIN]
    result.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    assert (again.reasons, again.status, again.usable) == (result.reasons, result.status, False)
    np.testing.assert_array_equal(again.pattern.flat, result.pattern.flat)
    assert headline(again, "mm") == headline(result, "mm")


@pytest.mark.parametrize("wrong", [{"format": 1}, {"reasons": [{"code": "no such code"}]}])
def test_records_that_cannot_be_read_are_refused(tmp_path, good, wrong):
    good.save(tmp_path / "a.npz")
    data = dict(np.load(tmp_path / "a.npz"))
    record = json.loads(data["record"].tobytes()) | wrong
    data["record"] = np.frombuffer(json.dumps(record).encode(), np.uint8)
    np.savez(tmp_path / "b.npz", **data)
    with pytest.raises(gso.MeshError, match=r"b\.npz"):
        gso.Result.load(tmp_path / "b.npz")


def test_the_pattern_of_what_unrolls_has_no_strain():
    for mesh in (Mesh.from_grid(cylinder(17)), shuffled(Mesh.from_grid(cylinder(17)))):
        moved = mesh.replaced(1e3 * mesh.vertices + 5e4)
        flat = lay_out(moved).flat
        assert metrics.strains(moved, flat)["strain_max"] < 2e-3
        assert not metrics.flips(moved, flat)


def test_tubes_are_cut_and_closed_surfaces_have_no_pattern():
    angle = 2 * np.pi * np.arange(24) / 24
    rings = np.stack([np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], -1) for z in (0, 1)])
    k = np.arange(24)
    tube = Mesh(rings.reshape(-1, 3), np.stack([k, np.roll(k, -1), np.roll(k, -1) + 24, k + 24], 1))
    assert lay_out(tube).is_cut
    assert tasks.largest_strain(tube, lay_out(tube)) < 1e-9
    ball = Mesh(np.r_[np.eye(3), -np.eye(3)], [
        [0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5],
    ])  # fmt: skip
    assert lay_out(ball) is None


def test_a_hole_does_not_hinder_the_pattern():
    grid = Mesh.from_grid(cylinder(17))
    holed = Mesh(grid.vertices, np.delete(grid.faces, [120, 121, 136, 137], axis=0))
    flat = lay_out(holed).flat
    assert metrics.strains(holed, flat)["strain_max"] < 2e-3


@pytest.mark.parametrize("bound", [0.05, 1.0])
def test_a_bound_asks_for_half_a_percent_of_strain(bound):
    mesh = Mesh.from_grid(10.0 * saddle(17, strength=0.1))
    result = gso.tno.optimize(mesh, max_deviation=bound)
    strain = metrics.principal_strains(result.mesh, result.pattern.flat).values.max()
    assert result.usable == (strain <= 5e-3) == (bound == 1.0)
    verdict = "developable within 1 mm" if bound == 1.0 else "not developable within 0.05 mm"
    assert headline(result, "mm").endswith(f": {verdict}")
    if bound == 0.05:
        (why,) = result.reasons
        assert (why.code, why.bound) == (Code.STRAIN, 5e-3)
        assert why.value == result.details["verdict"]["strain_max"] == pytest.approx(strain)
        assert headline(result).endswith(": not developable within 0.05")
        assert result.deviation <= 0.05 * (1 + 1e-6)


def test_strain_is_judged_as_it_was_asked_for(good):
    strain = good.metrics["strain_max"]
    for factor, fine in ((1.1, True), (1.0, True), (0.99, False)):
        limits = Limits(max_strain=factor * strain)
        reasons = verdict.judge(
            result_of(good.design, good.mesh.vertices, pattern=good.pattern), limits
        )
        assert codes(reasons) == ([] if fine else [Code.STRAIN])
    # A distance beside it does not bring its own limit of half a percent.
    curved = result_of(saddle(9), 0.9 * saddle(9), pattern=lay_out(Mesh.from_grid(saddle(9))))
    assert Code.STRAIN not in codes(
        verdict.judge(curved, Limits(max_strain=0.5, max_deviation=1.0))
    )
    assert Code.STRAIN in codes(verdict.judge(curved, Limits(max_deviation=1.0)))


def test_a_distance_that_is_passed():
    low = FLAT + np.array([0, 0, 0.5])
    assert tried(FLAT, low, limits=Limits(max_deviation=0.5)).usable
    result = tried(FLAT, low, limits=Limits(max_deviation=0.49))
    assert result.status is Status.UNUSABLE
    (why,) = result.reasons
    assert (why.code, why.bound) == (Code.DEVIATION, 0.49)
    assert why.value == pytest.approx(0.5)


def test_a_result_that_has_left_its_design():
    far = tried(saddle(9), FLAT + 40.0)
    assert codes(far.reasons) == [Code.FAR]
    assert far.reasons[0].value == far.deviation / far.design.size
    # A handle that took it there asked for it.
    assert tried(saddle(9), FLAT + 40.0, violation=100.0).usable


def test_a_target_that_is_missed():
    result = tried(saddle(9), 0.9 * saddle(9), limits=Limits(target_curvature=0.01))
    assert (result.reasons[0].code, result.reasons[0].bound) == (Code.TARGET_CURVATURE, 0.01)


def test_more_curvature_than_before():
    strained, why = tried(saddle(9, strength=0.3), saddle(9, strength=0.4)).reasons
    assert strained.code is Code.STRAIN
    assert why.code is Code.CURVATURE_ROSE and why.value > why.bound
    # That of a handle is no fault; the strain is.
    held = tried(saddle(9, strength=0.3), saddle(9, strength=0.4), violation=0.1)
    assert codes(held.reasons) == [Code.STRAIN]


def test_nothing_was_done():
    result = tried(saddle(9), saddle(9))
    assert result.status is Status.UNUSABLE
    assert codes(result.reasons) == [Code.STRAIN, Code.NOTHING_DONE]
    for status in (Status.CONVERGED, Status.ALREADY_GOOD):
        assert tried(cylinder(17), cylinder(17), status=status).usable


def test_a_status_that_refuses_stays():
    for status in (Status.CANCELLED, Status.TARGET_MISSED, Status.CONSTRAINTS_MISSED):
        result = tried(cylinder(17), cylinder(17), status=status)
        assert result.status is status and not result.usable
        assert codes(result.reasons) == [Code[status.name]]


def test_a_face_turned_over_in_the_surface():
    after = FLAT.copy()
    after[4, 4] = [2.2, 2.2, 0.0]
    for task in ("developable", "bend", "denoise"):
        result = tried(FLAT, after, task)
        assert not result.usable and result.reasons[0].code is Code.FOLDED
        assert 27 in result.reasons[0].places.ids and result.reasons[0].places.kind == "face"
        # What the design has already is none of the solver's.
        assert Code.FOLDED not in codes(tried(after, after, task).reasons)


def test_a_surface_that_passes_through_itself():
    angle = np.linspace(0, 1, 24)[:, None] + np.zeros((24, 9))
    across = np.arange(9.0) / 4 + np.zeros((24, 9))
    flat = np.stack([7 * angle, across, 0 * angle], axis=-1)
    eight = np.stack([np.sin(6.28 * angle + 0.1), across, 0.5 * np.sin(12.57 * angle + 0.2)], -1)
    result = tried(flat, eight, "bend")
    assert not result.usable
    assert codes(result.reasons) == [Code.CROSSES_ITSELF]
    assert result.reasons[0].value == len(result.reasons[0].places.ids) > 1
    assert tried(eight, eight + np.array([0, 0, 1e-3]), "bend").usable


def test_edges_that_collapse():
    after = FLAT.copy()
    after[4, 4] = [3.001, 4, 0]
    result = tried(FLAT, after, "denoise")
    why = next(r for r in result.reasons if r.code is Code.COLLAPSED)
    assert str(why.places) == "edge 31-40" and why.value < why.bound == 0.02


def flattened(design, flat, task="flatten"):
    design = design if isinstance(design, Mesh) else Mesh.from_grid(design)
    return tried(design, np.c_[flat, np.zeros(len(flat))], task, flat=flat)


@pytest.mark.parametrize("task", ["flatten", "conformal"])
def test_patterns(task):
    flat = FLAT.reshape(-1, 3)[:, :2].copy()
    assert flattened(FLAT, flat, task).usable
    turned = flat * [1.0, -1.0]
    (why,) = flattened(FLAT, turned, task).reasons
    assert why.code is Code.PATTERN_INVERTED and why.places.ids == tuple(range(64))
    angle, radius = np.meshgrid(np.linspace(0, 7, 9), np.linspace(1, 2, 9), indexing="ij")
    wound = np.stack([radius * np.sin(angle), radius * np.cos(angle)], -1).reshape(-1, 2)
    assert Code.PATTERN_OVERLAPS in codes(flattened(FLAT, wound, task).reasons)


def test_a_ring_beyond_a_full_turn_is_told_to_be_cut():
    """A developable ramp of more than a turn: the surface is sound, its pattern is not."""
    turn, width = np.meshgrid(np.linspace(0, 8.5, 80), np.linspace(1, 1.6, 9), indexing="ij")
    ramp = np.stack([width * np.cos(turn), width * np.sin(turn), 0.1 * turn], axis=-1)
    result = gso.tno.optimize(ramp, task="flatten")
    assert result.status is Status.UNUSABLE
    assert Code.PATTERN_OVERLAPS in codes(result.reasons)


def test_coordinates_that_are_not_finite():
    flat = FLAT.reshape(-1, 3)[:, :2].copy()
    result = result_of(FLAT, FLAT, "flatten", flat=flat)
    result.flat[3] = np.nan
    (why,) = verdict.judge(result, Limits())
    assert why.code is Code.NOT_FINITE and why.places.ids == (3,)


def test_a_rougher_surface_is_not_denoised():
    rough = FLAT + 0.1 * np.random.default_rng(0).standard_normal(FLAT.shape)
    assert codes(tried(FLAT + 0.01 * saddle(9), rough, "denoise").reasons) == [Code.ROUGHER]
    assert gso.tno.optimize(rough, task="denoise").usable


def test_the_verdict_is_fast():
    result = gso.tno.optimize(saddle(64), options="fast")
    assert min(add_verdict(result, Limits()).seconds["verdict"] for _ in range(5)) < 0.1


# Results that were called usable before there was a verdict.


def test_target_curvature_on_coarse_grids():
    reached = gso.tno.optimize(saddle(7, strength=0.6), target_curvature=0.02)
    curved = metrics.loss_gc(reached.mesh, scale=metrics.unit(reached.design))
    # Not by crumpling, which would leave far less than the target.
    assert reached.usable and 0.002 < curved <= 0.021
    assert reached.metrics["strain_max"] < 0.1
    missed = gso.tno.optimize(saddle(9, strength=0.6), target_curvature=0.005)
    assert codes(missed.reasons) == [Code.TARGET_MISSED, Code.TARGET_CURVATURE]
    assert missed.reasons[1].value > missed.reasons[1].bound == 0.005


def test_jiang_on_a_strongly_curved_surface():
    u = np.linspace(-1, 1, 9)
    steep = np.dstack([*np.meshgrid(u, u), np.sin(9 * u)[:, None] * np.sin(9 * u)])
    result = gso.tno.optimize(steep, options="jiang2020")
    before, after = (metrics.loss_gc(m) for m in (result.design, result.mesh))
    assert after < 0.2 * before
    # The reference is not solved again, and is judged like every other result.
    assert codes(result.reasons) == [Code.FAR, Code.STRAIN]
    assert not any("another solve" in note for note in result.notes)


def test_a_face_that_no_pattern_fits():
    design = Mesh.from_grid(saddle(9))
    flat = design.vertices[:, :2].copy()
    flat[40] = flat[41]
    result = result_of(design, 0.9 * saddle(9), pattern=Pattern.whole(design, flat))
    why = next(r for r in verdict.judge(result, Limits()) if r.code is Code.NOT_FLATTENED)
    assert why.value >= 0.99 and why.places.kind == "face"
    assert set(why.places.ids) <= {27, 28, 35, 36}


def test_isometry_with_a_fixed_boundary():
    design = generate(1, seed=5)[0].sample(17)
    held = [gso.FixedBoundary()]
    result = gso.tno.optimize(design, formulation="isometry", constraints=held)
    # Usable only with less curvature than the design.
    assert result.usable == (result.metrics["loss_gc"] <= result.metrics["loss_gc_before"])
    assert result.usable != (Code.CURVATURE_ROSE in codes(result.reasons))


def test_bend_with_a_sharp_fold():
    sheet = np.dstack([*np.mgrid[:17.0, :17.0], np.zeros((17, 17))])
    pushed = [gso.Fixed(np.arange(17)), gso.Handle([280], [[2.0, 8.0, 1.0]])]
    result = gso.tno.optimize(sheet, task="bend", constraints=pushed)
    assert not result.usable and Code.FOLDED in codes(result.reasons)
    lifted = [gso.Fixed(np.arange(17)), gso.Handle([280], [[12.0, 8.0, 4.0]])]
    assert gso.tno.optimize(sheet, task="bend", constraints=lifted).usable


def test_sessions_are_judged():
    sheet = np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))])
    fixed, hand = gso.Fixed(np.arange(18)), gso.Handle([76], [[8.0, 4.0, 0.0]])
    session = gso.tno.Session(sheet, constraints=[fixed, hand])
    session.move([76], [[7.0, 4.0, 2.0]])
    assert session.settle().usable
    session.move([76], [[1.0, 4.0, 0.5]])
    result = session.result()
    assert Code.FOLDED in codes(result.reasons) and not result.usable
    assert "verdict" in result.seconds
    end = session.settle()  # the solve from the design is usable
    assert end.usable and any("is usable and the dragged surface is not" in n for n in end.notes)


def test_hybrid_results_are_judged():
    result = gso.hybrid.solve(saddle(17), polish=2, max_deviation=0.01)
    assert codes(result.reasons) == [Code.STRAIN]


def test_batches_may_leave_it_out():
    for judged in (True, False):
        (item,) = gso.tno.optimize_many([saddle(9)], workers=0, options="fast", verdict=judged)
        assert (item.result.pattern is not None) is judged


@pytest.mark.parametrize(("unit", "said"), [(["--unit", "cm"], " cm"), ([], "")])
def test_the_command_line_says_it_first(tmp_path, monkeypatch, unit, said):
    monkeypatch.chdir(tmp_path)
    gso.save(Mesh.from_grid(saddle(9)), "in.obj")
    asked = [
        "optimize",
        "in.obj",
        "-o",
        "out.obj",
        "--max-deviation",
        "0.01",
        "--metrics",
        "m.json",
    ]
    done = CliRunner().invoke(main, asked + unit)
    first = done.stdout.splitlines()[0]
    assert first.startswith("largest strain ")
    shown = rf"deviation 0\.0\d+{said} \([\d.]+ % of the diagonal\)"
    assert re.search(rf"{shown}: not developable within 0\.01{said}$", first)
    assert done.exit_code == 1
    record = json.loads((tmp_path / "m.json").read_text())
    (why,) = record["reasons"]
    assert record["headline"] == first and not record["usable"]
    assert (why["code"], why["bound"]) == ("strain", 5e-3)
    assert f"not usable: {why['text']}" in done.stdout.splitlines()
    gso.save(Mesh.from_grid(saddle(9, strength=0.1)), "in.obj")
    done = CliRunner().invoke(main, ["optimize", "in.obj", "-o", "out.obj", *unit])
    assert done.exit_code == 0
    first = done.stdout.splitlines()[0]
    assert first.startswith("largest strain ") and "developable" not in first


def test_unjudged_results_are_usable_as_before(good):
    plain = replace(good, reasons=(), status=Status.CONVERGED)
    assert plain.usable
    assert not replace(plain, status=Status.CANCELLED).usable


def _plates(*turns):
    """Return square plates of side 2 through one line, turned about it by angles in degrees."""
    y, x = np.mgrid[-1:1:7j, -1:1:8j]
    points = [
        np.stack([x.ravel() * np.cos(a) + k / 50, y.ravel() + k / 30, x.ravel() * np.sin(a)], 1)
        for k, a in enumerate(np.radians(turns))
    ]
    faces = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1)).faces
    return Mesh(np.concatenate(points), np.concatenate([faces + 56 * k for k in range(len(turns))]))


def _eight():
    """Return a strip bent to a figure of eight: exactly developable, and through itself."""
    angle = np.linspace(0, 1, 24)[:, None] + np.zeros((24, 9))
    across = np.arange(9.0) / 4 + np.zeros((24, 9))
    eight = [np.sin(6.28 * angle + 0.1), across, 0.5 * np.sin(12.57 * angle + 0.2)]
    return Mesh.from_grid(np.stack(eight, axis=-1))


@pytest.mark.parametrize(
    "how", [{"task": "flatten"}, {"formulation": "curvature"}, {"formulation": "isometry"}, {}]
)
@pytest.mark.parametrize("make", [_eight, lambda: _plates(0, 90), lambda: _plates(10, 70, 130)])
def test_what_passes_through_itself_cannot_be_built(make, how):
    mesh = make()
    result = gso.tno.optimize(mesh, **how)
    assert not result.usable and result.status is Status.UNUSABLE
    why = next(r for r in result.reasons if r.code is Code.CROSSES_ITSELF)
    # A face that is named has vertices on both sides of the plane of another one that is named.
    named = [mesh.vertices[f] for f in mesh.faces[list(why.places.ids)]]
    for face in named:
        sides = [
            (face - other[0]) @ np.cross(other[1] - other[0], other[2] - other[0])
            for other in named
        ]
        assert any(side.min() < 0 < side.max() for side in sides)


def test_plates_that_only_stand_near_each_other_are_no_crossing():
    mesh = _plates(0, 90)
    apart = mesh.replaced(mesh.vertices + np.repeat([[0, 0, 0], [0, 0, 1.01]], 56, axis=0))
    for how in ({"task": "flatten"}, {"formulation": "curvature"}):
        assert gso.tno.optimize(apart, **how).usable
