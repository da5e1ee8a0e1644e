"""Strips of planar quads: their first rulings, their planarity, and their solve."""

from __future__ import annotations

import numpy as np
import pytest

from gso import parametrization
from gso.mesh import Mesh
from gso.ruled import fit, strip
from gso.ruled.chords import chords, prices, resampled, sequence
from gso.ruled.domain import Domain
from tests.conftest import cylinder, saddle, shuffled


def domain(points) -> Domain:
    mesh = points if isinstance(points, Mesh) else Mesh.from_grid(points)
    mesh = mesh.replaced(mesh.vertices / mesh.diagonal)
    return Domain(mesh, parametrization.begin(mesh).flat)


def bent_strip(count=9):
    """A strip that is not planar, with rulings of a helicoid."""
    u = np.linspace(0.0, 1.0, count)
    way = np.stack([np.cos(0.5 * u), np.sin(0.5 * u), 0.2 * u], axis=1)
    first = np.stack([0 * u, 0.3 * u, u], axis=1)
    return np.stack([first, first + way], axis=1)


def test_design_continues_beyond_its_outline():
    there = domain(np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))]))
    corner = there.flat[there.outline].min(axis=0) - 0.5 * there.margin
    inside = there.flat.mean(axis=0)
    a, b = there.points(np.array([corner, inside]))
    assert np.linalg.norm(a - b) == pytest.approx(np.linalg.norm(corner - inside), rel=1e-6)
    assert a[2] == pytest.approx(0.0, abs=1e-12)


def test_extrapolation_is_exact_for_parabolas():
    u, v = np.meshgrid(np.linspace(-1, 1, 65), np.linspace(-1, 1, 65), indexing="ij")
    mesh = Mesh.from_grid(np.stack([u, v, 0.3 * u * u], axis=-1))
    there = Domain(mesh, mesh.vertices[:, :2].copy())
    x = 1.0 + 0.8 * there.margin
    (found,) = there.points(np.array([[x, 0.0]]))
    np.testing.assert_allclose(found, [x, 0.0, 0.3 * x * x], atol=2e-4)


def test_cheapest_chords_of_a_cylinder_are_its_rulings():
    there = domain(cylinder(33, turn=0.4))
    outline, _ = resampled(there.flat[there.outline], 96)
    first, second = sequence(outline, prices(there, outline))
    assert (np.diff(first) >= 0).all()
    assert (np.diff(second) <= 0).all()
    assert (second - first)[[0, -1]].tolist() == [95, 1]
    way = outline[second % 96] - outline[first % 96]
    size = np.linalg.norm(way, axis=1)
    long = size > 0.5 * size.max()
    way = way[long] / size[long, None]
    middle = np.linalg.svd(way)[2][0]
    assert np.degrees(np.arccos(np.clip(np.abs(way @ middle), 0, 1))).max() < 6.0


def test_chords_do_not_depend_on_numbering():
    mesh = Mesh.from_grid(cylinder(17))
    mixed = shuffled(mesh)
    lengths = [
        np.sort(np.linalg.norm(np.subtract(*chords(domain(m), 17)), axis=1)) for m in (mesh, mixed)
    ]
    np.testing.assert_allclose(lengths[1], lengths[0], atol=0.05)


def test_jacobian_of_planarity_is_that_of_differences():
    ends = strip.planarised(bent_strip())
    value, slope = strip.planarity(ends)
    np.testing.assert_allclose(value, 0.0, atol=1e-14)
    numeric = np.empty(slope.shape)
    for k in range(ends.size):
        step = np.zeros(ends.size)
        step[k] = 1e-6
        two, one = (strip.planarity(ends + f * step.reshape(ends.shape))[0] for f in (1, -1))
        numeric[:, k] = (two - one) / 2e-6
    np.testing.assert_allclose(slope.toarray(), numeric, atol=1e-6)


def test_planar_strips_are_left_alone_and_others_become_planar():
    ends = bent_strip()
    assert np.abs(strip.planarity(ends)[0]).max() > 1e-4
    planar = strip.planarised(ends)
    corners = np.concatenate(strip.corners(planar, np.arange(8)), axis=1).reshape(8, 4, 3)
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    np.testing.assert_allclose(volume, 0.0, atol=1e-14)
    np.testing.assert_array_equal(strip.planarised(planar), planar)


def test_nearest_places_are_the_feet():
    ends = strip.planarised(bent_strip())
    rng = np.random.default_rng(0)
    quad, s, t = rng.integers(0, 8, 50), *rng.uniform(0.05, 0.95, (2, 50))
    x, along, across = strip.surface(ends, strip.Places(quad, s, t))
    normal = np.cross(along, across)
    points = x + 1e-3 * normal / np.linalg.norm(normal, axis=1, keepdims=True)
    at, border = strip.nearest(ends, points)
    assert not border.any()
    np.testing.assert_allclose(strip.surface(ends, at)[0], x, atol=1e-6)


@pytest.mark.parametrize(("kind", "most"), [("cylinder", 0.003), ("saddle", 0.08)])
def test_strips_are_planar_without_crossings_and_close(kind, most):
    there = domain(cylinder(33) if kind == "cylinder" else saddle(33, strength=0.25))
    ends, energy = fit.solve(there, 33)
    assert np.abs(strip.planarity(ends)[0]).max() < 1e-14
    assert (strip.gaps(ends, energy.up)[0] > 0).all()
    far = strip.nearest_distances(ends, there.mesh.vertices)
    assert far.mean() < 0.25 * most
    assert far.max() < most


def test_jacobian_of_the_energy_is_that_of_differences():
    there = domain(saddle(17, strength=0.25))
    first, second = chords(there, 9)
    energy = fit.Energy(there, first, second, np.arange(289))
    ends = strip.planarised(energy.start)
    rng = np.random.default_rng(0)
    step = 1e-7 * rng.standard_normal(ends.shape)
    (here, slope), *_ = energy._distance(ends)
    (there_, _), *_ = energy._distance(ends + step)
    # Feet at the edge of two quads may change the quad.
    error = np.abs(there_ - here - slope @ step.ravel())
    assert np.quantile(error, 0.9) < 1e-3 * np.abs(slope @ step.ravel()).max()
    for parts in (energy._second(ends, 1e-4), energy._outline(ends, 1e-2)):
        value, slope = parts
        assert value.shape == (slope.shape[0],)
