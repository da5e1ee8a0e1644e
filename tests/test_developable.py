"""The developable task: truths, bounds, targets, invariance, constraints, every kind of mesh."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gso
from gso import metrics
from gso.mesh import Mesh
from gso.tasks import Start
from gso.tasks.developable import NEAR, SHEET, Options
from tests.conftest import cylinder, saddle, shuffled, sphere_cap

PRESETS = tuple(Options.PRESETS)


@pytest.fixture(scope="module")
def solved(surfaces) -> Callable[..., gso.Result]:
    """Results for surfaces by their number, each solved once; no test may change them."""
    known: dict[tuple[int, str, bool], gso.Result] = {}

    def solve(number: int, options: str = "balanced", *, verdict: bool = True) -> gso.Result:
        key = number, options, verdict
        if key not in known:
            known[key] = gso.tno.optimize(surfaces[number], options=options, verdict=verdict)
        return known[key]

    return solve


@pytest.fixture(scope="module")
def bounded(surfaces) -> Callable[[int, float], gso.Result]:
    """Results within a share of the diagonal, each solved once; no test may change them."""
    known: dict[tuple[int, float], gso.Result] = {}

    def solve(number: int, share: float) -> gso.Result:
        if (number, share) not in known:
            mesh = Mesh.from_grid(surfaces[number])
            known[number, share] = gso.tno.optimize(mesh, max_deviation=share * mesh.diagonal)
        return known[number, share]

    return solve


def moved(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    return np.linalg.norm(after - before, axis=-1)


@pytest.mark.parametrize("preset", PRESETS)
def test_curvature_falls_and_the_surface_stays_close(surfaces, solved, preset):
    for number, points in enumerate(surfaces):
        result = solved(number, preset, verdict=False)
        m = result.metrics
        assert m["K_A_r"] > 0.7
        assert m["d_H"] < 1.0
        assert m["fairness_ratio"] < 2.0
        assert sum(result.energy.values()) > 0
        assert result.grid.shape == points.shape


def test_what_strains_or_is_far_is_solved_again_nearby(surfaces, solved):
    again = 0
    for number in range(len(surfaces)):
        plain, result = solved(number, verdict=False), solved(number)
        far = metrics.surface_distance(result.design, result.mesh)
        assert result.usable
        assert result.details["verdict"]["strain_max"] <= SHEET
        assert max(far.there_max, far.back_max) <= NEAR * result.design.size
        if any("another solve" in note for note in result.notes):
            again += 1
            # The history and the count of iterations are those of all solves.
            assert result.iterations > plain.iterations
        elif result.history[-1].name != "normals of quads":
            np.testing.assert_array_equal(plain.mesh.vertices, result.mesh.vertices)
    assert 0 < again < len(surfaces)


def test_other_solves_are_cold_and_end_with_budget_and_callback(surfaces, solved):
    for number in range(len(surfaces)):
        plain, result = (solved(number, verdict=v) for v in (False, True))
        if result.iterations > plain.iterations:
            break
    points = surfaces[number]
    budget = Start(points, iterations=plain.iterations)
    assert gso.tno.optimize(points, x0=budget).iterations <= plain.iterations
    assert gso.tno.optimize(points, x0=points).warm_start == "cold"
    alone = gso.tno.optimize(points, x0=Start(plain.mesh, source="guess", iterations=0))
    assert (alone.warm_start, alone.iterations, alone.usable) == ("guess", 0, False)
    np.testing.assert_allclose(alone.grid, plain.grid, atol=1e-12)
    seen = []

    def stop(progress):
        seen.append(progress)
        return len(seen) <= len(plain.history)

    stopped = gso.tno.optimize(points, callback=stop)
    assert stopped.status is gso.Status.CANCELLED
    assert len(stopped.history) == len(seen) == len(plain.history) + 1
    np.testing.assert_array_equal(stopped.grid, plain.grid)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_developable_input_comes_back_untouched(preset, turn):
    points = cylinder(33, turn)
    result = gso.tno.optimize(points, options=preset)
    assert result.status is gso.Status.ALREADY_GOOD
    assert result.iterations == 0
    np.testing.assert_array_equal(result.grid, points)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_a_noisy_cylinder_loses_curvature_within_three_times_the_noise(preset, turn):
    clean = cylinder(40, turn)
    noise = 1e-3 * metrics.unit(clean)
    noisy = clean + noise * np.random.default_rng(0).standard_normal(clean.shape)
    result = gso.tno.optimize(noisy, options=preset)
    assert result.metrics["K_A_r"] > 0.9
    assert moved(noisy, result.grid).max() <= 3.0 * noise


def test_the_preset_that_costs_more_is_more_developable(surfaces, solved):
    left = [
        np.mean([solved(k, o).metrics["loss_gc"] for k in range(len(surfaces))])
        for o in ("balanced", "accurate")
    ]
    assert left[1] < left[0]


def test_same_shape_in_any_unit_turned_and_moved(surfaces, solved):
    points = surfaces[0]
    reference = solved(0).grid
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    for scale, shift in ((1e3, 0.0), (1e-9, 0.0), (1.0, 1e5), (1e3, 1e8)):
        result = gso.tno.optimize(scale * (points @ turn.T) + shift)
        back = (result.grid - shift) / scale @ turn
        assert np.abs(back - reference).max() < 1e-5


def test_rows_and_columns_can_change_places():
    points = saddle(16, 24)
    a = gso.tno.optimize(points).grid
    b = gso.tno.optimize(points.swapaxes(0, 1)).grid.swapaxes(0, 1)
    # The diagonals of the cells stay where they were, so the two meet exactly.
    assert np.abs(a - b).max() < 1e-6


def test_any_numbering_gives_the_same_surface(surfaces, solved):
    mixed = shuffled(Mesh.from_grid(surfaces[1]))
    result = gso.tno.optimize(mixed)
    assert mixed.grid_shape is not None
    assert result.metrics["K_A_r"] == pytest.approx(solved(1).metrics["K_A_r"], abs=0.05)


@pytest.mark.parametrize(("number", "share"), [(0, 0.0025), (0, 0.01), (1, 0.0025)])
def test_max_deviation_is_kept(surfaces, bounded, number, share):
    mesh = Mesh.from_grid(surfaces[number])
    bound, result = share * mesh.diagonal, bounded(number, share)
    far = metrics.surface_distance(mesh, result.mesh)
    assert max(far.there_max, far.back_max) <= bound * (1 + 1e-6)
    assert result.metrics["K_A_r_worst"] > 0.05


def test_a_larger_budget_leaves_less_strain(bounded):
    left = [bounded(0, share).metrics["strain_max"] for share in (0.0025, 0.005, 0.01)]
    assert left[0] > left[1] > left[2]


def test_target_curvature_is_met_with_less_displacement(surfaces, solved):
    compared = 0
    for number in range(2):
        result = gso.tno.optimize(surfaces[number], target_curvature=0.05)
        assert result.status is gso.Status.TARGET_REACHED
        assert 0.95 * 0.05 <= result.metrics["loss_gc_worst"] <= 0.05
        accurate = solved(number, "accurate")
        if accurate.metrics["loss_gc_worst"] <= 0.05:
            assert result.metrics["d_H"] <= accurate.metrics["d_H"]
            compared += 1
    assert compared


@pytest.mark.parametrize("size", [5, 9])
@pytest.mark.parametrize("target", [0.02, 0.005])
def test_a_target_on_a_coarse_mesh_is_reached_nearby(size, target):
    u, v = np.meshgrid(*[np.linspace(-1, 1, size)] * 2, indexing="ij")
    points = np.dstack([u, v, 0.5 * np.cos(2 * u) * np.cos(2 * v)])
    result = gso.tno.optimize(points, target_curvature=target)
    assert result.status is gso.Status.TARGET_REACHED
    assert 0.95 * target <= result.metrics["loss_gc_worst"] <= target
    assert result.metrics["distance_max"] < 15.0
    # The energy is that of the surface that is returned.
    assert sum(result.energy.values()) > 0


@pytest.mark.parametrize("strain", [0.02, 0.005])
def test_max_strain_is_kept_with_no_more_displacement_than_it_takes(surfaces, strain):
    mesh = Mesh.from_grid(surfaces[0][::2, ::2])
    result = gso.tno.optimize(mesh, max_strain=strain)
    flat = gso.tno.optimize(result.mesh, task="flatten", options="fast")
    assert metrics.face_strains(result.mesh, result.pattern.flat).max() <= strain * (1 + 1e-3)
    # Another image of the same surface needs about as much.
    assert 0.8 * strain <= flat.metrics["strain_max"] <= 1.05 * strain


def test_both_bounds_hold_where_they_can(surfaces):
    mesh = Mesh.from_grid(surfaces[0][::2, ::2])
    bound = 0.04 * mesh.diagonal
    result = gso.tno.optimize(mesh, max_deviation=bound, max_strain=0.01)
    flat = gso.tno.optimize(result.mesh, task="flatten", options="fast")
    assert flat.metrics["strain_max"] <= 0.01 * (1 + 1e-3)
    far = metrics.surface_distance(mesh, result.mesh)
    assert max(far.there_max, far.back_max) <= bound * (1 + 1e-6)


def test_a_target_already_met_changes_nothing():
    points = saddle(16, strength=0.05)
    result = gso.tno.optimize(points, target_curvature=1.0)
    np.testing.assert_array_equal(result.grid, points)


def test_fixed_vertices_and_boundary_do_not_move(surfaces):
    mesh = Mesh.from_grid(surfaces[0])
    result = gso.tno.optimize(mesh, constraints=[gso.FixedBoundary(), gso.Fixed([500])])
    held = np.r_[np.flatnonzero(mesh.half_edges.boundary_vertex), 500]
    np.testing.assert_allclose(result.mesh.vertices[held], mesh.vertices[held], atol=1e-12)
    assert result.metrics["K_A_r"] > 0.1


def test_handles_move_vertices(surfaces):
    mesh = Mesh.from_grid(surfaces[0])
    goal = mesh.vertices[[0]] + [0.0, 0.0, 0.05]
    hard = gso.tno.optimize(mesh, constraints=[gso.Handle([0], goal)])
    np.testing.assert_allclose(hard.mesh.vertices[0], goal[0], atol=1e-12)
    soft = gso.tno.optimize(mesh, constraints=[gso.Handle([0], goal, weight=10.0)])
    assert 0 < np.linalg.norm(soft.mesh.vertices[0] - goal[0]) < 0.05


def test_contradicting_constraints_are_named(surfaces):
    mesh = Mesh.from_grid(surfaces[0])
    with pytest.raises(gso.OptionError, match=r"constraint 0 \(Fixed\).*constraint 1.*vertex 3"):
        gso.tno.optimize(
            mesh, constraints=[gso.Fixed([3]), gso.Handle([3], mesh.vertices[[3]] + 1)]
        )
    with pytest.raises(gso.OptionError, match="vertex 99999"):
        gso.tno.optimize(mesh, constraints=[gso.Fixed([99999])])
    with pytest.raises(gso.OptionError, match="positions"):
        gso.tno.optimize(mesh, constraints=[gso.Handle([1, 2], [[0.0, 0.0, 0.0]])])


def test_a_warm_start_from_the_result_stays_at_least_as_good(surfaces, solved):
    cold = solved(0, "accurate", verdict=False)
    warm = gso.tno.optimize(surfaces[0], options="accurate", x0=cold.mesh, verdict=False)
    assert warm.warm_start == "x0"
    assert sum(warm.energy.values()) <= sum(cold.energy.values()) * (1 + 1e-9)


def test_a_start_that_is_wrong_at_large_costs_no_quality(surfaces, solved):
    ratios = []
    for number, points in enumerate(surfaces):
        cold = solved(number, verdict=False)
        u = np.linspace(0.0, np.pi, len(points))
        lift = 0.02 * np.sin(u)[:, None] * np.sin(u)
        start = cold.grid + lift[..., None] * [0.0, 0.0, 1.0]
        warm = gso.tno.optimize(points, x0=start, verdict=False)
        assert warm.warm_start == "x0" and warm.history[0].name == "20x20"
        ratios.append(sum(warm.energy.values()) / sum(cold.energy.values()))
    # Each solve ends in one of several local minima.
    assert np.mean(ratios) <= 1.03 and max(ratios) <= 1.1


def test_free_vertices_come_after_offsets_where_a_start_is_given(surfaces, solved):
    def stages(result):
        return list(dict.fromkeys(p.name for p in result.history))

    points = surfaces[0]
    warm = gso.tno.optimize(points, options="accurate", verdict=False, x0=points)
    assert stages(solved(0, "accurate", verdict=False)) == ["20x20", "free"]
    assert stages(warm) == ["20x20", "normal", "free"]


def test_irregular_and_triangle_meshes():
    grid = Mesh.from_grid(sphere_cap(21, radius=1.0))
    triangles = Mesh(grid.vertices, grid.triangles)
    holed = Mesh(grid.vertices, np.delete(grid.faces, [150, 151, 170, 171], axis=0))
    for mesh in (triangles, holed):
        result = gso.tno.optimize(mesh)
        assert result.grid is None
        assert result.metrics["K_A_r"] > 0.5
        assert result.metrics["d_H"] < 2.0


def test_a_closed_surface_is_finite_and_no_worse():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    result = gso.tno.optimize(ball, options=replace(Options.preset("fast"), iterations=3))
    assert np.isfinite(result.mesh.vertices).all()


@pytest.mark.parametrize("shape", [(3, 3), (3, 9), (4, 5), (13, 3), (12, 50)])
def test_small_and_oblong_grids(shape):
    result = gso.tno.optimize(saddle(*shape))
    assert result.metrics["loss_gc"] < result.metrics["loss_gc_before"]


def test_options_are_checked():
    with pytest.raises(gso.OptionError, match="w_fairness is -1"):
        Options(w_fairness=-1)
    with pytest.raises(gso.OptionError, match="variables"):
        Options(variables="pink")
    with pytest.raises(gso.OptionError, match=r"no preset 'slow'.*balanced"):
        gso.tno.optimize(saddle(), options="slow")
    with pytest.raises(gso.OptionError, match="formulation"):
        gso.tno.optimize(saddle(), formulation="magic")
    with pytest.raises(gso.OptionError, match="no task"):
        gso.tno.optimize(saddle(), task="bake")
    with pytest.raises(gso.OptionError, match="max_deviation is -1"):
        gso.tno.optimize(saddle(), max_deviation=-1)
    with pytest.raises(gso.OptionError, match="not both"):
        gso.tno.optimize(saddle(), max_deviation=1, target_curvature=1)
    with pytest.raises(gso.OptionError, match="belongs to"):
        gso.tno.optimize(saddle(), task="denoise", max_deviation=1)
    with pytest.raises(gso.OptionError, match="takes"):
        gso.tno.optimize(saddle(), options=gso.DenoiseOptions())
    with pytest.raises(gso.MeshError, match="x0"):
        gso.tno.optimize(saddle(), x0=np.zeros((3, 3)))


def test_a_callback_can_cancel(surfaces):
    seen = []

    def stop(progress):
        seen.append(progress)
        return len(seen) < 4

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = gso.tno.optimize(surfaces[0], callback=stop)
    assert result.status is gso.Status.CANCELLED
    assert np.isfinite(result.grid).all()
    assert any(issubclass(w.category, gso.ConvergenceWarning) for w in caught)


@pytest.mark.slow
def test_one_set_of_weights_serves_three_resolutions():
    from gso.dataset import generate

    figures = []
    for size in (32, 64, 128):
        rows = []
        for surface in generate(12, seed=77):
            points = surface.sample(size)
            m = gso.tno.optimize(points, verdict=False).metrics
            rows.append((m["loss_gc"], m["d_H"]))
        figures.append(np.mean(rows, axis=0))
    spread = np.max(figures, axis=0) / np.min(figures, axis=0)
    assert (spread < 1.2).all()


def test_bounds_and_constraints_together(surfaces):
    mesh = Mesh.from_grid(surfaces[0])
    bound = 0.01 * mesh.diagonal
    near = gso.Handle([40], mesh.vertices[[40]] + [0.0, 0.0, 0.5 * bound])
    for constraints in ([gso.Fixed([3])], [gso.FixedBoundary()], [near]):
        result = gso.tno.optimize(mesh, max_deviation=bound, constraints=constraints)
        assert metrics.point_to_surface(result.mesh.vertices, mesh).max() <= bound * (1 + 1e-6)
    far = gso.Handle([40], mesh.vertices[[40]] + [0.0, 0.0, 2 * bound])
    with pytest.raises(gso.OptionError, match="max_deviation"):
        gso.tno.optimize(mesh, max_deviation=bound, constraints=[far])


def test_a_bound_holds_from_any_start(surfaces):
    mesh = Mesh.from_grid(surfaces[0])
    bound = 0.005 * mesh.diagonal
    away = mesh.vertices + 3 * bound * np.array([0.0, 0.0, 1.0])
    result = gso.tno.optimize(mesh, max_deviation=bound, x0=away)
    assert metrics.point_to_surface(result.mesh.vertices, mesh).max() <= bound * (1 + 1e-6)


def test_noise_bounds_a_warm_start_too():
    clean = cylinder(40, 0.4)
    noise = 1e-3 * metrics.unit(clean)
    noisy = clean + noise * np.random.default_rng(0).standard_normal(clean.shape)
    result = gso.tno.optimize(noisy, x0=clean)
    assert moved(noisy, result.grid).max() <= 3.0 * noise


def test_no_constraints_at_all_are_fine():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=1)
    options = replace(Options.preset("fast"), iterations=1)
    empty = [gso.FixedBoundary(), gso.Fixed([])]
    given, none = (gso.tno.optimize(ball, constraints=c, options=options) for c in (empty, []))
    np.testing.assert_allclose(given.mesh.vertices, none.mesh.vertices, atol=1e-9)


def test_unused_vertices_change_nothing():
    grid = Mesh.from_grid(sphere_cap(15, radius=1.0))
    plain = Mesh(grid.vertices, grid.triangles)
    far = Mesh(np.r_[grid.vertices, [[5.0, 5.0, 5.0]] * 50], grid.triangles)
    a, b = gso.tno.optimize(plain), gso.tno.optimize(far)
    np.testing.assert_allclose(b.mesh.vertices[:-50], a.mesh.vertices, atol=1e-9)
    np.testing.assert_array_equal(b.mesh.vertices[-50:], far.vertices[-50:])
    assert b.metrics == pytest.approx(a.metrics, rel=1e-6)


def test_mixed_meshes_are_fair_across_their_triangles():
    grid = Mesh.from_grid(sphere_cap(15, radius=1.0))
    triangles = np.c_[grid.triangles, np.full(len(grid.triangles), -1)]
    keep = grid.faces[0]
    other = ~np.isin(triangles[:, :3], keep).all(axis=1)
    mixed = Mesh(grid.vertices, np.r_[[keep], triangles[other]])
    ratios = [
        gso.tno.optimize(m, verdict=False).metrics["fairness_ratio"]
        for m in (mixed, Mesh(grid.vertices, grid.triangles))
    ]
    assert ratios[0] == pytest.approx(ratios[1], rel=0.3)


@pytest.mark.filterwarnings("ignore::gso.ConvergenceWarning")
@pytest.mark.parametrize("question", [{"max_deviation": 0.01}, {"target_curvature": 0.02}])
@pytest.mark.parametrize("calls", [5, 30])
def test_a_cancelled_search_says_so(surfaces, question, calls):
    seen = []

    def stop(progress):
        seen.append(progress)
        return np.bool_(len(seen) < calls)

    result = gso.tno.optimize(surfaces[0], callback=stop, **question)
    assert result.status is gso.Status.CANCELLED
    assert np.isfinite(result.grid).all()


def test_a_target_already_met_ignores_the_start():
    points = saddle(16, strength=0.05)
    result = gso.tno.optimize(points, target_curvature=1.0, x0=points + 0.1)
    np.testing.assert_array_equal(result.grid, points)


def test_spline_offsets_as_last_unknowns(surfaces):
    result = gso.tno.optimize(surfaces[0], options=Options(variables="spline", controls=10))
    assert result.metrics["K_A_r"] > 0.4


@pytest.mark.parametrize(
    "x0", ["a.obj", 1.0, np.zeros((144, 4)), np.zeros((9, 16, 3)), (np.zeros((3, 3)), 1)]
)
def test_starts_that_do_not_fit_are_refused(x0):
    with pytest.raises(gso.MeshError, match="x0"):
        gso.tno.optimize(saddle(16, 9), x0=x0)


@pytest.mark.parametrize(
    "settings",
    [
        {"iterations": 2.5},
        {"iterations": "5"},
        {"w_fairness": "a"},
        {"w_curvature": np.inf},
        {"eps": np.inf},
        {"tolerance": np.nan},
        {"threads": -1},
        {"controls": 2},
    ],
)
def test_settings_that_make_no_sense_are_named(settings):
    with pytest.raises(gso.OptionError, match=next(iter(settings))):
        Options(**settings)


@pytest.mark.parametrize(
    "handle",
    [
        gso.Handle([0], [1.0, 2.0]),
        gso.Handle([0], [[0.0, 0.0, 0.0]], weight="a"),
        gso.Handle([0], [[0.0, 0.0, 0.0]], weight=np.inf),
        gso.Handle([0], "up"),
    ],
)
def test_handles_that_make_no_sense_are_named(handle):
    with pytest.raises(gso.OptionError, match=r"constraint 0 \(Handle\)"):
        gso.tno.optimize(saddle(9), constraints=handle)
