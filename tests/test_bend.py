"""Bending by handles: lengths are kept, nothing else moves, every kind of mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gso
from gso.mesh import Mesh
from tests.conftest import saddle, shuffled

MOTION = Rotation.from_rotvec([0.4, -1.1, 0.7])


def sheet(n: int = 21) -> np.ndarray:
    """A flat square, (n, n, 3)."""
    u = np.linspace(-1.0, 1.0, n)
    return np.stack([*np.meshgrid(u, u, indexing="ij"), np.zeros((n, n))], axis=-1)


def rolled(n: int, angle: float) -> np.ndarray:
    """The sheet bent to a cylinder without stretch of its strips, (n, n, 3)."""
    step = 2.0 / (n - 1)
    turn = (np.arange(n - 1) + 0.5) * angle / (n - 1)
    x, z = (np.r_[0.0, np.cumsum(step * f(turn))] for f in (np.cos, np.sin))
    out = sheet(n)
    out[..., 0], out[..., 2] = x[:, None], z[:, None]
    return out


def ends(n: int, rows: int = 2) -> np.ndarray:
    ids = np.arange(n * n).reshape(n, n)
    return np.r_[ids[:rows].ravel(), ids[-rows:].ravel()]


def star(arms: int, n: int = 6) -> Mesh:
    """A disk of quads round a vertex of valence `arms`, slightly curved."""
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    points, faces = [], []
    for k in range(arms):
        a, b = (np.exp(2j * np.pi * (k + s) / arms) for s in (0, 1))
        faces.append(gso.mesh.topology.grid_faces(n, n) + k * n * n)
        points.append((u * a + v * b).ravel())
    z = np.concatenate(points)
    _, first, new = np.unique(z.round(9), return_index=True, return_inverse=True)
    z = z[first]
    table = new[np.concatenate(faces)]
    return Mesh(np.stack([z.real, z.imag, 0.15 * z.real**2], axis=1), table)


def with_hole(n: int = 13) -> Mesh:
    grid = Mesh.from_grid(saddle(n, strength=0.2))
    middle = grid.vertices[grid.faces].mean(axis=1)
    faces = grid.faces[np.abs(middle[:, :2]).max(axis=1) > 0.35]
    used, new = np.unique(faces, return_inverse=True)
    return Mesh(grid.vertices[used], new.reshape(faces.shape))


@pytest.mark.parametrize("angle", [0.5 * np.pi, np.pi, 1.6 * np.pi])
def test_a_sheet_rolls_up_to_a_cylinder(angle):
    n = 21
    wanted = rolled(n, angle).reshape(-1, 3)
    ids = ends(n)
    result = gso.tno.optimize(sheet(n), task="bend", constraints=gso.Handle(ids, wanted[ids]))
    assert result.converged and result.usable
    np.testing.assert_allclose(result.mesh.vertices[ids], wanted[ids], atol=1e-15)
    assert np.abs(result.mesh.vertices - wanted).max() < 1e-4
    assert result.metrics["edge_length_error"] < 3e-5
    assert result.metrics["strain_max"] < 3e-4
    assert result.metrics["loss_gc"] < 1e-2


def test_less_resistance_to_bending_leaves_less_strain():
    n = 17
    ids, wanted = ends(n), rolled(n, 2.0).reshape(-1, 3)
    handle = gso.Handle(ids, wanted[ids])
    strains = [
        gso.tno.optimize(sheet(n), task="bend", options=o, constraints=[handle]).metrics
        for o in ("fast", "balanced", "accurate")
    ]
    fast, balanced, accurate = (s["loss_iso_cell"] for s in strains)
    assert fast > 5 * balanced > 25 * accurate


def test_a_rigid_motion_of_the_handles_moves_all():
    mesh = saddle(13)
    target = MOTION.apply(mesh.reshape(-1, 3)) + np.array([5.0, 0.0, -3.0])
    ids = ends(13)
    result = gso.tno.optimize(mesh, task="bend", constraints=[gso.Handle(ids, target[ids])])
    np.testing.assert_allclose(result.mesh.vertices, target, atol=1e-8)


@pytest.mark.parametrize("ids", [[7], [0, 12], [0, 6, 12]])
def test_few_handles_leave_the_shape(ids):
    mesh = Mesh.from_grid(saddle(13))
    target = MOTION.apply(mesh.vertices[ids]) + 1.0
    result = gso.tno.optimize(mesh, task="bend", constraints=[gso.Handle(ids, target)])
    np.testing.assert_allclose(result.mesh.vertices[ids], target, atol=1e-12)
    a, b = mesh.edges.T
    lengths = [np.linalg.norm(p[a] - p[b], axis=1) for p in (mesh.vertices, result.mesh.vertices)]
    np.testing.assert_allclose(*lengths, atol=1e-8)


def test_nothing_to_do_is_nothing_done():
    result = gso.tno.optimize(saddle(9), task="bend")
    assert result.status is gso.Status.ALREADY_GOOD
    np.testing.assert_array_equal(result.grid, saddle(9))
    held = gso.tno.optimize(saddle(9), task="bend", constraints=[gso.FixedBoundary()])
    np.testing.assert_allclose(held.grid, saddle(9), atol=1e-12)


def test_a_sheet_that_is_pressed_together_bulges():
    n = 17
    ids = ends(n, rows=1)
    target = sheet(n).reshape(-1, 3)[ids]
    target[n:, 0] -= 0.6
    result = gso.tno.optimize(sheet(n), task="bend", constraints=[gso.Handle(ids, target)])
    assert result.metrics["edge_length_error"] < 1e-5
    assert np.ptp(result.mesh.vertices[:, 2]) > 0.5


def drawn_together(mesh: Mesh, share: float) -> gso.Handle:
    """Three far vertices of a mesh, closer to each other than they were."""
    v = mesh.vertices
    ids = [int(v[:, 0].argmin()), int((v[:, 0] + v[:, 1]).argmax()), int(v[:, 1].argmin())]
    return gso.Handle(ids, v[ids] + share * (v[ids].mean(axis=0) - v[ids]))


@pytest.mark.parametrize("kind", ["grid", "triangles", "valence 3", "valence 5", "hole"])
def test_every_kind_of_mesh_keeps_its_lengths(kind):
    grid = Mesh.from_grid(saddle(13, strength=0.2))
    mesh = {
        "grid": grid,
        "triangles": Mesh(grid.vertices, grid.triangles),
        "valence 3": star(3),
        "valence 5": star(5),
        "hole": with_hole(),
    }[kind]
    result = gso.tno.optimize(mesh, task="bend", constraints=[drawn_together(mesh, 0.1)])
    assert result.converged
    assert result.metrics["edge_length_error"] < 1e-3
    assert result.metrics["strain_p99"] < 8e-3


def test_copies_bend_alike():
    mesh = Mesh.from_grid(saddle(11))
    hand = drawn_together(mesh, 0.1)
    result = gso.tno.optimize(mesh, task="bend", constraints=[hand])
    place = lambda p: 40.0 * p @ MOTION.as_matrix().T + [100.0, 7.0, 0.0]  # noqa: E731
    copy = shuffled(mesh.replaced(place(mesh.vertices)), seed=3)
    order = np.argsort(np.random.default_rng(3).permutation(len(mesh.vertices)))
    handle = gso.Handle(order[np.asarray(hand.ids)], place(np.asarray(hand.positions)))
    other = gso.tno.optimize(copy, task="bend", constraints=[handle])
    wanted = place(result.mesh.vertices)
    np.testing.assert_allclose(other.mesh.vertices[order], wanted, atol=40 * 1e-4)
    assert other.metrics["strain_mean"] == pytest.approx(result.metrics["strain_mean"], rel=1e-3)


def test_soft_handles_pull_and_hard_ones_hold():
    mesh = Mesh.from_grid(saddle(11))
    hard = drawn_together(mesh, 0.1)
    soft = gso.Handle(hard.ids, hard.positions, weight=1.0)
    one, other = (gso.tno.optimize(mesh, task="bend", constraints=[h]) for h in (hard, soft))
    gap = np.abs(one.mesh.vertices - other.mesh.vertices).max()
    assert 0 < gap < 1e-2
    assert max(one.details["constraints"].values()) < 1e-9


def test_parts_without_handles_stay():
    one = Mesh.from_grid(saddle(7))
    two = Mesh(
        np.r_[one.vertices, one.vertices + np.array([5.0, 0, 0])], np.r_[one.faces, one.faces + 49]
    )
    handle = gso.Handle([0, 6], one.vertices[[0, 6]] + np.array([0, 0, 3.0]))
    result = gso.tno.optimize(two, task="bend", constraints=[handle])
    np.testing.assert_allclose(result.mesh.vertices[49:], two.vertices[49:], atol=1e-9)
    np.testing.assert_allclose(
        result.mesh.vertices[:49], one.vertices + np.array([0, 0, 3.0]), atol=1e-8
    )


def test_a_start_is_taken_up():
    n = 13
    ids, wanted = ends(n), rolled(n, 2.0).reshape(-1, 3)
    cold = gso.tno.optimize(sheet(n), task="bend", constraints=[gso.Handle(ids, wanted[ids])])
    warm = gso.tno.optimize(
        sheet(n), task="bend", constraints=[gso.Handle(ids, wanted[ids])], x0=cold.mesh
    )
    assert warm.iterations < cold.iterations
    np.testing.assert_allclose(warm.mesh.vertices, cold.mesh.vertices, atol=1e-4)


@pytest.mark.parametrize(
    "wrong", [{"w_bending": 0.0}, {"w_bending_start": -1.0}, {"iterations": 0.5}]
)
def test_wrong_options_are_named(wrong):
    with pytest.raises(gso.OptionError, match=next(iter(wrong))):
        gso.BendOptions(**wrong)


def test_results_are_drawn_and_saved(tmp_path):
    pytest.importorskip("matplotlib")
    mesh = Mesh.from_grid(saddle(9))
    result = gso.tno.optimize(mesh, task="bend", constraints=[drawn_together(mesh, 0.1)])
    gso.plot.plot_result(result, tmp_path / "bent.png")
    result.save(tmp_path / "bent.npz")
    assert gso.Result.load(tmp_path / "bent.npz").metrics == pytest.approx(result.metrics)


def test_spread_is_affine_where_it_can_be():
    mesh = Mesh.from_grid(sheet(9))
    ids = ends(9)
    handle = gso.Handle(ids, mesh.vertices[ids] @ MOTION.as_matrix() + 1.0)
    start = gso.BendOptions(iterations=0)
    result = gso.tno.optimize(mesh, task="bend", constraints=[handle], options=start)
    moved = mesh.vertices @ MOTION.as_matrix() + 1.0
    np.testing.assert_allclose(result.mesh.vertices, moved, atol=1e-3)


def test_spread_of_meshes_without_polylines():
    square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    result = gso.tno.optimize(square, task="bend", constraints=[gso.Handle([0], [[0, 0, 2.0]])])
    np.testing.assert_allclose(
        result.mesh.vertices, square.vertices + np.array([0, 0, 2.0]), atol=1e-9
    )
