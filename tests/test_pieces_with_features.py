"""Pieces of designs with noses, and of rods, whose ends recede."""

import numpy as np

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
