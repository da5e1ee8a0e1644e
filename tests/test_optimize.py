"""Results, batches, the denoise task through the front door."""

from __future__ import annotations

import os

import numpy as np
import pytest

import gso
from gso.mesh import Mesh
from tests.conftest import saddle, sphere_cap


def test_results_survive_a_round_trip(tmp_path):
    result = gso.tno.optimize(saddle(12))
    result.save(tmp_path / "r.npz")
    again = gso.Result.load(tmp_path / "r.npz")
    np.testing.assert_array_equal(again.mesh.vertices, result.mesh.vertices)
    np.testing.assert_array_equal(again.design.vertices, result.design.vertices)
    assert again.metrics == pytest.approx(result.metrics)
    assert again.energy == pytest.approx(result.energy)
    assert (again.status, again.backend, again.history) == (
        result.status,
        result.backend,
        result.history,
    )


def test_damaged_results_are_refused_by_name(tmp_path):
    path = tmp_path / "r.npz"
    gso.tno.optimize(saddle(6)).save(path)
    data = path.read_bytes()
    for broken in (data[: len(data) // 2], b"", b"PK\x03\x04garbage"):
        path.write_bytes(broken)
        with pytest.raises(gso.MeshError, match=r"r\.npz"):
            gso.Result.load(path)
    np.savez(path, vertices=np.zeros((3, 3)))
    with pytest.raises(gso.MeshError, match="no result"):
        gso.Result.load(path)


def test_results_write_meshes_and_those_with_one_patterns(tmp_path):
    result = gso.tno.optimize(saddle(8))
    result.save(tmp_path / "out.obj")
    np.testing.assert_array_equal(gso.load(tmp_path / "out.obj").vertices, result.mesh.vertices)
    result.save(tmp_path / "out.svg")  # its flat pattern
    smooth = gso.tno.optimize(saddle(8), task="denoise")
    with pytest.raises(gso.MeshError, match="no flat pattern"):
        smooth.save(tmp_path / "none.svg")


def test_seconds_and_backend_are_reported():
    result = gso.tno.optimize(saddle(12))
    assert result.seconds["total"] >= result.seconds["factor"] > 0
    names = ("setup", "evaluate", "factor", "search", "pattern", "verdict")
    assert min(result.seconds[k] for k in names) > 0
    assert sum(result.seconds[k] for k in names) <= result.seconds["total"]
    assert result.backend in gso.linalg.backends()
    assert result.history[0].iteration == 0


def test_batches_stream_results_and_survive_failures():
    bad = saddle(6).copy()
    bad[2, 2] = np.nan
    done = {i.index: i for i in gso.tno.optimize_many([saddle(8), bad, saddle(9)], workers=2)}
    assert sorted(done) == [0, 1, 2]
    assert done[0].ok and done[2].ok and not done[1].ok
    assert "(2, 2)" in done[1].error
    alone = gso.tno.optimize(saddle(8))
    np.testing.assert_allclose(done[0].result.grid, alone.grid, atol=1e-10)
    assert done[0].result.metrics["loss_gc"] > 0


class Deadly:
    """Kills the process that looks at it."""

    @property
    def __array__(self):
        os._exit(1)


def test_a_batch_outlives_its_workers():
    meshes = [saddle(5), Deadly(), *[saddle(5)] * 6]
    done = {i.index: i for i in gso.tno.optimize_many(meshes, workers=2, task="denoise")}
    assert sorted(done) == list(range(8))
    assert [k for k, item in done.items() if not item.ok] == [1]
    assert "died" in done[1].error


def test_strips_of_quads_are_meshes_like_any_other():
    strip = Mesh(saddle(9, 3)[:, :2].reshape(-1, 3), gso.mesh.topology.grid_faces(9, 2))
    assert np.isfinite(gso.tno.optimize(strip, task="flatten").flat).all()
    assert np.isfinite(gso.tno.optimize(strip, task="denoise").mesh.vertices).all()
    with pytest.raises(gso.MeshError, match="interior"):
        gso.tno.optimize(strip)


def test_batches_read_their_input_as_they_go():
    taken = []

    def endless():
        k = 0
        while True:
            taken.append(k)
            yield saddle(4)
            k += 1

    batch = gso.tno.optimize_many(endless(), workers=0, task="denoise")
    next(batch), next(batch)
    batch.close()
    assert taken == [0, 1]


@pytest.mark.parametrize("formulation", ["smooth", "crease"])
def test_denoise_turns_normals_back(formulation):
    clean = sphere_cap(30, radius=1.0)
    noisy = clean + 0.004 * np.random.default_rng(0).standard_normal(clean.shape)
    result = gso.tno.optimize(noisy, task="denoise", formulation=formulation)
    before = gso.metrics.normal_angle(clean, noisy)
    assert gso.metrics.normal_angle(clean, result.grid) < 0.3 * before
    assert result.details["sigma"] == pytest.approx(0.004, rel=0.2)


def test_denoise_of_meshes_and_refusals():
    clean = Mesh.from_grid(sphere_cap(20, radius=1.0))
    triangles = Mesh(clean.vertices, clean.triangles)
    rng = np.random.default_rng(1)
    noisy = triangles.replaced(clean.vertices + 0.004 * rng.standard_normal((400, 3)))
    result = gso.tno.optimize(noisy, task="denoise")
    assert gso.metrics.normal_angle(triangles, result.mesh) < 0.4 * gso.metrics.normal_angle(
        triangles, noisy
    )


def test_a_start_takes_the_place_of_the_smoothed_surface():
    given = sphere_cap(20)
    start = given + np.array([0.0, 0.0, 0.01])
    result = gso.tno.optimize(given, task="denoise", x0=start)
    assert np.allclose(result.grid, start) and result.warm_start == "x0" and result.converged
    held = gso.tno.optimize(given, task="denoise", x0=start, constraints=[gso.Fixed([0])])
    assert np.allclose(held.grid[0, 0], given[0, 0], atol=1e-6)
    assert np.allclose(held.grid[10, 10], start[10, 10], atol=1e-3)


def test_denoise_weight_can_be_given_back():
    noisy = sphere_cap(20) + 0.003 * np.random.default_rng(2).standard_normal((20, 20, 3))
    result = gso.tno.optimize(noisy, task="denoise", options=gso.DenoiseOptions(order=3))
    weight = result.details["weight"]
    rough, smooth = (
        gso.tno.optimize(noisy, task="denoise", options=gso.DenoiseOptions(order=3, weight=w))
        for w in (0.01 * weight, 100 * weight)
    )
    assert smooth.metrics["roughness_ratio"] < rough.metrics["roughness_ratio"]


@pytest.mark.parametrize("task", ["developable", "bend"])
def test_a_start_without_area_is_refused(task):
    points = saddle(7)
    line = np.linspace(0.0, 1.0, points[..., 0].size)[:, None] * np.ones(3)
    with pytest.raises(gso.MeshError, match="x0 has no area"):
        gso.tno.optimize(points, task=task, x0=line)
