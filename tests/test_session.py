"""Sessions: handles move exactly, analyses are kept, the end is that of a solve at once."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso.mesh import Mesh
from tests.conftest import saddle, shuffled
from tests.test_bend import ends, rolled, sheet

N = 15
FIXED, HAND = ends(N)[: 2 * N], ends(N)[2 * N :]


def bending(weight: float | None = None, **more) -> gso.tno.Session:
    """A sheet with one end fixed and the other in hand."""
    flat = sheet(N).reshape(-1, 3)
    return gso.tno.Session(
        sheet(N), constraints=[gso.Fixed(FIXED), gso.Handle(HAND, flat[HAND], weight)], **more
    )


def target(angle: float) -> np.ndarray:
    """Where the end in hand goes when the sheet rolls up, its other end fixed."""
    points = rolled(N, angle).reshape(-1, 3)
    here, there = points[FIXED], sheet(N).reshape(-1, 3)[FIXED]
    p, q = here - here.mean(axis=0), there - there.mean(axis=0)
    u, _, vt = np.linalg.svd(q.T @ p)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return (points[HAND] - here.mean(axis=0)) @ turn.T + there.mean(axis=0)


def test_dragging_reuses_the_analysis_and_keeps_handles_exactly():
    session = bending()
    assert session.analyses == 1
    for angle in np.linspace(0.1, 1.5, 15):
        session.move(HAND, target(angle))
        np.testing.assert_allclose(session.vertices[HAND], target(angle), atol=1e-12)
        vertices = session.step()
        np.testing.assert_allclose(vertices[HAND], target(angle), atol=1e-12)
        np.testing.assert_allclose(vertices[FIXED], sheet(N).reshape(-1, 3)[FIXED], atol=1e-12)
        bent = Mesh.from_grid(vertices.reshape(N, N, 3))
        assert gso.metrics.edge_length_error(sheet(N), bent) < 2e-3
    assert session.analyses == 1


@pytest.mark.parametrize("weight", [None, 1.0])
def test_a_settled_session_is_a_solve_at_once(weight):
    session = bending(weight)
    for angle in np.linspace(0.15, 1.5, 10):
        session.move(HAND, target(angle))
        session.step()
    result = session.settle()
    at_once = gso.tno.optimize(
        sheet(N),
        task="bend",
        constraints=[gso.Fixed(FIXED), gso.Handle(HAND, target(1.5), weight)],
    )
    np.testing.assert_allclose(result.mesh.vertices, at_once.mesh.vertices, atol=5e-4)
    assert sum(result.energy.values()) == pytest.approx(sum(at_once.energy.values()), rel=1e-3)
    assert result.metrics.keys() == at_once.metrics.keys()
    assert result.warm_start == "session" and result.backend == at_once.backend


def test_a_settled_session_never_has_more_energy_than_a_solve_at_once():
    mesh = Mesh.from_grid(np.dstack([*np.mgrid[:21.0, :21.0], np.zeros((21, 21))]))
    v, (fixed, hand) = (
        mesh.vertices,
        (mesh.grid_index[rows].ravel() for rows in (slice(2), [-2, -1])),
    )
    goal = v[hand] - [6, 0, 0]
    session = gso.tno.Session(mesh, constraints=[gso.Fixed(fixed), gso.Handle(hand, v[hand])])
    for share in np.linspace(0.1, 1.0, 10):
        session.move(hand, v[hand] + share * (goal - v[hand]))  # pushed together, in its plane
        session.step()
    result = session.settle()
    constraints = [gso.Fixed(fixed), gso.Handle(hand, goal)]
    at_once = gso.tno.optimize(mesh, task="bend", constraints=constraints)
    assert sum(result.energy.values()) <= (1 + 1e-3) * sum(at_once.energy.values())
    assert result.usable and at_once.usable
    assert any("solve from the design" in note for note in result.notes)
    np.testing.assert_allclose(session.vertices, result.mesh.vertices, atol=1e-12)


def test_a_surface_lags_less_than_a_frame_behind():
    session = bending()
    for angle in np.linspace(0.05, 1.0, 20):
        session.move(HAND, target(angle))
        vertices = session.step(2)
    frame = np.linalg.norm(target(1.0) - target(0.95), axis=1).max()
    lag = np.linalg.norm(session.settle().mesh.vertices - vertices, axis=1)
    assert lag.max() < frame


def test_constraints_can_change_and_only_then_are_analysed_again():
    session = bending()
    session.move(HAND, target(0.5))
    session.step(3)
    before = session.vertices
    corner = HAND[-1]
    session.constrain([gso.Fixed(FIXED), gso.Handle([corner], before[[corner]])])
    assert session.analyses == 2
    np.testing.assert_allclose(session.vertices, before, atol=1e-9)
    session.move([corner], before[[corner]] + [0.0, 0.0, 0.1])
    session.step()
    assert session.analyses == 2
    with pytest.raises(gso.OptionError, match=f"vertex {HAND[0]} has no handle"):
        session.move([HAND[0]], before[[HAND[0]]])
    free = session.settle()
    assert free.metrics["edge_length_error"] < 1e-3


def test_vertices_are_in_the_users_numbering_and_unit():
    mesh = Mesh.from_grid(200.0 * saddle(9) + [1000.0, 0.0, 0.0])
    mixed = shuffled(mesh, seed=2)
    order = np.argsort(np.random.default_rng(2).permutation(len(mesh.vertices)))
    ids = np.array([0, 8, 80])
    goal = mesh.vertices[ids] + [[0, 0, 0], [0, 0, 0], [-10.0, 0, 20.0]]
    sessions = []
    for surface, own in ((mesh, ids), (mixed, order[ids])):
        session = gso.tno.Session(
            surface, constraints=[gso.Handle(own, surface.vertices[own])], options="accurate"
        )
        session.move(own, goal)
        np.testing.assert_allclose(session.vertices[own], goal, atol=1e-9)
        sessions.append(session.settle().mesh.vertices)
    np.testing.assert_allclose(sessions[0], sessions[1][order], atol=0.05)


def test_developable_surfaces_are_dragged_too():
    grid = saddle(17, strength=0.2)
    v = grid.reshape(-1, 3)
    ids, soft = [0, 16, 288], [144]
    session = gso.tno.Session(
        grid,
        task="developable",
        constraints=[gso.Handle(ids, v[ids]), gso.Handle(soft, v[soft], weight=0.5)],
    )
    start = session.result()
    for k in range(1, 6):
        session.move([288], v[[288]] + [0, 0, 0.01 * k])
        session.move(soft, v[soft] - [0, 0, 0.01 * k])
        vertices = session.step()
        np.testing.assert_allclose(vertices[ids[:2]], v[ids[:2]], atol=1e-12)
    assert session.analyses == 1
    end = session.settle()
    assert end.metrics["loss_gc"] < 0.6 * start.metrics["loss_gc_before"]
    assert vertices[144, 2] < v[144, 2] - 0.02


def test_the_first_iteration_after_a_move_changes_offsets_on_large_meshes():
    grid = saddle(46, strength=0.1)
    v = grid.reshape(-1, 3)
    ids = [0, 45, 46 * 45]
    session = gso.tno.Session(grid, task="developable", constraints=[gso.Handle(ids, v[ids])])
    assert session.analyses == 1
    session.move(ids[2:], v[ids[2:]] + [0, 0, 0.05])
    session.step()
    # One for offsets and one for free vertices.
    assert session.analyses == 2
    moving = session.result()
    assert sum(session.result().energy.values()) == sum(moving.energy.values())
    session.step()
    assert sum(session.result().energy.values()) < sum(moving.energy.values())
    np.testing.assert_allclose(session.vertices[ids[:2]], v[ids[:2]], atol=1e-12)
    session.move(ids[2:], v[ids[2:]] + [0, 0, 0.06])
    session.step(2)
    session.constrain([gso.Handle(ids, v[ids])])
    session.step()
    assert session.settle().usable


def test_hard_lengths_are_never_left_to_offsets():
    grid = saddle(46, strength=0.2)
    held = [
        gso.Fixed([0, 1]),
        gso.FixedLengths([[0, 46], [46, 92]]),
        gso.Handle([2115], [[1, 1, 0]]),
    ]
    session = gso.tno.Session(grid, task="developable", constraints=held, options="fast")
    session.move([2115], [[1, 1, 0.1]])
    session.step()
    assert session.analyses == 1


def test_without_constraints_nothing_moves():
    session = gso.tno.Session(saddle(9))
    np.testing.assert_allclose(session.step(3), saddle(9).reshape(-1, 3), atol=1e-15)
    assert session.result().status is gso.Status.ALREADY_GOOD


@pytest.mark.parametrize(
    "constraint",
    [
        gso.FixedLengths(),
        gso.PlanarFaces(),
        gso.SlidingBoundary(),
        gso.OnCurve(np.arange(9), [[-1, -1, 0], [-1, 1, 0.2]]),
    ],
    ids=lambda c: type(c).__name__,
)
def test_a_settled_surface_keeps_all_that_is_hard(constraint):
    v = saddle(9, strength=0.1).reshape(-1, 3)
    session = gso.tno.Session(
        saddle(9, strength=0.1),
        task="developable",
        constraints=[constraint, gso.Handle([40], v[[40]])],
    )
    assert session.result().usable
    for height in (0.05, 0.1):
        session.move([40], v[[40]] + [0.0, 0.0, height])
        session.step(2)
        result = session.settle()
        assert max(result.details["constraints"].values()) <= 1e-6 * result.design.frame.scale
        assert result.usable
        np.testing.assert_allclose(result.mesh.vertices[40], v[40] + [0, 0, height], atol=1e-12)


def test_handles_may_be_masks_numbers_and_generators():
    v = saddle(9).reshape(-1, 3)
    mask = np.zeros(81, bool)
    mask[[72, 80]] = True
    up = [0.0, 0.0, 0.1]
    handles = (gso.Handle(ids, v[ids]) for ids in (mask, 40, [0]))
    session = gso.tno.Session(saddle(9), constraints=handles)
    session.move([80], v[[80]] + up)
    session.move(40, v[40] + up)
    session.move([], [])
    np.testing.assert_allclose(
        session.step()[[0, 40, 72, 80]] - v[[0, 40, 72, 80]],
        [[0, 0, 0], up, [0, 0, 0], up],
        atol=1e-12,
    )
    session.move(mask, v[mask])
    np.testing.assert_allclose(session.step()[mask], v[mask], atol=1e-12)


def test_the_status_is_that_of_the_surface_as_it_is():
    session = bending()
    assert session.result().converged
    session.move(HAND, target(0.3))
    assert not session.result().converged
    assert session.settle().converged
    session.constrain([gso.Fixed(FIXED)])
    assert not session.result().converged
    # What was good as it came is not, once a handle is put elsewhere.
    v = saddle(9).reshape(-1, 3)
    good = gso.tno.Session(saddle(9))
    good.constrain([gso.Handle([0, 80], v[[0, 80]] + [[0, 0, 0], [0, 0, 0.5]])])
    result = good.result()
    assert result.status is not gso.Status.ALREADY_GOOD
    np.testing.assert_allclose(result.mesh.vertices[80], v[80] + [0, 0, 0.5], atol=1e-12)


def test_soft_handles_of_one_vertex_agree_on_the_middle():
    v = saddle(9).reshape(-1, 3)
    handles = [gso.Handle([80], v[[80]] + shift, weight=1.0) for shift in (0.1, -0.1)]
    session = gso.tno.Session(saddle(9), constraints=[gso.Fixed(np.arange(9)), *handles])
    np.testing.assert_allclose(session.settle().mesh.vertices, v, atol=1e-6)


def test_a_bound_holds_frame_after_frame():
    u, w = np.meshgrid(np.linspace(-1, 1, 30), np.linspace(-1, 1, 30), indexing="ij")
    noise = 5e-4 * np.random.default_rng(0).standard_normal((30, 30, 3))
    panel = np.stack([u, w, 0.2 * u * u], axis=-1) + noise
    session = gso.tno.Session(panel, task="developable")
    first = np.linalg.norm(session.vertices - panel.reshape(-1, 3), axis=1).max()
    for _ in range(4):
        away = np.linalg.norm(session.step() - panel.reshape(-1, 3), axis=1).max()
        assert away <= first * (1 + 1e-6)


def test_refusals():
    with pytest.raises(gso.OptionError, match="flatten"):
        gso.tno.Session(saddle(9), task="flatten")
    with pytest.raises(gso.OptionError, match="denoise"):
        gso.tno.Session(saddle(9), task="denoise")
    session = bending()
    for ids, positions, message in (
        ([0], [[0, 0, np.nan]], r"move\(\) needs 1 positions"),
        ([0], [[0, 0]], r"\(1, 3\), got \(1, 2\)"),
        ([999], [[0, 0, 0]], "vertex 999"),
        ([0, [1]], [[0, 0, 0]], "vertex indices"),
        ([HAND[0]] * 2, [[0, 0, 0], [1, 1, 1]], f"contradicts itself at vertex {HAND[0]}"),
    ):
        with pytest.raises(gso.OptionError, match=message):
            session.move(ids, positions)
    for iterations in (0, -1, 1.5, "a", None):
        with pytest.raises(gso.OptionError, match="1 or more"):
            session.step(iterations)
    with pytest.raises(gso.OptionError, match="no handle"):
        session.move([0], [[0.0, 0.0, 0.0]])
