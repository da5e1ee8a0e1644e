"""Conformal maps: angles, scales, no flips, on every kind of mesh."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Mesh
from tests.conftest import saddle, shuffled, sphere_cap
from tests.test_bend import MOTION, star, with_hole


def conformal(mesh, **more) -> gso.Result:
    return gso.tno.optimize(mesh, task="conformal", **more)


def test_a_plane_comes_back_congruent():
    flat = np.dstack([*np.mgrid[:9.0, :7.0], np.zeros((9, 7))])
    result = conformal(MOTION.apply(flat.reshape(-1, 3)).reshape(9, 7, 3) + 4.0)
    np.testing.assert_allclose(result.cell_scale, 1.0, atol=1e-9)
    for axis in (0, 1):
        steps = np.linalg.norm(np.diff(result.flat_grid, axis=axis), axis=-1)
        np.testing.assert_allclose(steps, 1.0, atol=1e-9)


def test_angles_are_kept_on_a_sphere_and_lengths_are_not():
    result = conformal(sphere_cap(25, radius=0.72))
    assert result.converged and result.usable
    assert result.metrics["angle_distortion_p99"] < 1e-4
    assert result.metrics["flipped_cells"] == 0
    assert result.metrics["scale_min"] < 0.95 < 1.05 < result.metrics["scale_max"]


def test_the_map_of_a_sphere_agrees_with_stereographic_projection_to_second_order():
    # Two conformal maps differ by one of the plane to itself: that has to be conformal.
    errors = []
    for n in (9, 17, 33):
        cap = sphere_cap(n, radius=0.72)
        result = conformal(cap, options="accurate")
        x, y, z = (result.design.vertices / 0.72).T
        stereographic = np.stack([x, y], axis=1) / (1.0 + z)[:, None]
        image = result.design.replaced(np.c_[result.flat, np.zeros(n * n)])
        errors.append(metrics.quasi_conformal(image, stereographic).mean() - 1.0)
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 1e-3
    assert (orders > 1.8).all()


def test_the_scale_of_a_sphere_says_its_curvature():
    # Liouville: Laplacian(log s) = K / s^2. So log s is K r^2 / 4 and a harmonic function
    # where s is nearly one.
    n, radius = 33, 4.0
    result = conformal(sphere_cap(n, radius=radius), options="accurate")
    centre = result.flat[result.design.faces].mean(axis=1)
    z = (centre - centre.mean(axis=0)) @ [1.0, 1j]
    basis = [np.abs(z) ** 2, np.ones(len(z))]
    basis += [part for k in (1, 2, 3, 4, 8) for part in ((z**k).real, (z**k).imag)]
    fitted = np.linalg.lstsq(np.stack(basis, axis=1), np.log(result.cell_scale), rcond=None)[0]
    assert 4.0 * fitted[0] == pytest.approx(1.0 / radius**2, rel=0.02)


def test_scales_are_lengths_of_flat_over_surface_in_the_users_order():
    mesh = shuffled(Mesh.from_grid(saddle(13)), seed=5)
    result = conformal(mesh)
    quads = result.flat[mesh.faces]
    space = mesh.vertices[mesh.faces]
    lengths = [np.linalg.norm(p[:, 0] - p[:, 2], axis=1) for p in (quads, space)]
    np.testing.assert_allclose(result.cell_scale, lengths[0] / lengths[1], rtol=1e-4)
    area = [float(np.linalg.norm(_cross(p), axis=1).sum()) for p in (quads, space)]
    assert area[0] == pytest.approx(area[1], rel=1e-2)


def _cross(quads: np.ndarray) -> np.ndarray:
    a, b = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    a, b = (np.pad(v, ((0, 0), (0, 3 - v.shape[1]))) for v in (a, b))
    return np.cross(a, b)


def test_copies_are_mapped_alike():
    mesh = Mesh.from_grid(saddle(11))
    one = conformal(mesh)
    moved = 30.0 * mesh.vertices @ MOTION.as_matrix().T + [9.0, 0.0, -50.0]
    other = conformal(shuffled(mesh.replaced(moved), seed=3))
    order = np.argsort(np.random.default_rng(3).permutation(len(moved)))
    lengths = [np.linalg.norm(f - f[0], axis=1) for f in (one.flat, other.flat[order])]
    np.testing.assert_allclose(30.0 * lengths[0], lengths[1], atol=30 * 1e-6)
    np.testing.assert_allclose(np.sort(one.cell_scale), np.sort(other.cell_scale), atol=1e-6)


@pytest.mark.parametrize("kind", ["valence 3", "valence 5", "hole", "triangles"])
def test_every_kind_of_mesh(kind):
    grid = Mesh.from_grid(saddle(17))
    mesh = {
        "valence 3": star(3),
        "valence 5": star(5),
        "hole": with_hole(),
        "triangles": Mesh(grid.vertices, grid.triangles),
    }[kind]
    result = conformal(mesh)
    assert result.cell_scale.shape == (len(mesh.faces),)
    assert result.metrics["flipped_cells"] == 0
    # Triangles cannot keep their angles exactly: there are too many of them.
    assert result.metrics["angle_distortion_mean"] < (3e-2 if kind == "triangles" else 2e-4)


def test_accurate_keeps_angles_better_and_fast_is_near():
    fast, balanced, accurate = (
        conformal(saddle(17), options=o).metrics["angle_distortion_p99"]
        for o in ("fast", "balanced", "accurate")
    )
    assert fast > 3 * balanced > 30 * accurate
    assert fast < 1e-3


def test_handles_place_the_image():
    places = [[0.0, 0.0], [0.0, 2.2]]
    result = conformal(saddle(13), constraints=[gso.Handle([0, 12], places)])
    np.testing.assert_allclose(result.flat[[0, 12]], places, atol=1e-9)
    assert result.metrics["flipped_cells"] == 0
    assert result.metrics["angle_distortion_mean"] < 1e-2


def test_closed_surfaces_are_refused():
    import trimesh

    with pytest.raises(gso.MeshError, match="closed"):
        conformal(trimesh.creation.icosphere(subdivisions=1))


@pytest.mark.parametrize("wrong", [{"w_scale": 0.0}, {"w_shear": -1.0}])
def test_wrong_options_are_named(wrong):
    with pytest.raises(gso.OptionError, match=next(iter(wrong))):
        gso.ConformalOptions(**wrong)


def test_results_survive_a_round_trip_and_are_drawn(tmp_path):
    result = conformal(saddle(9))
    result.save(tmp_path / "map.npz")
    again = gso.Result.load(tmp_path / "map.npz")
    np.testing.assert_array_equal(again.cell_scale, result.cell_scale)
    np.testing.assert_array_equal(again.flat, result.flat)
    pytest.importorskip("matplotlib")
    gso.plot.plot_result(again, tmp_path / "map.png")
