"""Seams along polylines and planes: inserted into triangles, along the rows of quads."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import metrics
from gso.cli import main
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


@pytest.mark.parametrize("triangles", [False, True])
def test_edges_and_faces_of_a_polyline_are_those_of_the_mesh(triangles):
    grid = gso.as_mesh(np.dstack([*np.mgrid[:9.0, :13.0], np.zeros((9, 13))]))
    mesh = Mesh(grid.vertices, grid.triangles) if triangles else grid
    line = Polyline([[0, 6.3, 0], [4, 5.8, 0], [8, 6.2, 0]])
    ends = line.edges(mesh)
    np.testing.assert_allclose(mesh.vertices[ends][..., 1], 6.0)
    assert sorted(mesh.vertices[ends][..., 0].mean(axis=1)) == [k + 0.5 for k in range(8)]
    corners = mesh.vertices[mesh.faces[line.faces(mesh)]]
    middle = corners.mean(axis=1)
    assert set(np.floor(middle[:, 0])) == set(range(8))
    assert set(np.floor(middle[:, 1])) == {5, 6}
    below = Polyline([[0.2, 0.4, 0], [2.8, 0.4, 0]]).faces(mesh)
    assert len(below) == (6 if triangles else 3)
    assert set(np.floor(mesh.vertices[mesh.faces[below]].mean(axis=1)[:, 1])) == {0}


def test_seams_follow_and_avoid_lines_in_space():
    mesh = ball(10)
    turn = np.linspace(-1.2, 1.2, 9)
    line = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    some = {"max_strain": 0.15, "darts": True}
    found = [
        gso.pieces(mesh, **some, along=along)
        for along in ([line], Polyline(line), line, Polyline(line).edges(mesh))
    ]
    for one in found[1:]:
        np.testing.assert_array_equal(one.edges, found[0].edges)
    away = gso.pieces(mesh, **some, avoid=[line])
    same = gso.pieces(mesh, **some, avoid=Polyline(line).faces(mesh))
    np.testing.assert_array_equal(away.edges, same.edges)

    def near(one):
        middle = one.design.vertices[one.edges].mean(axis=1)
        far = np.linalg.norm(middle[:, None] - line, axis=2).min(axis=1)
        return float(one.lengths[far < 0.2].sum())

    assert near(found[0]) > near(away)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"along": [[[0, 0, 1], [0, 0, 3]]]}, "along, line 1: point 1 of a polyline is 2"),
        (
            {"avoid": [Polyline([[0, 0, 1], [1, 0, 0]]), Polyline([[0, 0, 1], [0, 9, 0]])]},
            "avoid, line 2: point 1 of a polyline is 8",
        ),
        ({"along": [[[0, 0, 1], [0, 0.01, 1]]]}, "line 1: all points .* nearest to vertex"),
        ({"along": [[0.5, 1.5]]}, "along has pairs that are not whole numbers"),
        ({"along": "seam"}, "along is str; it must be edges as pairs of vertices, or polylines"),
        ({"avoid": [Slice([0, 0, 0], [0, 0, 1])]}, "avoid, line 1 is a Slice"),
        ({"avoid": [[0, 1, 2], [3, 4]]}, "avoid is list; it must be faces"),
        ({"avoid": [10**6]}, "avoid names face 1000000; the mesh has"),
        ({"avoid": [0.5]}, "avoid must be a list of faces"),
    ],
)
def test_wrong_lines_are_named(given, said):
    with pytest.raises(gso.OptionError, match=said):
        gso.pieces(ball(6), **given)


def test_the_command_reads_lines_of_obj_files(tmp_path):
    mesh = ball(8)
    gso.save(mesh, tmp_path / "ball.obj")
    gso.io.save_lines([[[0, 0, 1], [1, 0, 0], [0, 0, -1]]], tmp_path / "lines.obj")
    words = ["pieces", str(tmp_path / "ball.obj"), "-o", str(tmp_path / "out")]
    some = ["--max-strain", "20%", "--darts", "--along"]
    done = CliRunner().invoke(main, [*words, *some, str(tmp_path / "lines.obj")])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, [*words, "--avoid", str(tmp_path / "ball.obj")])
    assert done.exit_code == 1
    assert "--avoid: " in done.output and "has no polylines" in done.output
