"""Geometric definitions against analytic truths."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gso import geometry as g
from gso import metrics
from gso.dataset import BezierSurface, generate
from gso.mesh import Mesh
from tests.conftest import cylinder, saddle, sphere_cap

torch = pytest.importorskip("torch")


def test_angle_of_known_vectors_in_every_number_kind():
    a, b = (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)
    assert g.angle(a, b) == pytest.approx(math.pi / 4)
    ta, tb = (tuple(torch.tensor(x, dtype=torch.float64) for x in v) for v in (a, b))
    assert float(g.angle(ta, tb)) == pytest.approx(math.pi / 4)


def test_angles_near_zero_and_pi_keep_their_digits():
    for angle in (1e-9, math.pi - 1e-9):
        a, b = (1.0, 0.0, 0.0), (math.cos(angle), math.sin(angle), 0.0)
        assert g.angle(a, b) == pytest.approx(angle, rel=1e-7)


def test_curvature_of_a_sphere_converges_to_a_third_of_one_over_radius_squared():
    errors = []
    for n in (17, 33, 65):
        k = metrics.curvature_grid(sphere_cap(n, radius=2.0))
        errors.append(np.abs(3.0 * k - 0.25).max())
    assert errors[2] < 2e-3
    assert errors[2] < errors[1] < errors[0]


def test_curvature_of_planes_and_cylinders_vanishes():
    assert np.abs(metrics.curvature_grid(saddle(9, strength=0.0))).max() < 1e-12
    assert np.abs(metrics.curvature_grid(cylinder(33, turn=0.0))).max() < 1e-11
    assert np.abs(metrics.curvature_grid(cylinder(65, turn=0.4))).max() < 1e-4


def test_curvature_by_stars_equals_curvature_by_slices():
    mesh = Mesh.from_grid(saddle(9, 7))
    by_star = metrics.curvature(mesh)[mesh.grid_index][1:-1, 1:-1]
    np.testing.assert_allclose(by_star, metrics.curvature_grid(mesh.grid), rtol=1e-12)


def test_degenerate_stars_have_finite_curvature_and_gradient():
    single = torch.zeros(4, 3, requires_grad=True)
    g.star_area(tuple(single[0]), [tuple(p) for p in single[1:]]).backward()
    assert torch.isfinite(single.grad).all()


def test_singular_values_are_those_of_the_map():
    rng = np.random.default_rng(0)
    for _ in range(20):
        p, q, r = rng.standard_normal((3, 3))
        flat = rng.standard_normal((3, 2))
        rest = g.rest_frame(tuple(p), tuple(q), tuple(r))
        m = np.array([[rest[0], rest[1]], [0.0, rest[2]]])
        f = np.stack([flat[1] - flat[0], flat[2] - flat[0]], axis=1) @ m
        s1, s2 = g.singular_values(*map(tuple, flat), rest)
        expected = np.linalg.svd(f)[1]
        assert (s1, abs(s2)) == pytest.approx(tuple(expected))
        assert np.sign(s2) == np.sign(np.linalg.det(f))
        turn, c, d = g.turn_and_shear(*map(tuple, flat), rest)
        big = g.norm(turn) - 1.0
        assert 2 * (big**2 + c**2 + d**2) == pytest.approx((s1 - 1) ** 2 + (s2 - 1) ** 2)


def test_isometric_cells_have_no_defect():
    cell = [(0.0, 0.0), (1.0, 0.1), (1.2, 1.3), (0.1, 0.9)]
    turned = [(-y, x) for x, y in cell]
    a, b = g.diagonals(*cell)
    a2, b2 = g.diagonals(*turned)
    assert g.isometry_defect(a, b, a2, b2) == pytest.approx((0.0, 0.0, 0.0))


def test_bezier_surfaces_are_the_same_at_every_resolution():
    surface = generate(1, seed=4)[0]
    coarse, fine = surface.sample(33), surface.sample(65)
    # Both are normalised by their own samples, so shapes agree up to that.
    assert np.abs(coarse - fine[::2, ::2]).max() < 0.05
    again = generate(1, seed=4)[0].sample(33)
    np.testing.assert_array_equal(coarse, again)
    assert np.linalg.norm(coarse, axis=-1).max() == pytest.approx(1.0)


def test_bezier_patch_passes_through_its_corners_and_is_exact_for_lines():
    net = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0), [1.0], indexing="ij"), -1)[:, :, 0]
    patch = BezierSurface(net, np.array([[0.0, 1.0], [0.0, 1.0]])).sample(5, 4)
    assert patch.shape == (5, 4, 3)
    steps = np.diff(patch, axis=0)
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0, 0], steps.shape), atol=1e-12)


def test_recipe_gives_the_published_mean_curvature():
    surfaces = generate(150, seed=1)
    mean = np.mean([metrics.loss_gc(s.sample()) for s in surfaces])
    assert mean == pytest.approx(0.31, abs=0.05)
