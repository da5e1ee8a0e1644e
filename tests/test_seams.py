"""Surfaces cut into pieces along seams of all kinds, and joined again."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Attributes, Labels, Mesh
from gso.seams import Creases, Edges, Path, Slice
from gso.seams import Labels as ByLabel
from tests.conftest import rotation, saddle, shuffled


def ball(count: int = 12) -> Mesh:
    """A sphere of radius one of triangles."""
    from scipy.spatial import ConvexHull

    k = np.arange(count * count) + 0.5
    z, turn = 1.0 - 2.0 * k / len(k), np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - z * z)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return Mesh(points, ConvexHull(points).simplices)


def cube() -> Mesh:
    """A cube of quads, two by two on each side."""
    corner = np.array([[x, y, z] for x in (0, 1, 2) for y in (0, 1, 2) for z in (0, 1, 2)], float)
    row = {tuple(p): k for k, p in enumerate(corner.tolist())}
    faces = []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        for level in (0.0, 2.0):
            for a in (0.0, 1.0):
                for b in (0.0, 1.0):
                    loop = []
                    for da, db in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0.0, 0.0, 0.0]
                        p[axis], p[one], p[two] = level, a + da, b + db
                        loop.append(row[tuple(p)])
                    faces.append(loop if level else loop[::-1])
    used, table = np.unique(faces, return_inverse=True)
    return Mesh(corner[used], table.reshape(-1, 4))


def test_a_sphere_is_sliced_into_halves():
    mesh = ball()
    halves = gso.cut(mesh, Slice([0.0, 0.0, 0.2], [0.0, 0.0, 3.0]))
    assert len(halves) == 2
    assert all(piece.is_disk for piece in halves)
    for piece in halves:
        rim = piece.mesh.boundary_loops[0]
        np.testing.assert_allclose(piece.mesh.vertices[rim, 2], 0.2, atol=1e-12)
    assert sum(metrics.area(p.mesh) for p in halves) == pytest.approx(metrics.area(mesh), 1e-12)
    assert halves.lengths.sum() == pytest.approx(2 * np.pi * np.sqrt(0.96), rel=0.02)
    assert halves.seams() == {(0, 1): pytest.approx(halves.lengths.sum())}


def test_several_slices_cut_each_other():
    mesh = ball()
    planes = [Slice([0.01, 0.02, 0.03], n) for n in np.eye(3)]
    pieces = gso.cut(mesh, planes)
    assert len(pieces) == 8
    assert all(piece.is_disk for piece in pieces)
    assert {k for pair in pieces.seams() for k in pair} == set(range(8))
    assert pieces.sewn().euler_characteristic == 2


def test_pieces_are_joined_again():
    pieces = gso.cut(saddle(9), Path([4, 76]))
    again = pieces.sewn([piece.mesh.vertices for piece in pieces])
    np.testing.assert_allclose(again.vertices, pieces.design.vertices, atol=1e-15)
    np.testing.assert_array_equal(again.faces, pieces.design.faces)
    lifted = [p.mesh.vertices + np.array([0.0, 0.0, k]) for k, p in enumerate(pieces)]
    on_seam = np.unique(pieces.edges)
    height = pieces.sewn(lifted).vertices[:, 2] - pieces.design.vertices[:, 2]
    np.testing.assert_allclose(height[on_seam], 0.5, atol=1e-12)
    with pytest.raises(gso.MeshError, match="the pieces need"):
        pieces.sewn(lifted[:1])


def test_a_path_that_ends_inside_is_a_dart():
    pieces = gso.cut(saddle(9), Path([4, 40]))
    (piece,) = pieces
    assert piece.is_disk
    assert (pieces.sides[:, 0] == pieces.sides[:, 1]).all()
    assert len(piece.mesh.vertices) == 81 + 4


def test_closed_paths_leave_rings():
    ring = Path([20, 24, 60, 56], closed=True)
    pieces = gso.cut(saddle(9), ring)
    assert sorted(piece.holes for piece in pieces) == [0, 1]
    assert [piece.is_disk for piece in pieces] == [False, True]
    assert [piece.name for piece in pieces] == ["A", "B"]


def test_creases_of_a_cube_are_its_edges():
    pieces = gso.cut(cube(), Creases(45.0))
    assert len(pieces) == 6
    assert pieces.lengths.sum() == pytest.approx(24.0)
    assert len(gso.cut(cube(), Creases(100.0))) == 1


def test_slices_of_quads_follow_edges():
    pieces = gso.cut(cube(), Slice([0, 0, 0.9], [0, 0, 1]))
    assert len(pieces) == 2
    assert all((p.mesh.faces >= 0).all() for p in pieces)
    heights = [np.ptp(p.mesh.vertices[:, 2]) for p in pieces]
    assert sorted(heights) == [1.0, 1.0]


def test_labels_divide_and_stay():
    mesh = Mesh.from_grid(saddle(5))
    names, of_face = ("left", "right", "left"), np.repeat([0, 1, 2], [4, 8, 4])
    mesh = Mesh(
        mesh.vertices, mesh.faces, attributes=Attributes(labels={"g": Labels(names, of_face)})
    )
    pieces = gso.cut(mesh, ByLabel("g"))
    assert [len(p.faces) for p in pieces] == [8, 4, 4]
    assert pieces[0].mesh.attributes.labels["g"].of_face.tolist() == [1] * 8
    with pytest.raises(gso.MeshError, match="no objects"):
        gso.cut(mesh, ByLabel("o"))


def test_pieces_do_not_depend_on_pose_and_numbering():
    mesh = ball()
    turn = rotation(3)
    plane = np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0])
    here = gso.cut(mesh, Slice(*plane))
    moved = shuffled(mesh.replaced(1000.0 * mesh.vertices @ turn.T))
    there = gso.cut(moved, Slice(1000.0 * turn @ plane[0], turn @ plane[1]))
    one, two = ([metrics.area(p.mesh) for p in pieces] for pieces in (here, there))
    np.testing.assert_allclose(np.array(two) / 1e6, one, rtol=1e-9)
    assert there.seam_length == pytest.approx(here.seam_length)


def test_an_uncut_surface_is_one_piece():
    pieces = gso.cut(saddle(5), [])
    assert len(pieces) == 1
    assert pieces.seam_length == 0.0
    assert repr(pieces) == "Pieces(1 pieces, 1 of them disks, seam 0)"


@pytest.mark.parametrize(
    ("seams", "error", "said"),
    [
        ([[0, 7]], gso.MeshError, "0-7 is no edge"),
        ([[0, 99]], gso.OptionError, "vertex 99"),
        (Edges([0, 1]), gso.OptionError, "pairs of vertices"),
        (Path([3]), gso.OptionError, "two or more"),
        (Slice([0, 0, 0], [0, 0, 0]), gso.OptionError, "normal not zero"),
        (Creases(0), gso.OptionError, "between 0 and 180"),
        (ByLabel("x"), gso.OptionError, "'x'"),
        ("front", gso.OptionError, "front"),
        ([Path([0, 1]), [0, 1]], gso.OptionError, "seams of gso.seams"),
    ],
)
def test_bad_seams_are_named(seams, error, said):
    with pytest.raises(error, match=said):
        gso.cut(saddle(5), seams)


def test_a_path_must_stay_on_one_component():
    two = np.concatenate([saddle(3).reshape(-1, 3), saddle(3).reshape(-1, 3) + 9.0])
    faces = Mesh.from_grid(saddle(3)).faces
    mesh = Mesh(two, np.concatenate([faces, faces + 9]))
    with pytest.raises(gso.MeshError, match="no path"):
        gso.cut(mesh, Path([0, 10]))
