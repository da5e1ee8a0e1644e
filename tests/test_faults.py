"""Folds, crossings, overlaps and collapse: found where they are, and nowhere else."""

from __future__ import annotations

import time

import numpy as np
import pytest

from gso import faults, geometry, metrics
from gso.mesh import Mesh
from tests.conftest import cylinder, meshes, rotation, saddle, shuffled

N = 24
T = np.linspace(0.0, 1.0, N)[:, None] + np.zeros((N, N))
V = np.linspace(-1.0, 1.0, N)[None, :] + np.zeros((N, N))


def grid(x, y, z):
    """A grid in general position."""
    return Mesh.from_grid(np.stack(np.broadcast_arrays(x, y, z), axis=-1) @ rotation(3) + 40.0)


def rolled(turns, fall=0.0):
    """A sheet rolled up, closer to the axis from turn to turn."""
    angle, radius = 2 * np.pi * turns * T, 1.0 - fall * T
    return grid(radius * np.cos(angle), radius * np.sin(angle), V)


def through():
    """A sheet rolled by more than a turn, so slanted that it passes through itself."""
    angle = 7.5 * T
    return grid(np.cos(angle), np.sin(angle) + 0.3 * T, V + 0.1 * T)


def ramp():
    angle, radius = 14.0 * T, 1.5 + 0.5 * V
    return grid(radius * np.cos(angle), radius * np.sin(angle), 1.2 * T)


def eight():
    angle = 2 * np.pi * T
    return grid(np.sin(angle + 0.1), 0.5 * np.sin(2 * angle + 0.2), V)


def kinds(mesh):
    """The same surface as a grid, quads in disorder, triangles, and mixed."""
    quads = shuffled(mesh)
    some, rest = mesh.faces[::3], np.delete(mesh.faces, np.s_[::3], axis=0)
    halves = np.concatenate([some[:, [0, 1, 2]], some[:, [0, 2, 3]]])
    mixed = np.r_[rest, np.c_[halves, np.full(len(halves), -1)]]
    return {
        "grid": mesh,
        "quads": quads,
        "triangles": Mesh(mesh.vertices, mesh.triangles),
        "mixed": Mesh(mesh.vertices, mixed),
    }


KINDS = ["grid", "quads", "triangles", "mixed"]


@pytest.mark.parametrize("range_of_sizes", [0, 3])
def test_rectangles_overlap_as_by_brute_force(range_of_sizes):
    rng = np.random.default_rng(2)
    low = rng.random((300, 2))
    size = 0.2 * 10.0 ** (-range_of_sizes * rng.random((300, 1)))
    high = low + size * rng.uniform(0.5, 1.0, (300, 2))
    i, j = np.triu_indices(300, 1)
    depth = (np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])).min(axis=1)
    flat = np.stack([low, [1, 0] * high + [0, 1] * low, high, [1, 0] * low + [0, 1] * high], axis=1)
    flat = flat.reshape(-1, 2)
    mesh = Mesh(np.c_[flat, np.repeat(np.arange(300.0), 4)], np.arange(1200).reshape(300, 4))
    found = {tuple(p) for p in faults.overlapping(mesh, flat)}
    # Those that overlap by less than a hundredth of the smaller one may count or not.
    slight = 1e-2 * np.minimum(size[i], size[j])[:, 0]
    assert {(a, b) for a, b, d, s in zip(i, j, depth, slight) if d > s} <= found
    assert found <= {(a, b) for a, b, d in zip(i, j, depth) if d > 0}
    assert len(found) > 20


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [through, eight])
def test_a_sheet_that_passes_through_itself(make, kind):
    mesh = kinds(make())[kind]
    pairs = faults.crossings(mesh)
    assert len(pairs) > 5
    # The centres of faces that cross are near each other in space and far apart in the sheet.
    centre = np.array([mesh.vertices[f[f >= 0]].mean(axis=0) for f in mesh.faces])
    edge = np.linalg.norm(np.subtract(*mesh.vertices[mesh.edges.T]), axis=1).max()
    assert np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1).max() < 2 * edge
    assert (np.diff(pairs, axis=1) > 0).all() and len(np.unique(pairs, axis=0)) == len(pairs)
    assert not faults.folded(mesh).size


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "make",
    [
        lambda: Mesh.from_grid(saddle(N)),
        lambda: Mesh.from_grid(cylinder(N)),
        lambda: rolled(2.2, 0.4),
        lambda: rolled(1.0),  # closed: its two sides touch
        lambda: rolled(1.0, 1e-5),
        ramp,
    ],
)
def test_sound_surfaces_raise_no_alarm(make, kind):
    mesh = kinds(make())[kind]
    assert not faults.crossings(mesh).size
    assert not faults.folded(mesh).size
    assert not len(faults.collapsed(mesh, mesh.vertices))


def beside(*parts):
    """Meshes as the components of one."""
    start = np.cumsum([0, *(len(p.vertices) for p in parts)])
    faces = [np.where(p.faces < 0, -1, p.faces + s) for p, s in zip(parts, start, strict=False)]
    width = max(f.shape[1] for f in faces)
    faces = [np.pad(f, ((0, 0), (0, width - f.shape[1])), constant_values=-1) for f in faces]
    return Mesh(np.concatenate([p.vertices for p in parts]), np.concatenate(faces))


def moved(mesh, offset):
    return mesh.replaced(mesh.vertices + np.array(offset))


def test_parts_that_touch_or_lie_on_each_other_do_not_cross():
    sheet = Mesh.from_grid(np.dstack([*np.mgrid[:6.0, :6.0], np.zeros((6, 6))]))
    angle = np.linspace(0, np.pi, 9)[:, None] + np.zeros((9, 6))
    arch = np.stack([2 + np.cos(angle), np.zeros((9, 6)) + np.arange(6), -np.sin(angle)], axis=-1)
    tube = Mesh.from_grid(arch)
    low = tube.vertices[:, 2].min()
    for other in (
        moved(sheet, [0.3, 0.2, 0]),  # in one plane
        moved(sheet, [5, 0, 0]),  # side by side
        moved(tube, [0.1, 0, -low]),  # a tube laid on a sheet
        moved(tube, [0, 0, 0]),  # ... and under it, with its edges in its plane
    ):
        assert not faults.crossings(beside(sheet, other)).size
    assert not faults.crossings(beside(tube, moved(tube, [2, 0, 0]))).size
    assert faults.crossings(beside(sheet, moved(tube, [0.1, 0, -0.5 * low]))).size


def test_a_crossing_is_found_wherever_it_lies():
    small = Mesh.from_grid(saddle(9))
    wall = Mesh.from_grid(np.dstack([np.full((9, 9), 0.31), *np.mgrid[-1:1:9j, -2:2:9j]]))
    for scale, offset in ((1.0, 0.0), (1e6, 3e7), (1e-6, 5.0)):
        mesh = beside(small, wall)
        found = faults.crossings(mesh.replaced(scale * mesh.vertices + offset))
        np.testing.assert_array_equal(found, faults.crossings(mesh))
        assert (found[:, 0] < 64).all() and (found[:, 1] >= 64).all() and len(found) >= 8


@pytest.mark.parametrize("kind", KINDS)
def test_a_folded_strip(kind):
    x = np.array([0.0, 1, 2, 3, 2, 1, 0])[:, None] + np.zeros((7, 4))
    height = np.array([0.0, 0, 0, 0, 0.1, 0.1, 0.1])[:, None] + np.zeros((7, 4))
    flat = Mesh.from_grid(np.dstack([np.arange(7.0)[:, None] + 0 * x, 0 * x + np.arange(4), 0 * x]))
    strip = np.dstack([x, 0 * x + np.arange(4), height])
    mesh = kinds(flat)[kind]
    order = np.argmin(((mesh.vertices[:, None] - flat.vertices[None]) ** 2).sum(axis=2), axis=1)
    folded = mesh.replaced(strip.reshape(-1, 3)[order])
    found = faults.folded(folded)
    where = {frozenset(f[f >= 0]) for f in mesh.faces[found]}
    line = np.isin(mesh.faces, np.flatnonzero(strip.reshape(-1, 3)[order][:, 0] == 3))
    expected = {frozenset(f[f >= 0]) for f in mesh.faces[(line & (mesh.faces >= 0)).sum(1) > 1]}
    assert where == expected
    assert not faults.folded(mesh).size


def test_a_face_turned_over_is_found_on_either_diagonal():
    flat = np.dstack([*np.mgrid[:5.0, :5.0], np.zeros((5, 5))])
    for corner in ([1.2, 2.8, 0], [2.8, 1.2, 0], [1.2, 1.2, 0], [2.8, 2.8, 0]):
        bad = flat.copy()
        bad[2, 2] = corner
        grid = Mesh.from_grid(bad)
        turned = metrics.flipped_faces(grid, grid.vertices[:, :2])
        assert turned.size
        assert np.isin(turned, faults.folded(grid)).all()
        assert np.isin(faults.folded(grid), [5, 6, 9, 10]).all()


def test_arrows_are_no_folds_where_the_mesh_is_no_grid():
    kite = np.array([[0.0, 0, 0], [2, -2, 0], [0.5, 0, 0], [2, 2, 0], [3, 0, 0]])
    mesh = Mesh(kite, [[0, 1, 2, 3], [1, 4, 3, 2]])
    assert not faults.folded(mesh).size


@pytest.mark.parametrize("kind", KINDS)
def test_the_pattern_of_a_cylinder_and_of_a_long_ring(kind):
    angle, radius = T, 1.5 + 0.5 * V
    plane = grid(T, V, 0 * T)
    mesh = kinds(plane)[kind]
    order = np.argmin(((mesh.vertices[:, None] - plane.vertices[None]) ** 2).sum(axis=2), axis=1)

    def sector(full):
        out = np.stack([radius * np.cos(full * angle), radius * np.sin(full * angle)], axis=-1)
        return out.reshape(-1, 2)[order]

    assert not faults.overlaps(mesh, np.stack([T, V], axis=-1).reshape(-1, 2)[order]).size
    for full in (3.0, 2 * np.pi - 1e-3, 2 * np.pi):
        assert not faults.overlaps(mesh, sector(full)).size
    found = faults.overlaps(mesh, sector(2.5 * np.pi))
    corners = [f[f >= 0] for f in mesh.faces]
    turned = T.reshape(-1)[order]
    # A fifth of the ring lies on its beginning.
    for k, ids in enumerate(corners):
        middle = turned[ids].mean()
        inside = middle < 0.15 or middle > 0.85
        outside = 0.25 < middle < 0.75
        assert (k in found) or not inside
        assert (k not in found) or not outside


def test_parts_side_by_side_must_not_overlap():
    tile = Mesh.from_grid(np.dstack([*np.mgrid[:4.0, :4.0], np.zeros((4, 4))]))
    mesh = beside(tile, moved(tile, [9, 0, 0]))
    flat = tile.vertices[:, :2]
    assert not faults.overlaps(mesh, np.r_[flat, flat + np.array([3.0, 0.0])]).size
    np.testing.assert_array_equal(
        faults.overlaps(mesh, np.r_[flat, flat + np.array([2.5, 0.0])]), [6, 7, 8, 9, 10, 11]
    )
    # One part wholly inside a face of the other, and both in one place.
    np.testing.assert_array_equal(
        faults.overlaps(mesh, np.r_[flat, 0.1 * flat + 1.2]), [4, *range(9, 18)]
    )
    assert len(faults.overlaps(mesh, np.r_[flat, flat])) == 18


def test_faces_wound_round_a_vertex_overlap():
    turns = np.linspace(0.0, 2.4 * np.pi, 9)
    fan = np.stack([np.cos(turns), np.sin(turns), 0.2 * turns], axis=1)
    mesh = Mesh(np.r_[[[0.0, 0, 0.5]], fan], [[0, k, k + 1] for k in range(1, 9)])
    flat = np.r_[[[0.0, 0.0]], fan[:, :2]]
    assert len(faults.overlaps(mesh, flat)) == 8
    narrow = np.stack([np.cos(0.8 * turns), np.sin(0.8 * turns)], axis=1)
    assert not faults.overlaps(mesh, np.r_[[[0.0, 0.0]], narrow]).size


def test_collapsed_edges_are_named():
    mesh = Mesh.from_grid(saddle(5))
    after = mesh.vertices.copy()
    after[7] = after[6] + 0.01 * (after[7] - after[6])
    np.testing.assert_array_equal(faults.collapsed(mesh, after), [[6, 7]])
    assert not len(faults.collapsed(mesh, 0.5 * mesh.vertices))


@pytest.mark.parametrize("kind", list(meshes()))
def test_flipped_faces_are_numbered(kind):
    mesh = meshes()[kind]
    flat = mesh.vertices[:, :2].copy()
    if metrics.corner_areas(flat, mesh.faces).mean() < 0:
        flat = flat * [1.0, -1.0]
    assert not metrics.flipped_faces(mesh, flat).size
    np.testing.assert_array_equal(
        metrics.flipped_faces(mesh, flat * [-1.0, 1.0]), np.arange(len(mesh.faces))
    )


def rough(seed):
    """A sheet whose height, and slide in its plane, are random waves."""
    rng = np.random.default_rng(seed)
    wave = [
        sum(
            rng.normal() * np.cos(a * np.pi * T + b * np.pi * V / 2 + rng.uniform(0, 6))
            for a in range(4)
            for b in range(4)
        )
        for _ in range(3)
    ]
    size = rng.uniform(0.02, 0.2)
    return grid(2 * T + size * wave[0], V + size * wave[1], 0.15 * wave[2])


def wound(seed):
    """A sheet rolled into a spiral or a ramp by a random angle."""
    rng = np.random.default_rng(seed)
    angle, slope = rng.uniform(2, 9) * T, rng.uniform(-0.5, 0.5)
    radius = 1.0 - rng.uniform(0, 0.3) * T + slope * V
    return grid(radius * np.cos(angle), radius * np.sin(angle) + 0.3 * T, V + rng.uniform(0, 3) * T)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [rough, wound])
def test_surfaces_that_need_no_test_of_pairs_have_no_crossings(make, kind):
    """Beside a part that crosses itself nothing is proved, and all pairs are tested."""
    wall = Mesh.from_grid(np.dstack([np.full((3, 3), 0.2), *np.mgrid[-1:1:3j, -1:1:3j]]))
    trouble = moved(beside(Mesh.from_grid(saddle(3)), wall), [70.0, 0, 0])
    proved = crossed = 0
    for seed in range(24):
        mesh = kinds(make(seed))[kind]
        found = faults.crossings(mesh)
        every = faults.crossings(beside(mesh, trouble))
        assert len(every) > len(found)
        np.testing.assert_array_equal(found, every[every[:, 0] < len(mesh.faces)])
        axis = faults.one_to_one.upright(geometry.area_vectors(mesh.vertices, mesh.triangles))
        proved += axis is not None
        crossed += len(found) > 0
    assert 4 <= proved <= 24 - crossed and crossed >= 1


@pytest.mark.parametrize("kind", KINDS)
def test_patterns_that_need_no_test_of_pairs_have_no_overlaps(kind):
    flat_grid = grid(T, V, 0 * T)
    mesh = kinds(flat_grid)[kind]
    order = np.argmin(((mesh.vertices[:, None] - flat_grid.vertices) ** 2).sum(axis=2), axis=1)
    tile = Mesh.from_grid(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))]))
    both = beside(mesh, tile, tile)
    proved = lying = 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        angle, radius = rng.uniform(1, 8) * T, 1.5 + rng.uniform(0.2, 0.7) * V + 0.1 * T
        z = radius * np.exp(1j * angle) + 0.005 * seed * T**2 * np.exp(6j * V)
        flat = np.stack([z.real, -z.imag], axis=-1).reshape(-1, 2)[order]
        found = faults.overlaps(mesh, flat)
        square = tile.vertices[:, :2] + 20.0
        every = faults.overlaps(both, np.r_[flat, square, square + 0.5])
        assert len(every) > len(found)
        np.testing.assert_array_equal(found, every[every < len(mesh.faces)])
        proved += (
            faults.one_to_one.simple_boundary(mesh, flat)
            and not metrics.flipped_faces(mesh, flat).size
        )
        lying += len(found) > 0
    assert min(proved, lying) >= 5


def test_a_boundary_that_touches_or_crosses_itself_proves_nothing():
    square = Mesh.from_grid(np.dstack([*np.mgrid[:4.0, :4.0], np.zeros((4, 4))]))
    flat = square.vertices[:, :2]
    assert faults.one_to_one.simple_boundary(square, flat)
    for corner in ([0.0, 2.0], [-0.5, 1.5]):
        bent = flat.copy()
        bent[0] = corner
        assert not faults.one_to_one.simple_boundary(square, bent)
    holed = Mesh(square.vertices, np.delete(square.faces, 4, axis=0))
    assert faults.one_to_one.simple_boundary(holed, flat)
    pair = beside(square, moved(square, [9, 0, 0]))
    assert faults.one_to_one.simple_boundary(pair, pair.vertices[:, :2])
    # Without a crossing of boundaries, but one inside the other.
    assert not faults.one_to_one.simple_boundary(pair, np.r_[flat, 0.1 * flat + 1.1])


def test_directions_from_which_a_surface_is_seen_from_one_side():
    for seed in range(5):
        turn = rotation(seed)
        cone = np.random.default_rng(seed).standard_normal((40, 3)) + np.array([0, 0, 3.0])
        cone = cone[cone[:, 2] > 0.5] @ turn.T
        axis = faults.one_to_one.upright(cone)
        assert axis is not None and (cone @ axis > 0).all()
    assert faults.one_to_one.upright(np.concatenate([np.eye(3), -np.eye(3)])) is None


def test_it_is_fast():
    mesh = Mesh.from_grid(saddle(64) @ rotation(1))
    flat = mesh.vertices[:, :2].copy()

    def once():
        start = time.process_time()
        faults.crossings(mesh), faults.folded(mesh), faults.overlaps(mesh, flat)
        faults.collapsed(mesh, mesh.vertices)
        return time.process_time() - start

    assert min(once() for _ in range(5)) < 0.1


def _sheet_about_a_line(angles, shift=0.0):
    """Return half-planes about the y axis, as one sheet from the first to the last angle."""
    y = np.linspace(0, 4, 5) + shift
    rows = []
    for k, angle in enumerate(np.radians(angles)):
        for radius in (2.0, 1.0) if k == 0 else (1.0, 2.0):
            rows.append([(radius * np.cos(angle), v, radius * np.sin(angle)) for v in y])
        if k == 0 and len(angles) > 1:
            rows.append([(0.0, v, 0.0) for v in y])
    return Mesh.from_grid(np.array(rows))


@pytest.mark.parametrize("shift", [0.0, 0.3])
@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize(
    ("one", "two", "cross"),
    [
        ((0, 180), (90, 270), True),
        ((0, 180), (30, 200), True),
        ((0, 120), (60, 240), True),
        ((0, 90), (180, 270), False),
        ((0, 180), (30, 150), False),
        ((-30, 210), (20, 160), False),
    ],
)
def test_sheets_that_meet_along_edges(one, two, cross, shift, turn):
    c, s = np.cos(turn), np.sin(turn)
    both = beside(_sheet_about_a_line(one), _sheet_about_a_line(two, shift))
    mesh = both.replaced(both.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    found = faults.crossings(mesh)
    assert bool(found.size) == cross
    if cross:
        # The faces that are named have two corners on the line.
        on = np.linalg.norm(both.vertices[:, [0, 2]], axis=1) < 1e-9
        assert (on[mesh.faces[found]].sum(axis=-1) == 2).all()


def test_a_wall_that_ends_on_a_floor_does_not_cross_it():
    floor = _sheet_about_a_line((0, 180))
    y, z = np.meshgrid(np.linspace(0, 4, 5), [0.0, 1.0, 2.0])
    wall = Mesh.from_grid(np.stack([0 * y, y, z], axis=-1))
    assert not faults.crossings(beside(floor, wall)).size
