"""Pieces of designs with sharp edges, with noses, and of rods, whose ends recede."""

import numpy as np
import pytest

import gso
from gso import faults, metrics
from gso.mesh import Mesh


def with_nose(side: int) -> Mesh:
    """A dome with a cone on it, whose rim the mesh does not follow."""
    x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    away = np.hypot(x - 0.1, y)
    height = 0.6 * np.sqrt(3.2 - x**2 - y**2) + np.maximum(0.0, 1.6 * (0.25 - away))
    grid = Mesh.from_grid(np.dstack([x, y, height]))
    return Mesh(grid.vertices, grid.triangles)


def rod(around: int, along: int) -> Mesh:
    """A bent rod with round ends."""
    way = np.linspace(0.0, 1.0, along)
    radius = 0.18 * np.sqrt(np.sin(np.pi * np.clip(way, 0.02, 0.98)) ** 0.5)
    centre = np.stack([np.cos(2.2 * way), np.sin(2.2 * way), 0.0 * way], axis=1)
    out = centre / np.linalg.norm(centre, axis=1, keepdims=True)
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    ring = np.cos(turn)[:, None] * out[:, None] + np.sin(turn)[:, None] * [0.0, 0.0, 1.0]
    points = (centre[:, None] + radius[:, None, None] * ring).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    faces = np.stack([a, a + around, b, b, a + around, b + around], axis=-1).reshape(-1, 3)
    points = np.concatenate([points, centre[:1], centre[-1:]])
    ends = [[len(points) - 2, k, (k + 1) % around] for k in range(around)]
    last = around * (along - 1)
    ends += [[len(points) - 1, last + (k + 1) % around, last + k] for k in range(around)]
    return Mesh(points, np.concatenate([faces, ends]))


def twisted_tower(rows: int, columns: int) -> Mesh:
    """A tower on a square, which turns by 45 degrees up to its top: four walls with sharp edges."""
    share = np.linspace(0.0, 1.0, columns, endpoint=False)[:, None]
    corner = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    plan = np.concatenate([(1.0 - share) * corner[k - 1] + share * corner[k] for k in range(4)])
    height = np.linspace(0.0, 1.0, rows)
    x, y = (1.0 - 0.2 * height[:, None]) * plan.T[:, None]
    turn = 0.25 * np.pi * height[:, None]
    tower = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)])
    points = np.stack([*tower, np.broadcast_to(4.0 * height[:, None], x.shape)], axis=-1)
    ids = np.arange(x.size).reshape(x.shape)
    after = np.roll(ids, -1, axis=1)
    faces = np.stack([ids[:-1], after[:-1], after[1:], ids[1:]], axis=-1)
    return Mesh(points.reshape(-1, 3), faces.reshape(-1, 4))


@pytest.mark.parametrize("triangles", [False, True])
def test_walls_between_sharp_edges_are_one_strip_each(triangles):
    tower = twisted_tower(21, 6)
    if triangles:
        tower = Mesh(tower.vertices, tower.triangles)
    made = gso.strips(tower, max_deviation="1%")
    assert made.usable and made.details["strips"] == [1, 1, 1, 1]
    assert made.details["seam_gap"] == 0.0
    # A second measure: nothing of a strip is folded as sharply as the edges, by 90 degrees.
    assert np.degrees(made.ruled.rulings.angles).max() < 60.0


def test_walls_may_end_at_diagonals_of_quads():
    x, y = np.mgrid[-1.0:1.0:29j, -1.0:1.0:29j]
    height = 0.6 * (1.0 - np.maximum(abs(x), abs(y))) ** 1.4
    made = gso.strips(np.dstack([x, y, height]), max_deviation="1%")
    assert made.usable and made.details["strips"] == [1, 1, 1, 1]


def test_pieces_end_at_sharp_edges():
    found = gso.pieces(twisted_tower(21, 6), max_deviation="1%", max_strain="0.5%", workers=0)
    assert found.usable and len(found) == 4
    ends = found.unchanged.vertices[found.edges]
    plan, height = ends[..., :2], ends[..., 2] / 4.0
    away = np.linalg.norm(plan, axis=-1) / (1.0 - 0.2 * height)
    assert np.abs(away - 1.0).max() < 1e-9


def test_seams_follow_the_rim_of_a_nose():
    design = with_nose(61)
    found = gso.pieces(design, max_deviation="1.75%", workers=0, effort="draft")
    assert found.usable and len(found) <= 4
    points = found.unchanged.vertices[found.edges]
    share = np.linspace(0.0, 1.0, 9)[:, None, None]
    seam = (points[:, 0] * (1.0 - share) + points[:, 1] * share).reshape(-1, 3)[:, :2]
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    rim = np.stack([0.1 + 0.25 * np.cos(turn), 0.25 * np.sin(turn)], axis=1)
    away = np.linalg.norm(rim[:, None] - seam, axis=2).min(axis=1)
    # Within one edge of the mesh.
    assert away.max() < np.sqrt(2.0) / 30.0


def test_the_ends_of_a_rod_do_not_recede():
    design = rod(14, 76)
    allowed = 0.05 * design.diagonal
    found = gso.pieces(design, max_deviation=allowed, workers=0, effort="draft")
    assert metrics.largest_distance(design, found.design) <= allowed
    assert found.metrics["strain_max"] <= 1e-3
    assert not len(faults.crossings(found.design))
