"""Seams along polylines and planes: inserted into triangles, along the rows of quads."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Mesh, Nearest
from gso.seams import Edges, Path, Polyline, Slice
from tests.conftest import rotation, saddle, shuffled
from tests.test_seams import ball


def great_circle(count: int, tilt: float = 0.4) -> np.ndarray:
    turn = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    c, s = np.cos(tilt), np.sin(tilt)
    return ring @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_triangles_are_divided_along_slices(count):
    mesh = ball(8)
    ways = np.array([[1.0, 0.2, 0.1], [0.1, 1.0, 0.3], [0.9, -0.8, 1.0]])[:count]
    # All through a point of one triangle, which is divided again and again.
    point = mesh.vertices[mesh.faces[5]].T @ [0.3, 0.3, 0.4]
    parts = gso.cut(mesh, [Slice(point, way) for way in ways])
    finer = parts.design
    assert metrics.area(finer) == pytest.approx(metrics.area(mesh), rel=1e-12)
    assert finer.euler_characteristic == 2
    new = finer.vertices[len(mesh.vertices) :]
    assert len(new) >= 10 * count
    assert Nearest(mesh).distances(new).max() < 1e-12
    height = np.abs((new - point) @ (ways / np.linalg.norm(ways, axis=1, keepdims=True)).T)
    assert height.min(axis=1).max() < 1e-9


def test_a_polyline_goes_straight_through_triangles():
    mesh = ball(24)
    ids = [
        int(np.linalg.norm(mesh.vertices - p, axis=1).argmin()) for p in ([1, 0, 0], [0, 0.6, 0.8])
    ]
    ends = mesh.vertices[ids]
    cut = gso.cut(mesh, Polyline(ends))
    arc = np.arccos(np.clip(ends[0] @ ends[1], -1, 1))
    assert cut.lengths.sum() == pytest.approx(arc, rel=0.01)
    assert cut.lengths.sum() < 0.99 * gso.cut(mesh, Path(ids)).lengths.sum()
    assert Nearest(mesh).distances(cut.design.vertices).max() < 1e-12
    assert metrics.area(cut.design) == pytest.approx(metrics.area(mesh), rel=1e-12)


def test_a_closed_polyline_divides_a_sphere():
    mesh = ball(20)
    halves = gso.cut(mesh, Polyline(great_circle(5), closed=True))
    assert len(halves) == 2
    assert all(piece.is_disk for piece in halves)
    crossing = gso.cut(
        mesh, [Polyline(great_circle(5), closed=True), Polyline(great_circle(6, -1.0), closed=True)]
    )
    assert len(crossing) >= 4
    assert crossing.sewn().euler_characteristic == 2


def test_polylines_do_not_depend_on_pose_and_order():
    mesh, line = ball(16), great_circle(4)
    turn = rotation(2)
    here = gso.cut(mesh, Polyline(line, closed=True))
    moved = shuffled(mesh.replaced(50.0 * mesh.vertices @ turn.T))
    there = gso.cut(moved, Polyline(50.0 * line @ turn.T, closed=True))
    assert there.seam_length == pytest.approx(here.seam_length, rel=1e-6)


def test_polylines_follow_rows_of_quads():
    grid = np.dstack([*np.mgrid[:9.0, :13.0], np.zeros((9, 13))])
    halves = gso.cut(grid, Polyline([[0, 6.3, 0], [4, 5.8, 0], [8, 6.2, 0]]))
    assert len(halves) == 2
    np.testing.assert_allclose(halves.design.vertices[np.unique(halves.edges), 1], 6.0)


def test_slices_of_quads_follow_rows():
    grid = np.dstack([*np.mgrid[:9.0, :13.0], np.zeros((9, 13))])
    # A plane that is slightly oblique to the rows: one straight row is closest.
    halves = gso.cut(grid, Slice([4.0, 6.2, 0.0], [0.05, 1.0, 0.0]))
    assert len(halves) == 2
    assert np.ptp(halves.design.vertices[np.unique(halves.edges), 1]) <= 1.0
    assert halves.lengths.sum() <= 9.0 + 1e-9


def test_edges_are_followed_through_slices():
    mesh = ball(12)
    edge = mesh.edges[:1]
    middle = mesh.vertices[edge[0]].mean(axis=0)
    way = mesh.vertices[edge[0, 1]] - mesh.vertices[edge[0, 0]]
    both = gso.cut(mesh, [Slice(middle, way), Edges(edge)])
    parts = both.lengths[np.isin(both.edges, edge[0]).any(axis=1)]
    assert len(parts) >= 2
    assert parts[np.argsort(parts)][:2].sum() <= np.linalg.norm(way) + 1e-9


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([[0, 0, 0]], "two or more"),
        ([[0, 0], [1, 1]], r"\(k, 3\)"),
        ([[0, 0, 0], [np.nan, 0, 0]], "point 1"),
        ([[0, 0, 0], [0, 0, 9]], "point 1 of a polyline is"),
    ],
)
def test_bad_polylines_are_named(given, said):
    with pytest.raises(gso.OptionError, match=said):
        gso.cut(saddle(5), Polyline(given))


def test_a_polyline_stays_on_one_component():
    sheet = Mesh.from_grid(saddle(5))
    two = Mesh(
        np.concatenate([sheet.vertices, sheet.vertices + 3.0]),
        np.concatenate([sheet.faces, sheet.faces + 25]),
    )
    with pytest.raises(gso.MeshError, match="no seam"):
        gso.cut(two, Polyline(two.vertices[[0, 30]]))
