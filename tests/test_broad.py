"""The broad set: truths of its families, and that surfaces depend on their numbers only."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pytest

from gso import OptionError, dataset, metrics
from gso.dataset import Recipe, broad

U, V = np.meshgrid(np.linspace(-1, 1, 201), np.linspace(-1, 1, 201), indexing="ij")


def derivatives(points):
    """First and second derivatives at inner points, by central differences."""
    h = 2 / 200
    u, v = ((np.roll(points, -1, k) - np.roll(points, 1, k)) / (2 * h) for k in (0, 1))
    uu, vv = ((np.roll(points, -1, k) - 2 * points + np.roll(points, 1, k)) / h**2 for k in (0, 1))
    uv = (np.roll(u, -1, 1) - np.roll(u, 1, 1)) / (2 * h)
    return [d[3:-3, 3:-3] for d in (u, v, uu, uv, vv)]


def curvatures(points):
    """Mean and Gaussian curvature at inner points."""
    u, v, uu, uv, vv = derivatives(points)
    e, f, g = ((a * b).sum(-1) for a, b in ((u, u), (u, v), (v, v)))
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    ll, mm, nn = ((x * normal).sum(-1) for x in (uu, uv, vv))
    area = e * g - f * f
    return (e * nn - 2 * f * mm + g * ll) / (2 * area), (ll * nn - mm * mm) / area


def drawn(name, seed):
    return broad.FAMILIES[name].draw(np.random.default_rng(seed))(U, V)


@pytest.mark.parametrize("seed", range(5))
def test_minimal_surfaces_have_no_mean_curvature(seed):
    mean, gauss = curvatures(drawn("minimal", seed))
    flat = np.sqrt(np.abs(gauss))
    assert np.median(np.abs(mean)) < 1e-3 * np.median(flat)


@pytest.mark.parametrize("seed", range(5))
def test_unduloids_have_one_mean_curvature(seed):
    mean, _ = curvatures(drawn("constant_mean_curvature", seed))
    np.testing.assert_allclose(np.abs(mean), 0.5, atol=2e-3)


@pytest.mark.parametrize("seed", range(5))
def test_surfaces_of_translation_have_no_twist(seed):
    *_, uv, _ = derivatives(drawn("translational", seed))
    assert np.abs(uv).max() < 1e-9


@pytest.mark.parametrize("seed", range(5))
def test_surfaces_of_revolution_have_circles(seed):
    points = drawn("rotational", seed)
    radius = np.hypot(points[..., 0], points[..., 1])
    assert np.ptp(radius, axis=1).max() < 1e-12 and np.ptp(points[..., 2], axis=1).max() < 1e-12


def test_sheets_without_a_dent_are_developable():
    bent = 0
    for seed in range(12):
        mean, gauss = curvatures(drawn("sheet", seed))
        bent += np.abs(gauss).mean() < 1e-3 * (mean**2).mean()
    assert 3 <= bent <= 9  # about half of them have none


@pytest.mark.parametrize("seed", range(5))
def test_free_vertices_of_grid_shells_are_in_equilibrium(seed):
    # Inside, the force densities along rows and columns are two constants: the horizontal
    # coordinates satisfy a Laplace equation with them, whatever they are.
    surface = broad.FAMILIES["grid_shell"].draw(np.random.default_rng(seed))
    t = np.linspace(-1, 1, 33)
    points = surface(*np.meshgrid(t, t, indexing="ij"))
    inner = points[1:-1, 1:-1]
    along = points[2:, 1:-1] - 2 * inner + points[:-2, 1:-1]
    across = points[1:-1, 2:] - 2 * inner + points[1:-1, :-2]
    # One ratio fits both horizontal coordinates of all vertices; the vertical ones get the load.
    a, b = along[..., :2].ravel(), across[..., :2].ravel()
    ratio = -(a @ b) / (b @ b) if b @ b > 1e-20 else 0.0
    assert np.abs(a + ratio * b).max() < 1e-8


@pytest.mark.parametrize("split", broad.SPLITS)
def test_surfaces_are_sound_and_depend_on_their_number_only(split):
    for number in range(8):
        grid = broad.draw(split, number, seed=3, size=32)
        assert grid.shape == (32, 32, 3) and np.isfinite(grid).all()
        assert np.linalg.norm(grid, axis=-1).max() == pytest.approx(1.0)
        np.testing.assert_array_equal(grid, broad.draw(split, number, seed=3, size=32))
    together = dataset.draw_broad(split, 3, seed=3, size=32)
    np.testing.assert_array_equal(together[2], broad.draw(split, 2, seed=3, size=32).astype("f4"))
    assert np.abs(broad.draw(split, 2, seed=4, size=32) - together[2]).max() > 1e-3


def test_another_size_is_the_same_surface():
    for number in range(6):
        fine, coarse = (broad.draw("train", number, seed=8, size=n) for n in (65, 33))
        if metrics.loss_gc(fine) < 1.0:  # neither noise nor rough terrain
            assert np.abs(fine[::2, ::2] - coarse).max() < 0.05


def test_grids_are_of_all_kinds():
    grids = [broad.draw("train", number, seed=0) for number in range(60)]
    long = [
        np.divide(
            *sorted(np.linalg.norm(np.diff(g, axis=k), axis=-1).sum(axis=k).mean() for k in (0, 1))
        )
        for g in grids
    ]
    assert min(long) < 0.35 and max(long) > 0.9
    curved = np.array([metrics.loss_gc(g, scale=1.0) for g in grids])
    assert np.quantile(curved, 0.1) < 0.05 and 0.8 < np.quantile(curved, 0.95) <= 10.0


def test_families_of_validation_and_test_are_not_trained_on():
    names = [broad.families(split) for split in broad.SPLITS]
    assert sorted(chain(*names)) == sorted(broad.FAMILIES) and all(names)


def test_a_set_is_built(tmp_path):
    recipe = Recipe(n=20, size=16, labels=("developable",), surfaces="broad", seed=2)
    data = dataset.build(tmp_path, recipe, workers=0)
    assert {name: len(split) for name, split in data.items()} == recipe.splits
    assert set(recipe.splits) == set(broad.SPLITS)
    assert data["test"]["family"][:].astype(str).tolist() == broad.families("test")
    np.testing.assert_array_equal(
        data["train"]["surface"][5], broad.draw("train", 5, seed=2, size=16)
    )
    before, after = (data["train"][name][:] for name in ("surface", "developable"))
    gone = [metrics.K_A_r_worst(a, b) for a, b in zip(before, after, strict=True)]
    assert np.median(gone) > 0.5


def test_the_published_sets_are_as_before():
    assert "surfaces" not in Recipe().as_dict()
    assert Recipe(surfaces="broad").as_dict()["surfaces"] == "broad"


def test_wrong_recipes_are_named():
    with pytest.raises(OptionError, match="surfaces is 'wide'"):
        Recipe(surfaces="wide")
    with pytest.raises(OptionError, match="not stratified"):
        Recipe(surfaces="broad", strata="features")
