"""Faces that share no vertices: noticed, refused by the solver, merged on request."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import Mesh, MeshError, OptionError
from gso.mesh import collapse, equal, near, topology
from tests.conftest import meshes, saddle


def heap(mesh, jitter=0.0, seed=0):
    """Vertices and faces with nothing shared."""
    real = mesh.faces >= 0
    points = mesh.vertices[mesh.faces[real]]
    points = points + jitter * np.random.default_rng(seed).uniform(-1, 1, points.shape)
    faces = np.full(mesh.faces.shape, -1)
    faces[real] = np.arange(len(points))
    return points, faces


def corner_sets(mesh):
    """Faces by their corners' coordinates, whatever their numbering."""
    return sorted(sorted(mesh.vertices[f[f >= 0]].round(9).tolist()) for f in mesh.faces)


@pytest.mark.parametrize("kind", meshes())
@pytest.mark.parametrize("jitter", [0.0, 1e-7])
def test_a_heap_of_faces_is_welded_to_the_mesh_it_was(kind, jitter):
    mesh = meshes()[kind]
    joined = gso.as_mesh(heap(mesh, jitter), weld=4 * jitter)
    assert len(joined.vertices) == mesh.used.sum()
    assert joined.faces.shape == mesh.faces.shape
    assert joined.grid_shape == mesh.grid_shape
    assert len(joined.boundary_loops) == len(mesh.boundary_loops)
    assert not joined.seams.any()
    if not jitter:
        assert corner_sets(joined) == corner_sets(mesh)
    assert joined.notes[0].startswith(f"weld={4 * jitter:.3g} merged")


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off", ".npz"])
def test_files_of_heaps(suffix, tmp_path):
    apart = Mesh(*heap(Mesh.from_grid(saddle(5))))
    gso.save(apart, tmp_path / f"a{suffix}")
    assert gso.load(tmp_path / f"a{suffix}", weld=0).grid_shape == (5, 5)
    found = gso.load(tmp_path / f"a{suffix}")
    assert "48 edges lie on others" in found.notes[0]
    assert "weld=" in found.notes[0] and "--weld" in found.notes[0]


def test_heaps_are_refused_by_all_solvers():
    apart = Mesh(*heap(Mesh.from_grid(saddle(5, strength=0.1))))
    for solve in (gso.tno.optimize, gso.hybrid.solve, gso.tno.Session):
        with pytest.raises(MeshError, match=r"16 faces are 16 separate pieces.*weld=\S+ of gso"):
            solve(apart)
    assert gso.tno.optimize(gso.as_mesh(apart, weld=0)).usable


def test_pieces_that_do_not_touch_are_no_heap():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    apart = Mesh(
        np.concatenate([square + np.array([2 * k, 0, 0]) for k in range(5)]),
        np.arange(20).reshape(5, 4),
    )
    assert not apart.seams.any()
    apart.check_joined()


def test_two_panels_side_by_side_are_noticed_and_allowed():
    panel = Mesh.from_grid(saddle(6))
    shift = [0, 2, 0]
    points = np.r_[panel.vertices, panel.vertices * [1, -1, 1] + shift]
    both = Mesh(points, np.r_[panel.faces, topology.reverse(panel.faces) + 36])
    assert int(both.seams.sum()) == 10
    both.check_joined()
    assert gso.as_mesh(both, weld=1e-9).grid_shape in ((6, 11), (11, 6))


def test_faces_that_collapse_are_left_out_with_a_note():
    points = saddle(5).reshape(-1, 3).copy()
    points[7] = points[6] + 1e-6
    mesh = Mesh(points, topology.grid_faces(5, 5))
    done = gso.as_mesh(mesh, weld=1e-5)
    assert len(done.vertices) == 24 and len(done.faces) == 16
    assert (done.faces[:, 3] < 0).sum() == 2
    assert "2 quads lost an edge by that and are triangles now" in done.notes
    points[11], points[12] = points[6], points[7]
    done = gso.as_mesh((points, mesh.faces), weld=1e-5)
    assert any("1 faces collapsed and were left out" in note for note in done.notes)
    assert len(done.faces) == 15


def test_chains_are_refused():
    grid = Mesh.from_grid(saddle(9))
    for weld in (0.3, 0.6, 1e3):
        with pytest.raises(MeshError, match=r"weld=\S+ (would merge|leaves no face).* length"):
            gso.as_mesh(grid, weld=weld)
    line = np.zeros((30, 3))
    line[:, 0] = np.arange(30)
    with pytest.raises(MeshError, match="a chain of 30 vertices that is 29 wide"):
        near(line, 1.0)


@pytest.mark.parametrize("weld", [-1, np.nan, np.inf, "a", True])
def test_tolerances_that_are_none(weld):
    with pytest.raises(OptionError, match="weld is"):
        gso.as_mesh(saddle(5), weld=weld)


def test_a_closed_strip_is_welded_to_a_tube():
    angle = np.linspace(0, 2 * np.pi, 13)
    tube = np.stack(np.broadcast_arrays(np.cos(angle), np.sin(angle), np.arange(4.0)[:, None]), -1)
    assert len(Mesh.from_grid(tube).boundary_loops) == 1
    assert len(gso.as_mesh(tube, weld=1e-9).boundary_loops) == 2


def test_broken_input_says_what_is_wrong_with_it_welded_or_not():
    for faces in ([[0, 1, 99]], [[0, 1, 2.5]], [], "abc"):
        with pytest.raises(MeshError):
            gso.as_mesh((np.eye(3), faces), weld=0.1)
    with pytest.raises(MeshError, match="vertex 1 are not finite"):
        gso.as_mesh(([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]]), weld=0.1)
    with pytest.raises(MeshError, match="leaves no face"):
        gso.as_mesh((np.eye(3), [[0, 1, 2]]), weld=2.0)


@pytest.mark.parametrize("unit", [1e-90, 1e90])
def test_welding_in_any_unit(unit):
    points, faces = heap(Mesh.from_grid(saddle(5)), 1e-7)
    assert gso.as_mesh((unit * points, faces), weld=4e-7 * unit).grid_shape == (5, 5)
    with pytest.raises(MeshError, match="weld="):
        gso.as_mesh((unit * points, faces), weld=1e300)
    with pytest.raises(MeshError, match="unit of length"):
        gso.as_mesh((1e200 * points, faces), weld=1.0)


def test_unused_vertices_merge_with_nothing():
    mesh = Mesh(
        np.r_[saddle(3).reshape(-1, 3), saddle(3).reshape(-1, 3)], topology.grid_faces(3, 3)
    )
    done = gso.as_mesh(mesh, weld=0.1)
    assert len(done.vertices) == 18
    assert any("merged nothing" in note for note in done.notes)


def test_equal_points_by_their_first():
    rng = np.random.default_rng(0)
    points = rng.integers(0, 3, (200, 3)).astype(float)
    first = equal(points)
    for k in range(200):
        assert first[k] == np.flatnonzero((points == points[k]).all(axis=1))[0]


def test_collapse_of_every_pattern_of_a_quad():
    for code in range(4**4):
        target = np.array([code // 4**k % 4 for k in range(4)])
        done = collapse(np.array([[0, 1, 2, 3]]), target)
        ring = [t for k, t in enumerate(target) if t != target[(k + 1) % 4]]
        sound = len(set(target)) == len(ring) >= 3
        assert len(done.faces) == sound, target
        if sound:
            corners = done.faces[0][done.faces[0] >= 0].tolist()
            turns = [ring[k:] + ring[:k] for k in range(len(ring))]
            assert corners in turns
            assert (target[done.turns[0][done.turns[0] >= 0]] == corners).all()
