"""B-spline surfaces: the class, fits, spline unknowns, and files that others can read."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.interpolate import NdBSpline

import gso
from gso import energy, metrics
from gso.cli import main
from gso.energy import Weighted
from gso.mesh import Mesh
from gso.solver import Problem, minimise
from gso.spline import BSplineSurface, clamped_knots
from gso.tasks.developable import Options
from gso.unknowns import Layout, spline_surface
from tests.conftest import cylinder, rotation, saddle, shuffled, sphere_cap

congruence, fairness = map(energy.registry().get, ("congruence", "fairness"))

SURFACE = Options(variables="surface", controls=8)
UNITS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}


@pytest.fixture(scope="module")
def spline():
    """A spline of unequal sides, with curvature, away from the origin."""
    rng = np.random.default_rng(5)
    net = np.stack([*np.meshgrid(np.arange(7.0), np.arange(5.0), indexing="ij"), np.zeros((7, 5))])
    net = np.moveaxis(net, 0, -1) + 0.4 * rng.random((7, 5, 3)) + [1e3, -3.0, 1 / 3]
    return BSplineSurface(net, clamped_knots(7), clamped_knots(5))


@pytest.fixture(scope="module")
def solved(surfaces):
    return gso.tno.optimize(surfaces[0], options=SURFACE)


# The class


def test_values_and_derivatives_are_those_of_scipy(spline):
    rng = np.random.default_rng(0)
    u, v = rng.random((2, 40))
    reference = NdBSpline((spline.knots_u, spline.knots_v), spline.net, 3)
    for order in ((0, 0), (1, 0), (1, 2), (3, 3)):
        expected = reference(np.stack([u, v], axis=-1), nu=order)
        got = spline.evaluate(u, v, du=order[0], dv=order[1])
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-7)
    assert not spline.evaluate(u, v, du=4).any()
    s, t = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 9), indexing="ij")
    np.testing.assert_allclose(spline.sample(6, 9), spline.evaluate(s, t), atol=1e-12)


def test_corners_are_control_points(spline):
    np.testing.assert_array_equal(spline.sample(2, 2), spline.net[:: 7 - 1, :: 5 - 1])


def test_curvature_and_normals_of_a_sphere():
    points = sphere_cap(41, radius=2.0)
    ball = gso.fit_spline(points, controls=16)
    u, v = np.random.default_rng(0).random((2, 50))
    np.testing.assert_allclose(ball.gaussian_curvature(u, v), 0.25, rtol=1e-3)
    np.testing.assert_allclose(ball.normals(u, v), ball.evaluate(u, v) / 2.0, atol=1e-4)
    assert ball.mean_gaussian_curvature() == pytest.approx(0.25, rel=1e-4)
    assert ball.moved(10.0, 5.0).mean_gaussian_curvature() == pytest.approx(0.0025, rel=1e-4)


def test_curvature_of_a_cylinder_vanishes():
    assert gso.fit_spline(cylinder(), controls=16).mean_gaussian_curvature() < 1e-3


def test_a_net_without_area_gives_no_nan():
    point = BSplineSurface(np.ones((4, 4, 3)), clamped_knots(4), clamped_knots(4))
    assert point.mean_gaussian_curvature() == 0.0
    assert point.gaussian_curvature(0.5, 0.5) == 0.0
    assert not point.normals(0.5, 0.5).any()


def test_bad_splines_are_refused(spline):
    net, u, v = spline.net, spline.knots_u, spline.knots_v
    for arrays, what in (
        ((net[0], u, v), "control net"),
        ((net, v, v), "knots_u"),
        ((net, u, v[::-1]), "knots_v"),
        ((net, np.linspace(0, 1, len(u)), v), "first and the last"),
        ((net, u, v * 0), "knots_v"),
        ((net * np.nan, u, v), "finite"),
        (("net", u, v), "numbers"),
    ):
        with pytest.raises(gso.MeshError, match=what):
            BSplineSurface(*arrays)
    for outside in (1.1, np.nan, "a"):
        with pytest.raises(gso.OptionError, match="u must be"):
            spline.evaluate(outside, 0.5)
    for ask, what in (
        (lambda: spline.evaluate([0.1, 0.2], [0.1, 0.2, 0.3]), "broadcast"),
        (lambda: spline.evaluate(0.5, 0.5, du=-1), "du is -1"),
        (lambda: spline.sample(0, 3), "height is 0"),
        (lambda: spline.sample(3, 2.5), "width is 2.5"),
        (lambda: spline.mean_gaussian_curvature(0), "per_span is 0"),
    ):
        with pytest.raises(gso.OptionError, match=what):
            ask()


# Fits


@pytest.mark.parametrize("controls", [4, 7, (6, 12)])
def test_a_spline_is_fitted_exactly(controls):
    first = gso.fit_spline(saddle(40, 23), controls)
    again = gso.fit_spline(first.sample(31, 37), controls)
    np.testing.assert_allclose(again.net, first.net, atol=1e-12)
    assert again.gap.vertices_max < 1e-12


def test_the_fit_follows_the_surface():
    points = saddle(33)
    turn = rotation(1)
    moved = gso.fit_spline(1000.0 * points @ turn.T + 1e5, controls=6)
    plain = gso.fit_spline(points, controls=6)
    np.testing.assert_allclose(moved.net, 1000.0 * plain.net @ turn.T + 1e5, atol=1e-7)


def test_numbering_of_the_vertices_does_not_matter():
    mesh = shuffled(Mesh.from_grid(saddle(20, 14)))
    fit = gso.fit_spline(mesh, controls=5)
    np.testing.assert_allclose(fit.sample(*mesh.grid_shape), mesh.grid, atol=1e-12)


def test_the_gap_is_the_distance_in_both_directions():
    points = saddle(20)
    points[..., 2] += 0.1 * np.sin(9.0 * points[..., 0])
    fit = gso.fit_spline(points, controls=5)
    mesh, dense = Mesh.from_grid(points), Mesh.from_grid(fit.sample(191, 191))
    there = metrics.point_to_surface(mesh.vertices, dense)
    back = metrics.point_to_surface(dense.vertices, mesh)
    wanted = [there.mean(), there.max(), back.mean(), back.max()]
    assert min(wanted) > 0.01
    assert fit.gap == pytest.approx(wanted, rel=0.05)


def test_misfit_falls_with_more_controls():
    points = saddle(48) + np.sin(7 * saddle(48)[..., ::-1]) / 20
    gaps = [gso.fit_spline(points, n).gap.vertices_max for n in (5, 10, 20)]
    assert gaps[0] > 4 * gaps[1] > 16 * gaps[2]


def test_controls_of_small_grids():
    assert gso.fit_spline(saddle(64, 16), 16).net.shape[:2] == (16, 11)
    assert gso.fit_spline(saddle(3, 4), (4, 99)).net.shape[:2] == (3, 4)
    assert gso.fit_spline(saddle(3, 4)).degrees == (2, 3)
    for bad in (3, 4.5, "8", True, (8, 8, 8), None):
        with pytest.raises(gso.OptionError, match="controls"):
            gso.fit_spline(saddle(20), controls=bad)


def test_meshes_that_are_no_grids_are_refused():
    grid = Mesh.from_grid(saddle(9))
    triangles = Mesh(grid.vertices, grid.triangles)
    with pytest.raises(gso.MeshError, match=r"no grid.*resample"):
        gso.fit_spline(triangles)
    with pytest.raises(gso.MeshError, match=r"no grid.*resample"):
        gso.tno.optimize(triangles, options=SURFACE)


# Unknowns


def test_unknowns_beside_a_free_flat_image():
    shape, controls = (9, 11), (5, 6)
    layout = Layout.of(99, "surface", "flat")
    variables = spline_surface(layout, shape, controls)
    assert variables.size == 3 * 30 + 2 * 99
    x = np.random.default_rng(2).random(variables.size)
    blocks = layout.split(variables.points(x))
    net = BSplineSurface(x[:90].reshape(5, 6, 3), clamped_knots(5), clamped_knots(6))
    np.testing.assert_allclose(blocks["surface"].reshape(9, 11, 3), net.sample(*shape), atol=1e-14)
    np.testing.assert_array_equal(blocks["flat"].ravel(), x[90:])
    np.testing.assert_allclose(variables.project(variables.points(x)), x, atol=1e-9)


def test_a_control_net_and_a_flat_image_become_isometric():
    mesh = Mesh.from_grid(saddle(13, strength=0.15))
    layout = Layout.of(len(mesh.vertices), "surface", "flat")
    variables = spline_surface(layout, (13, 13), (5, 5))
    start = layout.pack({"surface": mesh.vertices, "flat": mesh.vertices[:, :2]})
    items = [Weighted(t, 1.0) for t in congruence.build(mesh, "surface", counterpart="flat")]
    items.append(Weighted(fairness.build(mesh), 1e-6))
    problem = Problem(items, variables)
    x = variables.project(start)
    done = minimise(problem, x, iterations=30, method="levenberg-marquardt")
    before, after = problem.by_term(x)["isometry"], problem.by_term(done.x)["isometry"]
    assert after < 1e-3 * before
    surface = layout.split(variables.points(done.x))["surface"].reshape(13, 13, 3)
    assert gso.fit_spline(surface, 5).gap.vertices_max < 1e-9


# The task


def test_the_result_is_its_spline(solved, surfaces):
    assert solved.metrics["K_A_r"] > 0.6
    np.testing.assert_allclose(solved.grid, solved.spline.sample(32, 32), atol=1e-12)
    said = solved.details["spline"]
    assert said["controls"] == [8, 8]
    assert said["mesh"]["vertices_max"] < 1e-12 < said["mesh"]["between_max"] < 0.02
    assert 0 < said["fitted"]["vertices_mean"] <= said["fitted"]["vertices_max"] < 0.1
    exact = metrics.surface_distance(surfaces[0], solved.grid)
    assert said["design"]["between_mean"] == pytest.approx(exact.there_mean, rel=0.1)
    assert said["curvature"] == pytest.approx(solved.metrics["mean_abs_K"], rel=0.5)


def test_the_spline_is_in_the_users_frame(solved, surfaces):
    shift = np.array([1e4, 0.0, -7.0])
    moved = gso.tno.optimize(250.0 * surfaces[0] + shift, options=SURFACE)
    np.testing.assert_allclose(moved.spline.net, 250.0 * solved.spline.net + shift, atol=1e-3)
    one, other = solved.details["spline"], moved.details["spline"]
    assert other["curvature"] == pytest.approx(one["curvature"], rel=1e-4)
    for key in ("design", "mesh", "fitted"):
        assert other[key]["between_max"] == pytest.approx(250.0 * one[key]["between_max"], rel=1e-4)


def test_the_spline_has_rows_and_columns_of_the_grid(surfaces):
    mesh = shuffled(Mesh.from_grid(surfaces[0][:, :20]))
    result = gso.tno.optimize(mesh, options=SURFACE)
    np.testing.assert_allclose(result.grid, result.spline.sample(*mesh.grid_shape), atol=1e-12)


def test_developable_designs_stay():
    points = cylinder()
    result = gso.tno.optimize(points, options=replace(SURFACE, controls=16))
    assert np.abs(result.grid - points).max() < 1e-4
    assert result.details["spline"]["curvature"] < 1e-3


def test_a_start_is_no_reason_to_be_worse(solved, surfaces):
    warm = gso.tno.optimize(surfaces[0], options=SURFACE, x0=solved.mesh)
    assert sum(warm.energy.values()) <= sum(solved.energy.values()) * (1 + 1e-9)


@pytest.mark.filterwarnings("ignore::gso.ConvergenceWarning")
@pytest.mark.parametrize("calls", [1, 20])
def test_a_cancelled_solve_is_a_spline_too(surfaces, calls):
    seen = []

    def stop(progress):
        seen.append(progress)
        return len(seen) < calls

    result = gso.tno.optimize(surfaces[0], options=SURFACE, callback=stop)
    assert result.status is gso.Status.CANCELLED
    np.testing.assert_allclose(result.grid, result.spline.sample(32, 32), atol=1e-12)


def test_what_a_spline_cannot_keep_is_refused(surfaces):
    with pytest.raises(gso.OptionError, match=r"max_deviation.*fit_spline"):
        gso.tno.optimize(surfaces[0], options=SURFACE, max_deviation=0.1)
    with pytest.raises(gso.OptionError, match=r"constraint 0 \(FixedBoundary\).*weight"):
        gso.tno.optimize(surfaces[0], options=SURFACE, constraints=[gso.FixedBoundary()])
    goal = surfaces[0][:1, 0] + 0.05
    soft = gso.Handle([0], goal, weight=1.0)
    pulled = gso.tno.optimize(surfaces[0], options=SURFACE, constraints=[soft])
    np.testing.assert_allclose(pulled.spline.net[0, 0], goal[0], atol=0.01)


def test_a_target_is_reached_by_the_spline(surfaces):
    result = gso.tno.optimize(surfaces[1], options=SURFACE, target_curvature=0.05)
    assert result.status is gso.Status.TARGET_REACHED
    assert metrics.loss_gc(result.spline.sample(32, 32)) <= 0.05 * (1 + 1e-9)


def test_round_trip_of_a_result(solved, tmp_path):
    solved.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.spline.net, solved.spline.net)
    np.testing.assert_array_equal(again.spline.knots_u, solved.spline.knots_u)
    assert again.spline.gap == solved.spline.gap
    assert again.details["spline"] == solved.details["spline"]


# Files


def read_step(path):
    """Net, knots and unit of a STEP file, by an independent reader."""
    p21 = pytest.importorskip("steputils.p21")
    found = p21.readfile(str(path)).data[0].instances
    simple = [i.entity for i in found.values() if p21.is_simple_entity_instance(i)]
    (surface,) = (e for e in simple if e.name == "B_SPLINE_SURFACE_WITH_KNOTS")
    net = [[found[ref].entity.params[1] for ref in row] for row in surface.params[3]]
    knots = [
        np.repeat(values, count)
        for values, count in zip(surface.params[10:12], surface.params[8:10], strict=True)
    ]
    assert surface.params[1:3] == (3, 3)
    (unit,) = (
        i.entities
        for i in found.values()
        if p21.is_complex_entity_instance(i)
        and any(e.name == "LENGTH_UNIT" for e in i.entities)
        and not any(found_as_base(found, i, simple))
    )
    return np.array(net, float), *knots, step_unit(found, unit)


def found_as_base(found, instance, simple):
    """Whether another unit is defined by this one."""
    for entity in simple:
        if entity.name == "LENGTH_MEASURE_WITH_UNIT":
            yield instance.ref in entity.params


def step_unit(found, entities):
    """Metres of a unit."""
    parts = {e.name: e.params for e in entities}
    if "SI_UNIT" in parts:
        return {"$": 1.0, ".MILLI.": 1e-3, ".CENTI.": 1e-2, ".MICRO.": 1e-6}[
            str(parts["SI_UNIT"][0]).strip() if parts["SI_UNIT"][0] else "$"
        ]
    measure = found[parts["CONVERSION_BASED_UNIT"][1]].entity.params
    return float(str(getattr(measure[0], "params", [measure[0]])[0])) * 1e-3


def read_iges(path):
    """Net, knots and unit of the entity 128 of an IGES file (IGES 5.3, section 4.34)."""
    lines = path.read_text().splitlines()
    assert all(len(line) == 80 for line in lines)
    part = {k: [line for line in lines if line[72] == k] for k in "SGDPT"}
    kinds = [int(line[:8]) for line in part["D"][::2]]
    assert kinds == [128]
    text = "".join(line[:64].strip() for line in part["P"]).rstrip(";")
    values = np.array([float(x) for x in text.split(",")])
    k1, k2, m1, m2 = values[1:5].astype(int)
    at = np.cumsum([10, k1 + m1 + 2, k2 + m2 + 2, (k1 + 1) * (k2 + 1), 3 * (k1 + 1) * (k2 + 1)])
    u, v, weights, net = (values[a:b] for a, b in pairwise(at))
    assert (weights == 1.0).all()
    flag = int("".join(line[:72] for line in part["G"]).split(",")[13])
    unit = {1: 0.0254, 2: 1e-3, 4: 0.3048, 6: 1.0, 9: 1e-6, 10: 1e-2}[flag]
    return net.reshape(k2 + 1, k1 + 1, 3).swapaxes(0, 1), u, v, unit


def read_3dm(path):
    """Net, knots and unit of a 3DM file, by openNURBS."""
    rhino3dm = pytest.importorskip("rhino3dm")
    model = rhino3dm.File3dm.Read(str(path))
    (item,) = model.Objects
    surface = item.Geometry
    n, m = surface.Points.CountU, surface.Points.CountV
    points = [[surface.Points[i, j] for j in range(m)] for i in range(n)]
    net = np.array([[[p.X, p.Y, p.Z] for p in row] for row in points])
    knots = [np.r_[k[0], k, k[-1]] for k in map(list, (surface.KnotsU, surface.KnotsV))]
    units = {"Microns": "um", "Millimeters": "mm", "Centimeters": "cm", "Meters": "m"}
    units |= {"Inches": "in", "Feet": "ft"}
    return net, *knots, UNITS[units[model.Settings.ModelUnitSystem.name]]


READERS = {".step": read_step, ".stp": read_step, ".iges": read_iges, ".igs": read_iges}
READERS[".3dm"] = read_3dm


def need(suffix):
    pytest.importorskip("rhino3dm" if suffix == ".3dm" else "OCP", exc_type=ImportError)


@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("unit", UNITS)
def test_files_have_the_spline_itself(spline, tmp_path, suffix, unit):
    need(suffix)
    path = tmp_path / f"surface{suffix}"
    gso.save_spline(spline, path, unit=unit)
    net, u, v, metres = READERS[suffix](path)
    assert metres == pytest.approx(UNITS[unit], rel=1e-12)
    np.testing.assert_allclose(net, spline.net, rtol=1e-14, atol=0)
    np.testing.assert_allclose(u, spline.knots_u, atol=1e-15)
    np.testing.assert_allclose(v, spline.knots_v, atol=1e-15)


@pytest.mark.parametrize("suffix", [".step", ".iges"])
@pytest.mark.parametrize(("unit", "millimetres"), [("dm", 100.0), ("yd", 914.4)])
def test_units_that_a_format_lacks_become_millimetres(spline, tmp_path, suffix, unit, millimetres):
    need(suffix)
    path = tmp_path / f"surface{suffix}"
    gso.save_spline(spline, path, unit=unit)
    net, _, _, metres = READERS[suffix](path)
    assert metres == pytest.approx(1e-3)
    np.testing.assert_allclose(net, spline.net * millimetres, rtol=1e-14)


@pytest.mark.parametrize("suffix", [".step", ".iges", ".3dm"])
@pytest.mark.parametrize("size", [1e-4, 1e5])
def test_small_and_large_coordinates_keep_their_digits(spline, tmp_path, suffix, size):
    need(suffix)
    other = spline.moved(size)
    gso.save_spline(other, tmp_path / f"a{suffix}", unit="m")
    net = READERS[suffix](tmp_path / f"a{suffix}")[0]
    np.testing.assert_allclose(net, other.net, rtol=1e-14, atol=0)


@pytest.mark.parametrize("suffix", [".step", ".iges", ".3dm"])
def test_results_are_written(solved, tmp_path, suffix):
    need(suffix)
    path = tmp_path / f"result{suffix}"
    solved.save(path, unit="m")
    net = READERS[suffix](path)[0]
    np.testing.assert_allclose(net, solved.spline.net, atol=1e-9 * solved.spline.size)


def test_opencascade_says_nothing_and_keeps_its_settings(spline, tmp_path, capfd):
    need(".step")
    from OCP.Interface import Interface_Static

    gso.save_spline(spline, tmp_path / "a.step", unit="m")
    gso.save_spline(spline, tmp_path / "a.iges", unit="m")
    assert capfd.readouterr() == ("", "")
    assert Interface_Static.CVal_s("write.step.unit") == "MM"
    assert Interface_Static.CVal_s("xstep.cascade.unit") == "MM"


def test_a_file_is_replaced_only_by_a_complete_one(spline, tmp_path):
    need(".step")
    path = tmp_path / "a.step"
    path.write_text("old")
    with pytest.raises(gso.MeshError, match=r"a\.step.*is the unit right"):
        gso.save_spline(spline.moved(1e-12), path, unit="m")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.step"]


def test_what_cannot_be_written_is_refused(spline, tmp_path, solved):
    with pytest.raises(gso.MeshError, match=r"'\.dwg'.*\.step"):
        gso.save_spline(spline, tmp_path / "a.dwg")
    with pytest.raises(gso.OptionError, match="fit_spline"):
        gso.save_spline(saddle(), tmp_path / "a.step")
    with pytest.raises(gso.OptionError, match="unit 'parsec'"):
        gso.save_spline(spline, tmp_path / "a.step", unit="parsec")
    with pytest.raises(gso.MeshError, match=r"variables='surface'.*fit_spline"):
        replace(solved, spline=None).save(tmp_path / "a.step")


@pytest.mark.parametrize(("suffix", "package"), [(".step", "OCP"), (".3dm", "rhino3dm")])
def test_a_missing_package_is_named(spline, tmp_path, monkeypatch, suffix, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(gso.GSOError, match=r'pip install "\.\[cad\]"'):
        gso.save_spline(spline, tmp_path / f"a{suffix}")


def test_importing_gso_io_loads_no_cad_package():
    code = "import sys, gso.io.cad, gso.spline.fit\nprint({'OCP', 'rhino3dm'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


# The command line


def test_a_cad_output_asks_for_a_spline(surfaces, tmp_path):
    need(".step")
    source, out = tmp_path / "a.npy", tmp_path / "a.stp"
    np.save(source, surfaces[1])
    done = CliRunner().invoke(main, ["optimize", str(source), "-o", str(out), "--unit", "cm"])
    assert done.exit_code == 0, done.output
    assert "16 x 16 control points" in done.output
    net, _, _, metres = read_step(out)
    assert net.shape == (16, 16, 3)
    assert metres == 0.01


def test_a_spline_is_fitted_where_it_cannot_be_solved_for(surfaces, tmp_path):
    need(".3dm")
    source, out = tmp_path / "a.npy", tmp_path / "a.3dm"
    np.save(source, surfaces[0])
    words = ["optimize", str(source), "-o", str(out), "--max-deviation", "0.05"]
    done = CliRunner().invoke(main, words)
    # So close to the design nothing is developable, which the spline does not change.
    assert done.exit_code == 1 and "not developable within 0.05" in done.output
    assert "the spline was fitted to the result" in done.output
    assert read_3dm(out)[0].shape == (16, 16, 3)


def test_many_outputs_may_be_cad_files(surfaces, tmp_path):
    need(".3dm")
    for k in range(2):
        np.save(tmp_path / f"{k}.npy", surfaces[2 * k + 1])
    words = [str(tmp_path / f"{k}.npy") for k in range(2)]
    words += ["-o", str(tmp_path / "out"), "--suffix", "3dm", "--workers", "0"]
    done = CliRunner().invoke(main, ["optimize", *words])
    assert done.exit_code == 0, done.output
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["0.3dm", "1.3dm"]


def test_other_tasks_make_no_splines(tmp_path):
    np.save(tmp_path / "a.npy", saddle())
    words = [str(tmp_path / "a.npy"), "-o", str(tmp_path / "a.step"), "--task", "flatten"]
    done = CliRunner().invoke(main, ["optimize", *words])
    assert done.exit_code != 0
    assert "--task developable" in done.output


@pytest.mark.parametrize(("source", "target"), [(3, 7), (4, 9), (20, 32), (64, 20), (9, 9)])
def test_grids_are_resampled_by_the_not_a_knot_spline(source, target):
    from scipy.interpolate import make_interp_spline

    values = np.random.default_rng(source).random((source, source, 2))
    expected = values
    for _ in range(2):
        x = np.linspace(0, 1, source)
        spline = make_interp_spline(x, expected, k=min(3, source - 1))
        expected = spline(np.linspace(0, 1, target)).swapaxes(0, 1)
    found = gso.hierarchy.resample(values, target, target)
    np.testing.assert_allclose(found, expected, atol=1e-12)
