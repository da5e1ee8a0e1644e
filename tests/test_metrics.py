"""Metrics against published numbers and analytic truths."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gso import MeshError, metrics
from gso.mesh import Mesh, topology
from tests.conftest import saddle, shuffled, sphere_cap

BENCH = Path(__file__).resolve().parent.parent / "bench" / "data" / "bench24.npz"


@pytest.fixture(scope="module")
def bench():
    data = np.load(BENCH)
    return data["surfaces"].astype(float), data["unit_noise"].astype(float)


def test_reference_surfaces_have_their_known_mean_curvature(bench):
    assert np.mean([metrics.loss_gc(s) for s in bench[0]]) == pytest.approx(0.306, abs=5e-4)


def test_noise_turns_normals_as_published(bench):
    for sigma, published in ((0.001, 4.02), (0.005, 21.36), (0.010, 44.64), (0.015, 61.59)):
        angles = [metrics.normal_angle(s, s + sigma * n) for s, n in zip(*bench, strict=True)]
        assert np.mean(angles) == pytest.approx(published, rel=0.12)


def test_values_do_not_depend_on_unit_place_or_numbering():
    grid = saddle(9, 8)
    turn = Rotation.from_rotvec([0.3, 1.0, -0.2]).as_matrix()
    moved = 1000.0 * grid @ turn.T + 3e4
    other = saddle(9, 8, strength=0.2)
    moved_other = 1000.0 * other @ turn.T + 3e4
    flat = grid[..., :2]
    for value, again in (
        (metrics.loss_gc(grid), metrics.loss_gc(moved)),
        (metrics.fairness(grid), metrics.fairness(moved)),
        (metrics.K_A_r(grid, other), metrics.K_A_r(moved, moved_other)),
        # The bounding box turns with the axes, so d_H is compared unturned.
        (metrics.d_H(grid, other), metrics.d_H(1000.0 * grid + 3e4, 1000.0 * other + 3e4)),
        (metrics.normal_angle(grid, other), metrics.normal_angle(moved, moved_other)),
        (metrics.loss_iso_cell(grid, flat), metrics.loss_iso_cell(moved, 1000.0 * flat)),
        (metrics.edge_length_error(grid, flat), metrics.edge_length_error(moved, 1000.0 * flat)),
    ):
        assert again == pytest.approx(value, rel=1e-7)
    mesh = Mesh.from_grid(grid)
    mixed = shuffled(mesh)
    assert metrics.loss_gc(mixed) == pytest.approx(metrics.loss_gc(grid), rel=1e-10)
    assert metrics.fairness(mixed) == pytest.approx(metrics.fairness(grid), rel=1e-10)


def test_features_split_the_curvature_by_sign():
    k_p, k_n, k_a = metrics.curvature_features(saddle(12))
    assert k_a == pytest.approx(k_p - k_n)
    assert metrics.curvature_features(sphere_cap())[1] > -1e-12


def test_distances_between_parallel_planes():
    lower = saddle(9, strength=0.0)
    upper = lower + np.array([0.3, 0.0, 0.1])
    distance = metrics.surface_distance(lower, upper)
    # The part that sticks out is farther than the gap.
    assert distance.there_max == pytest.approx(np.hypot(0.3, 0.1))
    assert min(metrics.point_to_surface(upper.reshape(-1, 3), Mesh.from_grid(lower))) == (
        pytest.approx(0.1)
    )
    # Vertex-to-vertex distance counts the slide along the surface too.
    assert metrics.d_H(lower, lower + np.array([0.05, 0.0, 0.0])) > 0
    assert metrics.surface_distance(lower, lower[1:-1, 1:-1]).there_max == pytest.approx(0.0)


@pytest.mark.parametrize("kind", ["grid", "shuffled", "other faces"])
@pytest.mark.parametrize("slide", [0.0, 0.02, 0.3])
def test_the_largest_distance_is_that_of_all_vertices(kind, slide):
    rng = np.random.default_rng(3)
    for k in range(6):
        before = saddle(31, 24, strength=0.2 * k)
        shift = rng.normal(size=3) * slide
        waves = np.cos(before[..., :2] @ rng.normal(size=(2, 3)) * 4)
        after = before + shift + 0.05 * waves + 1e-3 * k * rng.normal(size=before.shape)
        a, b = Mesh.from_grid(before), Mesh.from_grid(after)
        if kind == "shuffled":
            a, b = shuffled(a, k), shuffled(b, k)
        elif kind == "other faces":
            b = Mesh(b.vertices, b.triangles)
        far = metrics.surface_distance(a, b)
        found = metrics.largest_distance(a, b)
        assert found == pytest.approx(max(far.there_max, far.back_max), rel=1e-12)
    assert metrics.largest_distance(a, a) == 0.0


def test_strain_and_edges_of_a_uniform_stretch():
    plane = saddle(6, strength=0.0)
    flat = plane[..., :2] * [1.1, 0.95]
    strains = metrics.principal_strains(plane, flat)
    np.testing.assert_allclose(strains.values, 0.1, atol=1e-12)
    assert metrics.edge_length_error(plane, flat) == pytest.approx(0.075)
    assert metrics.loss_iso_cell(plane, plane[..., :2]) == pytest.approx(0.0, abs=1e-14)


def test_flips_are_counted_per_cell():
    flat = saddle(5, strength=0.0)[..., :2].copy()
    assert metrics.flipped_cells(flat) == 0
    assert metrics.flipped_cells(flat[::-1]) == 16
    flat[2, 2] += 1.2
    assert 1 <= metrics.flipped_cells(flat) <= 4
    faces = topology.grid_faces(5, 5)
    assert metrics.flipped_cells(flat.reshape(-1, 2), faces) >= 1
    assert metrics.flipped_cells(flat.reshape(-1, 2)[:, ::-1], faces) >= 12
    with pytest.raises(MeshError, match="faces"):
        metrics.flipped_cells(flat.reshape(-1, 2))


def test_fairness_of_a_parabola_is_its_second_difference():
    u = np.linspace(0, 1, 6)
    x, y = np.meshgrid(u, u, indexing="ij")
    surface = np.stack([x, y, x**2], axis=-1)
    h = u[1]
    assert metrics.fairness(surface, scale=1.0) == pytest.approx(4 * 6 * (2 * h * h) ** 2)


def test_every_metric_of_a_result_is_explained():
    from gso.tasks import get, names

    for name in names():
        source = inspect.getsource(get(name).metrics)
        keys = [k for k in metrics.INFO if f'"{k}"' in source]
        assert keys, name
        assert set(re.findall(r'^\s+"(\w+)":', source, re.M)) <= set(metrics.INFO)


def test_wrong_input_is_named():
    with pytest.raises(MeshError, match="grid array"):
        metrics.loss_gc(np.zeros((4, 3)))
    grid = np.dstack([*np.mgrid[:4.0, :5.0], np.zeros((4, 5))])
    for measure in (metrics.isometry_energy, metrics.stretches, metrics.principal_strains):
        with pytest.raises(MeshError, match="12 vertices and the surface 20"):
            measure(grid, grid[:, :3, :2])


@pytest.mark.parametrize("unit", [2.0**-290, 2.0**290])
def test_strains_do_not_depend_on_the_unit(unit):
    grid = Mesh.from_grid(saddle(5))
    flat = grid.vertices[:, :2] * [1.1, 0.9]
    scaled = grid.replaced(unit * grid.vertices)
    for measure in (metrics.corner_strains, metrics.stretches, metrics.area_error):
        assert np.array_equal(measure(scaled, unit * flat), measure(grid, flat))


@pytest.mark.parametrize("seed", range(6))
def test_the_largest_distance_is_that_of_a_dense_sample(seed):
    rng = np.random.default_rng(seed)
    surfaces = []
    for count, rough in ((rng.integers(4, 9), 0.3), (rng.integers(5, 14), 0.1)):
        plane = np.stack(np.mgrid[-1 : 1 : count * 1j, -1 : 1 : count * 1j], axis=-1)
        inner = plane[1:-1, 1:-1]
        inner += rng.uniform(-0.3, 0.3, inner.shape) / count
        height = rough * rng.normal(size=plane.shape[:2]) + 0.2 * plane[..., 0] ** 2
        surfaces.append(Mesh.from_grid(np.dstack([plane, height])))
    one, two = surfaces
    found = metrics.farthest(one, two)
    corner = one.vertices[one.triangles]
    share = rng.dirichlet(np.ones(3), (len(corner), 4000))
    # Edges and corners, too, where distances often are largest.
    share[:, ::4, 0] = 0.0
    share /= share.sum(axis=2, keepdims=True)
    points = np.einsum("tsk,tkd->tsd", share, corner).reshape(-1, 3)
    sampled = metrics.point_to_surface(np.r_[points, one.vertices], two).max()
    assert sampled * (1 - 1e-9) <= found * (1 + 1e-3) + 1e-5
    assert found <= 1.03 * sampled
