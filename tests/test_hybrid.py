"""The net starts the optimiser, and never makes it worse."""

from __future__ import annotations

import warnings
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import gso
from gso import IsometryOptions as JointOptions
from gso import MeshError, OptionError, WeightsError, hybrid, tno
from gso.hierarchy import resample
from gso.hybrid import better_start, expected_seconds, load_seconds, net_saves_time
from gso.mesh import Mesh
from gso.mesh.topology import reverse
from gso.parametrization import as_patch
from gso.pipeline import Run
from gso.tno import Start
from tests.conftest import cylinder, saddle, shuffled, sphere_cap

try:
    import torch

    from gso.net import CoarseNet
except ImportError:
    torch = None

needs_torch = pytest.mark.skipif(torch is None, reason="no torch")


def made(task="developable", size=0.0, seed=0):
    """A small net whose displacements are about so large; zero: none at all."""
    torch.manual_seed(seed)
    net = CoarseNet(task, widths=(8, 8, 8), depths=(1, 1, 1), passes=1)
    for head in (net.coarse_head, net.fine_head):
        torch.nn.init.normal_(head.weight, std=size)
    return net


def energy(result):
    return sum(result.energy.values())


def same(a, b):
    """Whether two results are the same to the last bit."""
    assert (a.mesh.vertices == b.mesh.vertices).all()
    assert a.status is b.status
    return a.energy == b.energy


@pytest.fixture(scope="module")
def optimum(surfaces):
    """Solves without a start, by the number of the surface; each is made once."""
    return cache(lambda number, **keywords: tno.optimize(surfaces[number], **keywords))


@cache
def optimum_of_saddle(n, **keywords):
    """A solve of a saddle without a start, made once."""
    return tno.optimize(saddle(n), **keywords)


# ---------------------------------------------------------------- starts


def test_a_guarded_start_that_is_worse_is_dropped(surfaces, optimum):
    design = surfaces[0]
    rng = np.random.default_rng(0)
    start = Start(design + 0.1 * rng.standard_normal(design.shape), source="guess", guarded=True)
    cold, result = optimum(0), tno.optimize(design, x0=start)
    assert same(cold, result)
    assert result.warm_start == "cold"
    said = [note for note in result.notes if note not in cold.notes]
    assert len(said) == 1
    assert "the start (guess) was not used: its energy" in said[0]


def test_a_guarded_start_that_is_better_is_used(surfaces, optimum):
    design = surfaces[0]
    good = optimum(0, verdict=False)
    start = Start(good.mesh, source="guess", guarded=True)
    result = tno.optimize(design, x0=start, verdict=False)
    assert result.warm_start == "guess"
    assert energy(result) <= energy(good) * (1 + 1e-9)


def test_a_search_is_the_same_once_its_start_is_dropped():
    design = saddle(9)
    start = Start(2.0 * design, source="guess", guarded=True)
    for keywords in ({"target_curvature": 0.2}, {"max_deviation": 0.05}):
        cold, result = optimum_of_saddle(9, **keywords), tno.optimize(design, x0=start, **keywords)
        assert same(cold, result)
        assert (result.warm_start, result.iterations) == ("cold", cold.iterations)


def test_a_search_may_begin_at_its_own_results(monkeypatch):
    design = saddle(9)
    seen = []
    usable = Run.usable_start

    def counted(self, *requests):
        seen.extend(r for r in requests if r.x0 is not None)
        return usable(self, *requests)

    monkeypatch.setattr(Run, "usable_start", counted)
    near = Start(optimum_of_saddle(9, verdict=False).mesh, source="guess", guarded=True)
    assert tno.optimize(design, x0=near, target_curvature=0.2).warm_start == "guess"
    assert len(seen) == 1


def test_a_spline_is_compared_before_it_is_fitted(surfaces):
    design = surfaces[0][::2, ::2]
    options = JointOptions(variables="surface", controls=6, iterations=1)
    good = Start(tno.optimize(design).mesh, source="guess", guarded=True)
    result = tno.optimize(design, formulation="isometry", options=options, x0=good)
    assert result.warm_start == "guess"


@pytest.mark.parametrize("most", [-1, 1.5, True, "few"])
def test_iterations_of_a_start_are_a_number(most):
    with pytest.raises(OptionError, match="iterations is"):
        Start(None, iterations=most)


@pytest.mark.parametrize("tolerance", [-1.0, "loose", None])
def test_the_tolerance_of_a_start_is_a_number(tolerance):
    with pytest.raises(OptionError, match="tolerance is"):
        Start(None, tolerance=tolerance)


def test_a_tolerance_ends_solves_from_a_start_only(surfaces, optimum):
    design = surfaces[1]
    cold = optimum(1)
    assert same(cold, tno.optimize(design, x0=Start(None, tolerance=0.5)))
    near = tno.optimize(design, options="fast").mesh
    closely, loosely = (
        tno.optimize(design, x0=Start(near, tolerance=t), verdict=False) for t in (0.0, 0.5)
    )
    assert loosely.iterations < closely.iterations
    assert energy(closely) < energy(loosely)


def test_a_joint_solve_that_is_done_does_not_begin_again_on_a_coarser_grid(surfaces, optimum):
    design = surfaces[0]
    cold = optimum(0, options="jiang2020")
    again = tno.optimize(design, options="jiang2020", x0=cold.mesh)
    assert {p.name for p in again.history} == {cold.history[-1].name}
    assert energy(again) <= 1.001 * energy(cold)
    afar = tno.optimize(design, options="jiang2020", x0=design)
    assert afar.history[0].name != afar.history[-1].name


@pytest.mark.parametrize("most", [0, 1, 3])
@pytest.mark.parametrize(
    "keywords",
    [{}, {"formulation": "isometry"}, {"task": "flatten"}, {"max_deviation": 0.1}],
    ids=["curvature", "isometry", "flatten", "bound"],
)
def test_iterations_of_a_start_are_counted_over_all_stages(surfaces, optimum, keywords, most):
    design = surfaces[1]
    start = design
    if keywords.get("task") == "flatten":
        start = optimum(1, task="flatten").flat_grid
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        result = tno.optimize(design, x0=Start(start, iterations=most), **keywords)
    assert result.iterations <= most
    assert np.isfinite(result.mesh.vertices).all()


def test_a_flat_start_that_turns_over_is_dropped():
    design = sphere_cap(17)
    cold = tno.optimize(design, task="flatten")
    turned = cold.flat_grid[::-1]
    result = tno.optimize(design, task="flatten", x0=Start(turned, guarded=True))
    assert same(cold, result)
    assert "turns" in result.notes[-1]


@pytest.mark.parametrize(
    "keywords",
    [
        {},
        {"formulation": "isometry"},
        {"task": "flatten"},
        {"task": "flatten", "formulation": "lengths"},
        {"task": "flatten", "formulation": "isometry"},
        {"max_deviation": 0.05, "formulation": "curvature"},
        {"constraints": [gso.Handle([0, 16, 272], saddle(17).reshape(-1, 3)[[0, 16, 272]] * 1.1)]},
    ],
    ids=lambda k: "-".join(map(str, k.values()))[:20] or "curvature",
)
def test_a_good_start_stays_good(keywords):
    # Without limits, a start is used only where its result is usable.
    design = saddle(17, strength=0.4 if {"max_deviation", "constraints"} & {*keywords} else 0.1)
    cold = tno.optimize(design, **keywords)
    points = cold.flat if keywords.get("task") == "flatten" else cold.mesh
    result = tno.optimize(design, x0=Start(points, source="guess", guarded=True), **keywords)
    assert result.warm_start == "guess"
    if "max_deviation" in keywords:
        # A search takes what has the least strain, whatever weights it took.
        assert result.metrics["strain_max"] <= 1.02 * cold.metrics["strain_max"]
    else:
        assert energy(result) <= 1.02 * energy(cold)


@pytest.mark.parametrize("task", ["flatten", "conformal"])
@pytest.mark.parametrize("weight", [None, 10.0], ids=["hard", "soft"])
def test_a_flat_start_is_moved_to_its_constraints(task, weight):
    design = saddle(13)
    free = tno.optimize(design, task=task).flat
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    ids = [0, 12, 156]
    wanted = gso.Handle(ids, free[ids] @ turn + [30.0, -7.0], weight=weight)
    cold = tno.optimize(design, task=task, constraints=[wanted])
    result = tno.optimize(design, task=task, constraints=[wanted], x0=Start(free, guarded=True))
    assert result.warm_start == "x0"
    assert energy(result) <= 1.05 * energy(cold) + 1e-9
    assert np.allclose(result.flat, cold.flat, atol=0.05)


def test_a_start_that_is_not_used_did_not_start_anything():
    design = sphere_cap(9)
    turned = tno.optimize(design, task="flatten").flat_grid[::-1]
    result = tno.optimize(design, task="flatten", x0=turned)
    assert result.warm_start == "cold"
    assert sum("x0" in note for note in result.notes) == 1


def test_a_target_needs_more_than_one_solve_without_a_net():
    with pytest.raises(OptionError, match="target_curvature takes many solves"):
        tno.optimize(saddle(9), x0=Start(None, iterations=3), target_curvature=0.1)


# ---------------------------------------------------------------- with a net


@needs_torch
@pytest.mark.parametrize("formulation", ["curvature", "isometry"])
def test_a_random_net_costs_time_not_quality(surfaces, formulation):
    design = surfaces[0][::2, ::2]
    cold = tno.optimize(design, formulation=formulation)
    result = hybrid.solve(design, net=made(size=0.5), formulation=formulation)
    assert same(cold, result)
    assert result.warm_start == "cold"
    assert result.seconds["net"] > 0
    assert any("was not used" in note for note in result.notes)


@needs_torch
def test_a_random_net_costs_time_not_quality_flat(surfaces, optimum):
    cold = optimum(0, task="flatten")
    result = hybrid.solve(surfaces[0], task="flatten", net=made("flatten", size=5.0))
    assert same(cold, result)


@needs_torch
def test_the_net_alone_is_what_predict_gives(surfaces):
    design, net = surfaces[0], made(size=0.01)
    result = hybrid.solve(design, net=net, polish=False)
    assert result.warm_start == "net"
    assert result.iterations == 0
    assert np.allclose(result.grid, gso.net.predict(design, model=net), atol=1e-9)
    assert result.details["net"] == "CoarseNet"
    assert result.seconds["total"] >= result.seconds["net"] > 0


@needs_torch
def test_the_net_alone_flattens(surfaces):
    net = made("flatten", size=0.01)
    result = hybrid.solve(surfaces[0], task="flatten", net=net, polish=False)
    expected = gso.net.predict(surfaces[0], task="flatten", model=net)
    apart = [np.linalg.norm(np.diff(f, axis=0), axis=-1) for f in (result.flat_grid, expected)]
    assert np.allclose(*apart)


def prediction(points=None, net="", refused=""):
    return SimpleNamespace(points=points, seconds=0.01, net=net, refused=refused)


@pytest.fixture
def coarse_net(monkeypatch):
    """Predictions like those of a fair net, and why there is none where that is asked."""

    def predictions(designs, task, net, polish):
        if net == "none":
            return [prediction(refused="there is none")] * len(designs)
        few = gso.DevelopableOptions(iterations=1)
        results = [tno.optimize(design, options=few) for design in designs]
        return [prediction(r.mesh.vertices, "fair") for r in results]

    monkeypatch.setattr("gso.hybrid.solving.predictions", predictions)


def predicts(monkeypatch, points):
    """Let every net make the same of every design."""
    found = prediction(points, "odd")
    monkeypatch.setattr(
        "gso.hybrid.solving.predictions", lambda designs, **_: [found] * len(designs)
    )


@pytest.mark.parametrize("polish", [True, False])
@pytest.mark.parametrize(
    ("keywords", "points", "words"),
    [
        ({}, np.full((81, 3), np.nan), "not finite"),
        ({}, np.ones((81, 3)), "no area"),
        ({"formulation": "isometry"}, np.eye(3)[np.arange(81) // 27], "area"),
        ({"task": "flatten"}, np.zeros((81, 2)), "turns 256 corner triangles over"),
        ({"task": "flatten"}, saddle(9).reshape(-1, 3)[:, 1::-1], "turns 256 corner"),
    ],
    ids=["nan", "point", "points", "flat point", "mirrored"],
)
def test_nonsense_is_dropped_polished_or_not(monkeypatch, keywords, points, words, polish):
    cold = optimum_of_saddle(9, **keywords)
    predicts(monkeypatch, points)
    result = hybrid.solve(saddle(9), polish=polish, **keywords)
    assert same(cold, result)
    assert (result.warm_start, result.seconds["net"]) == ("cold", 0.01)
    assert "solved without a net" in result.notes[-1] and words in result.notes[-1]


@pytest.mark.parametrize("polish", [True, False])
@pytest.mark.parametrize("general", [False, True], ids=["grid", "mesh"])
def test_flat_images_lie_where_the_optimiser_puts_them(monkeypatch, general, polish):
    mesh = ragged(17) if general else shuffled(Mesh.from_grid(saddle(17)))
    cold = tno.optimize(mesh, task="flatten")
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    predicts(monkeypatch, (cold.flat - cold.flat.mean(axis=0)) @ turn)
    result = hybrid.solve(mesh, task="flatten", polish=polish)
    assert result.warm_start == "net"
    assert np.allclose(result.flat.min(axis=0), 0.0, atol=1e-12)
    assert np.abs(result.flat - cold.flat).max() < 0.1  # of 2
    assert (result.mesh.vertices[:, :2] == result.flat).all()


def test_errors_of_the_design_are_its_own(coarse_net):
    with pytest.raises(MeshError, match="no interior vertex"):
        hybrid.solve(([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), net="none")


@pytest.mark.parametrize("polish", [False, 0, 3])
def test_a_target_needs_more_than_one_solve(coarse_net, polish):
    with pytest.raises(OptionError, match="target_curvature takes many solves"):
        hybrid.solve(saddle(9), polish=polish, target_curvature=0.1)


def test_a_bound_holds_for_the_net_alone(surfaces, coarse_net):
    result = hybrid.solve(surfaces[0], polish=False, max_deviation=0.01)
    moved = np.linalg.norm(result.grid - surfaces[0], axis=-1)
    assert (result.warm_start, result.iterations) == ("net", 0)
    assert 0 < moved.max() <= 0.01


def test_polish_as_numpy_has_it(coarse_net):
    for given, plain in ((np.True_, True), (np.False_, False), (np.int64(2), 2)):
        here, there = (hybrid.solve(saddle(9), polish=p) for p in (given, plain))
        assert same(here, there)


def test_constraints_may_be_an_iterator(surfaces, coarse_net):
    plain, given = [gso.FixedBoundary()], iter([gso.FixedBoundary()])
    results = [hybrid.solve(saddle(13), polish=1, constraints=c) for c in (plain, given)]
    assert same(*results)


@pytest.mark.parametrize("most", [0, 1, 4])
@pytest.mark.parametrize("net", ["fair", "none"])
def test_polish_is_bounded(surfaces, coarse_net, most, net):
    result = hybrid.solve(surfaces[0], net=net, polish=most)
    assert min(most, 1) <= result.iterations <= most
    if most or net == "fair":
        assert result.metrics["loss_gc"] < result.metrics["loss_gc_before"]
    assert result.warm_start == ("net" if net == "fair" else "cold")


def test_polish_goes_on_where_the_net_ended(surfaces, optimum, coarse_net):
    # A solve near the design, which may follow, has another energy.
    alone = hybrid.solve(surfaces[0], polish=False, verdict=False)
    some = hybrid.solve(surfaces[0], polish=3, verdict=False)
    whole = hybrid.solve(surfaces[0], verdict=False)
    cold = optimum(0, verdict=False)
    assert energy(alone) > energy(some) > energy(whole)
    assert energy(whole) < 1.1 * energy(cold)
    assert whole.iterations < cold.iterations
    assert (alone.seconds["net"], alone.iterations) == (0.01, 0)


@needs_torch
@pytest.mark.parametrize("task", ["denoise", "bend", "conformal"])
def test_tasks_without_nets_are_solved(task):
    constraints = [gso.Handle([0], [(-1.0, -1.0, 1.0)]), gso.Fixed([80])] if task == "bend" else []
    cold = tno.optimize(saddle(9), task=task, constraints=constraints)
    result = hybrid.solve(saddle(9), task=task, constraints=constraints)
    assert same(cold, result)
    assert "no net makes a start" in result.notes[-1]


@needs_torch
def test_a_denoising_net_alone_is_asked():
    clean = saddle(64)
    noisy = clean + 0.005 * np.random.default_rng(0).standard_normal(clean.shape)
    result = hybrid.solve(noisy, task="denoise", polish=False)
    assert (result.warm_start, result.details["net"]) == ("net", "denoise")
    np.testing.assert_allclose(result.grid, gso.net.predict(noisy, task="denoise"), atol=1e-6)
    assert "no net makes a start" in hybrid.solve(noisy, task="denoise").notes[-1]
    triangles = Mesh(noisy.reshape(-1, 3), Mesh.from_grid(noisy).triangles)
    assert "take grids" in hybrid.solve(triangles, task="denoise", polish=False).notes[-1]


@needs_torch
@pytest.mark.parametrize("task", ["developable", "flatten", "denoise"])
def test_a_net_that_is_named_must_be_there(task):
    with pytest.raises(WeightsError, match="no net 'nonsense'"):
        hybrid.solve(saddle(13), task=task, net="nonsense")


@needs_torch
def test_a_developable_design_stays_untouched():
    result = hybrid.solve(cylinder(33), net=made(size=0.02))
    assert result.status is gso.Status.ALREADY_GOOD
    assert (result.grid == cylinder(33)).all()


@needs_torch
def test_constraints_hold(surfaces):
    design = surfaces[0]
    result = hybrid.solve(design, net=made(size=0.01), constraints=[gso.FixedBoundary()])
    border = np.ones(design.shape[:2], bool)
    border[1:-1, 1:-1] = False
    assert np.allclose(result.grid[border], design[border], atol=1e-12)


@needs_torch
@pytest.mark.parametrize(
    ("keywords", "error", "words"),
    [
        ({"polish": -1}, OptionError, "polish is -1"),
        ({"polish": "yes"}, OptionError, "polish is 'yes'"),
        ({"x0": 1}, OptionError, "gso.tno.optimize"),
        ({"net": "nothing"}, WeightsError, "no net 'nothing'"),
        ({"options": "best"}, OptionError, "no preset 'best'"),
    ],
)
def test_wrong_arguments_are_named(keywords, error, words):
    with pytest.raises(error, match=words):
        hybrid.solve(saddle(9), **keywords)


@needs_torch
def test_a_net_of_another_task_is_refused():
    with pytest.raises(OptionError, match="task 'flatten'"):
        hybrid.solve(saddle(9), net=made("flatten"))


# ---------------------------------------------------------------- without one


def test_without_torch_it_is_the_optimiser(monkeypatch, surfaces, optimum):
    monkeypatch.setattr("gso.net.catalogue.find_spec", lambda name: None)
    cold, result = optimum(0), hybrid.solve(surfaces[0])
    assert same(cold, result)
    assert "torch" in result.notes[-1]
    assert result.warm_start == "cold"


def test_without_weights_it_is_the_optimiser(monkeypatch, tmp_path, surfaces, optimum):
    monkeypatch.setattr("gso.net.catalogue.FOLDER", tmp_path)
    cold, result = optimum(0), hybrid.solve(surfaces[0])
    assert same(cold, result)
    assert "no net" in result.notes[-1]


@needs_torch
def test_a_developable_design_is_left_as_it_is():
    u, v = np.meshgrid(np.linspace(-1, 1, 24), np.linspace(-1, 1, 24), indexing="ij")
    design = np.stack([u, v, 0.3 * u * u], axis=-1)
    result = hybrid.solve(design)
    assert result.warm_start == "cold" and np.array_equal(result.mesh.grid, design)
    assert "developable as it is" in result.notes[-1]


@needs_torch
def test_a_small_grid_is_the_optimisers():
    cold, result = tno.optimize(saddle(5)), hybrid.solve(saddle(5), net=made(size=0.01))
    assert same(cold, result)
    assert "5 x 5" in result.notes[-1]
    assert result.seconds["net"] > 0


@needs_torch
def test_a_small_mesh_is_the_optimisers():
    mesh = ragged(7)
    cold, result = tno.optimize(mesh), hybrid.solve(mesh, net=made(size=0.01), polish=False)
    assert same(cold, result)
    assert "49 vertices" in result.notes[-1]


@needs_torch
def test_what_is_no_disk_is_the_optimisers():
    grid = Mesh.from_grid(saddle(9))
    other = grid.vertices + np.array([5.0, 0.0, 0.0])
    both = Mesh(
        np.concatenate([grid.vertices, other]), np.concatenate([grid.faces, grid.faces + 81])
    )
    tied = {"constraints": [gso.Glue([[80, 81]])]}
    cold = tno.optimize(both, **tied)
    result = hybrid.solve(both, net=made(size=0.01), polish=False, **tied)
    assert same(cold, result)
    assert "one piece" in result.notes[-1]
    apart, alone = (hybrid.solve(mesh, net=made(size=0.01)) for mesh in (both, grid))
    assert all(part.warm_start == alone.warm_start for part in apart.components)
    assert np.array_equal(apart.components[0].mesh.vertices, alone.mesh.vertices)


@needs_torch
def test_a_surface_unlike_all_that_nets_are_taught_is_the_optimisers():
    rough = saddle(17)
    rough[..., 2] += np.random.default_rng(3).normal(0.0, 0.1, rough.shape[:2])
    cold, result = tno.optimize(rough), hybrid.solve(rough, net=made(size=0.01))
    assert same(cold, result)
    assert "too far from what nets are taught" in result.notes[-1]
    # The net alone is what was asked for.
    assert hybrid.solve(rough, net=made(size=0.01), polish=False).warm_start == "net"


# ---------------------------------------------------------------- any mesh


def ragged(n=33, hole=0, seed=0):
    """A triangulated patch with vertices in random order, and maybe a hole."""
    grid = Mesh.from_grid(saddle(n))
    centre = grid.vertices[grid.triangles].mean(axis=1)[:, :2]
    faces = grid.triangles[np.abs(centre - 0.2).max(axis=1) > 0.05 * hole]
    order = np.random.default_rng(seed).permutation(len(grid.vertices))
    kept = np.isin(order, faces)
    new = np.full(len(order), -1)
    new[order[kept]] = np.arange(kept.sum())
    return Mesh(grid.vertices[order[kept]], new[faces])


@pytest.mark.parametrize(("hole", "most"), [(0, 2e-3), (3, 0.03)])
def test_a_mesh_becomes_a_grid_and_comes_back(hole, most):
    mesh = ragged(hole=hole)
    patch = as_patch(mesh, 48)
    away = np.linalg.norm(patch.at_vertices(patch.grid) - mesh.vertices, axis=1)
    assert away.max() < most  # of 2; next to holes the map is not smooth
    assert (
        gso.metrics.point_to_surface(patch.grid.reshape(-1, 3), Mesh.from_grid(saddle(33))).max()
        < 5e-3
    )
    # The same side is up.
    u, v = np.gradient(patch.grid, axis=0), np.gradient(patch.grid, axis=1)
    assert (np.cross(u, v)[..., 2] > 0).all()


def test_a_round_mesh_becomes_a_grid():
    r, a = np.meshgrid(np.linspace(0.1, 1, 12), 2 * np.pi * np.arange(40) / 40, indexing="ij")
    x, y = r * np.cos(a), r * np.sin(a)
    points = np.stack([x, y, 0.2 * x * y], axis=-1).reshape(-1, 3)
    k = np.arange(40)
    ring = np.stack([k, k + 40, (k + 1) % 40 + 40, (k + 1) % 40], axis=1)
    mesh = Mesh(points, np.concatenate([ring + 40 * j for j in range(11)]))
    patch = as_patch(mesh, 32)
    away = np.linalg.norm(patch.at_vertices(patch.grid) - mesh.vertices, axis=1)
    assert away.max() < 0.03


@pytest.mark.parametrize(("unit", "place"), [(1e-80, 0.0), (1e80, 0.0), (1.0, 1e6)])
def test_a_patch_is_the_same_in_any_unit_and_place(unit, place):
    mesh = ragged(17, hole=2)
    here = as_patch(mesh, 24)
    there = as_patch(mesh.replaced(unit * mesh.vertices + place), 24)
    assert np.allclose(there.parameters, here.parameters, atol=1e-6)
    assert np.allclose((there.grid - place) / unit, here.grid, atol=1e-6)


def test_a_slit_is_bridged():
    """Two triangles of a planar grid lose their common edge."""
    grid = Mesh.from_grid(saddle(17, strength=0.0))
    middle = 8 * 17 + 8
    triangles = grid.triangles.copy()
    right = (triangles == middle).any(axis=1)
    right &= grid.vertices[triangles].mean(axis=1)[:, 0] > 0
    triangles[right] = np.where(triangles[right] == middle, 17 * 17, triangles[right])
    mesh = Mesh(np.concatenate([grid.vertices, grid.vertices[[middle]]]), triangles)
    patch = as_patch(mesh, 24)
    assert np.allclose(patch.at_vertices(patch.grid), mesh.vertices, atol=0.1)


@needs_torch
@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_vertices_of_no_face_count_in_nothing(task):
    mesh = ragged(13)
    more = Mesh(np.concatenate([[[9.0, 9, 9]], mesh.vertices]), mesh.faces + 1)
    net = made(task, size=0.002)
    plain, result = (hybrid.solve(m, task=task, net=net, polish=False) for m in (mesh, more))
    assert result.warm_start == "net"
    if task == "developable":
        assert (result.mesh.vertices[0] == 9.0).all()
    assert np.allclose(result.mesh.vertices[1:], plain.mesh.vertices)


@needs_torch
@pytest.mark.parametrize("turn", [shuffled, lambda m: Mesh(m.vertices, reverse(m.faces))])
def test_a_grid_may_be_numbered_and_oriented_at_will(turn):
    mesh = turn(Mesh.from_grid(saddle(12, 17)))
    net = made(size=0.01)
    result = hybrid.solve(mesh, net=net, polish=False)
    assert result.warm_start == "net"
    assert np.allclose(result.grid, gso.net.predict(mesh.grid, model=net), atol=1e-9)
    image = hybrid.solve(mesh, task="flatten", net=made("flatten", size=0.002), polish=False)
    assert (image.warm_start, image.metrics["flipped_cells"]) == ("net", 0)


@needs_torch
def test_a_welded_pole_is_a_mesh_like_others():
    fan = saddle(12)
    fan[0] = fan[0].mean(axis=0)
    result = hybrid.solve(fan, net=made(), polish=False)
    assert result.warm_start == "net"
    assert np.allclose(result.mesh.vertices, Mesh.from_grid(fan).vertices, atol=1e-9)


def test_a_closed_mesh_is_no_patch():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(MeshError, match="one piece"):
        as_patch(Mesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]), 16)


@needs_torch
@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_a_net_alone_takes_meshes_and_starts_no_solve_of_them(task):
    mesh = ragged(17, hole=2)
    alone = hybrid.solve(mesh, task=task, net=made(task), polish=False)
    assert alone.warm_start == "net"
    if task == "developable":
        # A net that moves nothing.
        assert np.allclose(alone.mesh.vertices, mesh.vertices, atol=1e-9)
    else:
        assert alone.metrics["flipped_cells"] == 0
    cold, result = tno.optimize(mesh, task=task), hybrid.solve(mesh, task=task, net=made(task))
    assert same(cold, result)
    assert result.notes[-1].startswith("solved without a net: ")


# ---------------------------------------------------------------- many


@needs_torch
@pytest.mark.parametrize("workers", [0, 2])
def test_many(workers, surfaces):
    designs = [surfaces[0], saddle(9), np.full((4, 4, 3), np.nan), surfaces[1]]
    net = made(size=0.002)
    items = {i.index: i for i in hybrid.solve_many(designs, net=net, polish=2, workers=workers)}
    assert "not finite" in items[2].error
    for k in (0, 1, 3):
        alone = hybrid.solve(designs[k], net=net, polish=2)
        assert np.allclose(items[k].result.mesh.vertices, alone.mesh.vertices, atol=1e-6)
        assert items[k].result.warm_start == alone.warm_start


@pytest.mark.parametrize(
    ("polish", "name"), [(True, "developable-start"), (3, "developable"), (False, "developable")]
)
def test_a_net_of_its_own_starts_whole_solves(surfaces, polish, name):
    assert hybrid.solve(surfaces[0], polish=polish).details["net"] == name
    (item,) = hybrid.solve_many([surfaces[0]], polish=polish, workers=0)
    assert item.result.details["net"] == name


# ---------------------------------------------------------------- where a net pays


@pytest.fixture
def measurements(monkeypatch):
    """Time proportional to the number of vertices; the net saves half of it, PyTorch takes 1 s."""

    def rows(*energies):
        sizes = (1000, 10_000, 100_000)
        return [
            {"vertices": n, "cold": 1e-4 * n, "net": 5e-5 * n, "energy": e, "strain": 1.0}
            for n, e in zip(sizes, energies, strict=True)
        ]

    presets = {"balanced": rows(1.02, 1.0, 1.0), "accurate": rows(1.0, 1.01, 1.02)}
    found = {"load": {"torch": 1.0, "onnxruntime": 0.1}, "presets": presets}
    monkeypatch.setattr("gso.hybrid.time_model.measured", lambda: found)


@pytest.mark.parametrize(
    ("size", "keywords", "many", "expected"),
    [
        (64, {}, True, False),  # it would save time, at other quality
        (100, {}, False, False),
        (128, {}, True, True),
        (160, {}, False, True),
        (160, {"options": "accurate"}, True, False),
        (160, {"options": "jiang2020"}, False, False),
        (160, {"max_deviation": 1.0}, False, False),
        (160, {"constraints": [gso.FixedBoundary()]}, False, False),
        (160, {"options": gso.DevelopableOptions(variables="spline")}, False, False),
    ],
)
def test_where_a_net_pays(measurements, size, keywords, many, expected):
    mesh = Mesh.from_grid(saddle(size))
    assert net_saves_time(mesh, "developable", keywords, many=many) is expected
    assert not net_saves_time(mesh, "flatten", {})
    assert not net_saves_time(Mesh(mesh.vertices, mesh.triangles), "developable", keywords)


@cache
def design_and_optimum(**keywords):
    """A design, cut into pieces where there are no keywords, and its result without a net."""
    design = Mesh.from_grid(saddle(9))
    if not keywords:
        design = gso.cut(design, gso.seams.Path([4 * 9, 4 * 9 + 8]))
    return design, tno.optimize(design, verdict=False, **keywords)


@pytest.mark.parametrize("sparing", [True, False])
@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"max_deviation": "1%"}, "within max_deviation, nets were not found to help"),
        ({"formulation": "ruled"}, "for strips, nets were not found to help"),
        ({}, "for designs cut into pieces, nets were not found to help"),
    ],
)
def test_a_cold_start_where_nets_were_not_found_to_help(monkeypatch, keywords, words, sparing):
    monkeypatch.setattr(
        "gso.hybrid.solving.predictions", lambda designs, **_: [1 / 0 for _ in designs]
    )
    design, cold = design_and_optimum(**keywords)
    result = hybrid.solve(design, verdict=False, sparing=sparing, **keywords)
    (item,) = hybrid.solve_many([design], workers=0, verdict=False, sparing=sparing, **keywords)
    # With `sparing` the result is that of the optimiser, and its notes are, too.
    said = () if sparing else (f"solved without a net: {words}",)
    for found in (result, item.result):
        assert same(cold, found)
        assert (found.warm_start, found.notes) == ("cold", cold.notes + said)


@pytest.mark.parametrize(
    ("net", "expected"),
    [
        (None, False),
        ("net-c", False),
        ("net.onnx", True),
        (["a.onnx", "b.onnx"], True),
        (["a.onnx", "net-c"], False),
    ],
)
def test_onnx_runtime_loads_sooner(measurements, net, expected):
    mesh = Mesh.from_grid(saddle(128))
    assert net_saves_time(mesh, "developable", {}, net=net) is expected
    assert net_saves_time(mesh, "developable", {}, net=net, many=True)


def test_measured_times_rise_with_the_size():
    assert 0 < load_seconds("net.onnx") < load_seconds(None) < load_seconds(["a.onnx", "b"])
    for preset in ("balanced", "accurate"):
        cold, _ = zip(
            *(expected_seconds(preset, n) for n in (2000, 5000, 20_000, 100_000)), strict=True
        )
        assert list(cold) == sorted(cold)


# ---------------------------------------------------------------- large grids


@pytest.fixture(scope="module")
def large(surfaces):
    """A large grid, solved on coarser ones first, and its result without a start."""
    design = resample(surfaces[0], 80, 70)
    return design, tno.optimize(design, verdict=False)


def test_a_start_of_known_resolution_reaches_the_same_energy(large):
    design, cold = large
    near = tno.optimize(design, options="fast", verdict=False).mesh
    start = Start(near, source="guess", guarded=True, resolution=40)
    result = tno.optimize(design, x0=start, verdict=False)
    assert result.warm_start == "guess"
    assert energy(result) <= 1.03 * energy(cold)
    # The grid of twice the resolution starts from the design, moved.
    assert [p.name for p in result.history if p.iteration == 0][-2:] == ["40x35", "normal"]


def test_a_solved_start_is_not_solved_on_coarser_grids(large):
    design, cold = large
    start = Start(cold.mesh, source="guess", resolution=64, solved=True)
    result = tno.optimize(design, x0=start, verdict=False)
    assert {p.name for p in result.history} == {"normal"}
    assert energy(result) <= 1.001 * energy(cold)


def test_the_better_of_two_starts_is_refined(large):
    design, cold = Mesh.from_grid(large[0]), large[1]
    options = gso.DevelopableOptions()
    for points, source in ((cold.mesh.vertices, "net"), (design.vertices * [1, 1, 1.3], "cold")):
        start = better_start(design, points, 64, options, tno.optimize, judged=False)
        assert (start.resolution, start.solved) == (40, True)
        result = tno.optimize(design, x0=start, verdict=False)
        assert energy(result) <= 1.01 * energy(cold), source
    small = Mesh.from_grid(saddle(19))
    assert better_start(small, small.vertices, 64, options, tno.optimize) is None


def test_large_grids_are_solved_without_a_net_and_end_early(coarse_net):
    design = Mesh.from_grid(saddle(256, 9))
    result = hybrid.solve(design, verdict=False)
    assert result.warm_start == "cold" and "256 vertices" in result.notes[0]
    early = tno.optimize(design, x0=Start(None, remaining=3.5e-3), verdict=False)
    assert np.array_equal(result.mesh.vertices, early.mesh.vertices)
    (item,) = hybrid.solve_many([design], verdict=False, workers=0)
    assert np.array_equal(item.result.mesh.vertices, early.mesh.vertices)
    for keywords in ({"effort": 1}, {"options": "accurate"}, {"polish": 1}):
        assert "256 vertices" not in str(hybrid.solve(design, verdict=False, **keywords).notes)
    spared = hybrid.solve(design, sparing=True, verdict=False)
    whole = tno.optimize(design, verdict=False)
    assert np.array_equal(spared.mesh.vertices, whole.mesh.vertices) and spared.notes == ()


@pytest.mark.parametrize(
    "far, judged, source",
    [
        ((0.01, 0.10), False, "net"),
        ((0.01, 0.04), True, "net"),
        ((0.01, 0.06), True, "cold"),
        ((0.06, 0.06), True, None),
    ],
)
def test_a_start_whose_minimum_is_too_far_is_not_refined(far, judged, source):
    design = Mesh.from_grid(saddle(65))

    def solve(copy, options, verdict, x0):
        # The minimum from the net is lower; both are at some share of the size from the design.
        deviation = far[x0 is not None] * copy.size
        moved = copy.replaced(copy.vertices + np.array([0, 0, deviation]))
        energy = {"curvature": 1.0 - (x0 is not None)}
        return SimpleNamespace(design=copy, mesh=moved, energy=energy, deviation=deviation)

    found = better_start(design, design.vertices, 33, gso.DevelopableOptions(), solve, judged)
    assert (None if found.points is None else found.source) == source


def test_a_solve_near_the_design_follows_a_start_that_ends_too_far():
    x, y = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21), indexing="ij")
    parabola, wave = np.dstack([x, y, 0.3 * x * x]), 0.168 * np.sin(2 * np.pi * y) * x
    design = Mesh.from_grid(parabola + np.multiply.outer(wave, [0, 0, 1]))
    cold = tno.optimize(design)
    assert cold.usable and not cold.notes
    alone = tno.optimize(design, x0=Start(parabola, guarded=True), verdict=False)
    assert alone.warm_start != "cold" and alone.deviation > 0.05 * design.size
    judged = tno.optimize(design, x0=Start(parabola, guarded=True))
    assert judged.usable and judged.warm_start == "cold"
    assert judged.iterations < 2 * cold.iterations
    assert "another solve, by 'curvature', that is kept near the design" in judged.notes[0]


def test_less_may_be_left_with_more_effort(surfaces, coarse_net):
    energies = [energy(hybrid.solve(surfaces[1], effort=e, verdict=False)) for e in (0.5, 1.0)]
    assert energies[1] <= energies[0]
    with pytest.raises(OptionError, match="effort"):
        hybrid.solve(surfaces[1], effort=0)


def test_a_cold_solve_may_end_earlier(surfaces, optimum):
    whole = optimum(0, verdict=False)
    early = tno.optimize(surfaces[0], x0=Start(None, remaining=0.01), verdict=False)
    assert early.iterations < whole.iterations
    assert energy(early) <= 1.02 * energy(whole)
    one = tno.optimize(surfaces[0], x0=Start(None, remaining=0.9), verdict=False)
    assert (one.history[-1].name, one.history[-1].iteration) == ("normal", 1)


def test_no_net_is_asked_where_it_does_not_pay(surfaces, optimum, monkeypatch):
    monkeypatch.setattr(
        "gso.hybrid.solving.predictions", lambda designs, **_: [1 / 0 for _ in designs]
    )
    cold, result = optimum(0), hybrid.solve(surfaces[0], sparing=True)
    (item,) = hybrid.solve_many([surfaces[0]], sparing=True, workers=0)
    for found in (result, item.result):
        assert same(cold, found)
        assert (found.warm_start, found.notes, found.seconds["net"]) == ("cold", cold.notes, 0.0)
