"""Cuts along edges, surfaces that close around themselves, and their flat patterns."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import Pattern, metrics
from gso import mesh as meshes
from gso.cli import main
from gso.mesh import Mesh, joining
from gso.result import Result
from gso.verdict import Code
from tests.conftest import codes, is_disk, saddle, shuffled
from tests.test_flatten import disk_mesh, with_hole


def tube(shape, around: int = 24, along: int = 9) -> Mesh:
    """A quad mesh closed in one direction: shape(angle, s), s from zero to one."""
    a, s = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.linspace(0, 1, along))
    points = np.stack(np.broadcast_arrays(*shape(a, s)), axis=-1).reshape(-1, 3)
    k = np.arange(around * (along - 1))
    on = k // around * around + (k + 1) % around
    return Mesh(points, np.stack([k, on, on + around, k + around], axis=1))


def ring(slope: float, height: float):
    return lambda a, s: ((1 + slope * s) * np.cos(a), (1 + slope * s) * np.sin(a), height * s)


def sleeve(a, s):
    """Half a torus."""
    return (3 + np.cos(a)) * np.cos(np.pi * s), (3 + np.cos(a)) * np.sin(np.pi * s), np.sin(a)


def windowed(mesh: Mesh, at: int = 100) -> Mesh:
    """Without the faces around one of them."""
    centre = np.stack([mesh.vertices[f].mean(axis=0) for f in mesh.faces])
    keep = np.linalg.norm(centre - centre[at], axis=1) > 0.3
    used, number = np.unique(mesh.faces[keep], return_inverse=True)
    return Mesh(mesh.vertices[used], number.reshape(-1, 4))


CYLINDER, CONE, WASHER = ring(0.0, 2.0), ring(1.0, 2.0), ring(1.0, 0.3)


class TestCut:
    def test_line_inside_opens_a_slit(self):
        mesh = Mesh.from_grid(saddle(7))
        done = meshes.cut(mesh, [[23, 24], [25, 24]])
        assert done.vertex.tolist() == [*range(49), 24]
        assert len(done.mesh.boundary_loops) == 2
        assert done.mesh.euler_characteristic == 0
        pairs = np.sort(done.vertex[done.seams], axis=-1)
        assert np.array_equal(pairs, [[[23, 24]] * 2, [[24, 25]] * 2])

    def test_three_lines_that_meet_make_three_vertices(self):
        mesh = disk_mesh()
        inner = ~mesh.half_edges.boundary_vertex
        middle = np.flatnonzero(inner & (mesh.half_edges.face_count == 3))[0]
        edges = mesh.edges[(mesh.edges == middle).any(axis=1)]
        done = meshes.cut(mesh, edges)
        assert len(edges) == 3
        assert (done.vertex == middle).sum() == 3
        assert len(done.seams) == 3

    def test_closed_surfaces_open_and_split(self):
        import trimesh

        ball = trimesh.creation.icosphere(2)
        mesh = Mesh(ball.vertices, ball.faces)
        he, up = mesh.half_edges, mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > 0.2
        across = up[he.face] & ~up[he.face[he.twin]]
        round_it = np.stack([he.origin, he.dest], axis=1)[across]
        halves = meshes.cut(mesh, round_it).mesh
        assert np.unique(halves.components[halves.used]).size == 2
        assert [len(loop) for loop in halves.boundary_loops] == [len(round_it)] * 2
        assert is_disk(meshes.cut(mesh, round_it[1:]).mesh)

    def test_faces_keep_their_order_and_seams_their_places(self):
        mesh = shuffled(tube(CONE))
        done = meshes.cut(mesh, joining(mesh, mesh.boundary_loops))
        assert np.array_equal(done.vertex[done.mesh.faces], mesh.faces)
        assert np.array_equal(done.mesh.vertices, mesh.vertices[done.vertex])
        assert np.array_equal(*done.vertex[done.seams].transpose(1, 0, 2))
        assert done.mesh.grid_shape is not None
        assert len(done.vertex) == len(mesh.vertices) + 9

    def test_edges_on_the_boundary_or_none_change_nothing(self):
        mesh = Mesh.from_grid(saddle(5))
        for edges in ([[0, 1], [1, 2]], np.empty((0, 2), int)):
            done = meshes.cut(mesh, edges)
            assert np.array_equal(done.mesh.faces, mesh.faces)
            assert not len(done.seams)

    @pytest.mark.parametrize("pair", [[0, 6], [0, 99], [-1, 0]])
    def test_what_is_no_edge_is_refused(self, pair):
        with pytest.raises(gso.MeshError, match="no edge of a face"):
            meshes.cut(Mesh.from_grid(saddle(5)), [pair])


class TestPattern:
    @pytest.mark.parametrize("shape", [CYLINDER, CONE, WASHER], ids=["cylinder", "cone", "washer"])
    @pytest.mark.parametrize("kind", ["quads", "odd", "triangles", "shuffled", "windowed"])
    def test_developable_tubes_lie_flat(self, shape, kind):
        mesh = tube(shape, 25 if kind == "odd" else 24)
        if kind == "triangles":
            mesh = Mesh(mesh.vertices, mesh.triangles)
        mesh = shuffled(mesh) if kind == "shuffled" else mesh
        mesh = windowed(mesh) if kind == "windowed" else mesh
        result = gso.tno.optimize(mesh, task="flatten")
        assert result.metrics["strain_max"] < 1e-6
        assert result.metrics["flipped_cells"] == 0
        assert result.flat is None
        assert result.usable
        pattern = result.pattern
        assert np.array_equal(pattern.vertex[pattern.faces], mesh.faces)
        # A seam is as long as the tube; a window needs none, unless it looks like the tube's end.
        assert len(pattern.seams) == (3 if shape is WASHER and kind == "windowed" else 8)
        assert any("cut open" in note for note in result.notes)

    def test_seams_are_as_long_on_both_sides(self):
        result = gso.tno.optimize(tube(CONE), task="flatten")
        there = result.pattern.flat[result.pattern.seams]
        length = np.linalg.norm(there[:, :, 1] - there[:, :, 0], axis=-1)
        assert np.allclose(length, np.hypot(1.0, 2.0) / 8)

    def test_sleeve_is_cut_along_its_shortest_line(self):
        mesh = tube(sleeve, along=25)
        result = gso.tno.optimize(mesh, task="flatten")
        seam = mesh.vertices[result.pattern.vertex[result.pattern.seams[:, 0].ravel()]]
        assert np.allclose(np.hypot(*seam[:, :2].T), 2.0)
        assert result.metrics["strain_p99"] < 0.3
        assert result.metrics["flipped_cells"] == 0

    def test_disks_with_holes_stay_whole(self):
        flat_ring = gso.tno.optimize(tube(ring(1.0, 0.0)), task="flatten")
        assert flat_ring.metrics["strain_max"] < 1e-6
        for result in (flat_ring, gso.tno.optimize(with_hole(disk_mesh()), task="flatten")):
            assert not result.pattern.is_cut
            assert result.flat is result.pattern.flat

    def test_no_cut_makes_the_pattern_overlap_itself(self):
        u = np.linspace(-1, 1, 9)
        saddle = Mesh.from_grid(np.dstack([*np.meshgrid(u, u), 0.6 * np.outer(u, u)]))
        kept = saddle.faces[np.setdiff1d(np.arange(64), [27, 28, 35, 36])]
        ids = np.unique(kept)
        mesh = Mesh(saddle.vertices[ids], np.searchsorted(ids, kept))
        result = gso.tno.optimize(mesh)  # a cut to the hole would close with an overlap
        assert Code.PATTERN_OVERLAPS not in codes(result.reasons)
        assert not result.pattern.is_cut

    def test_sphere_with_three_holes_is_cut_along_a_tree(self):
        import trimesh

        ball = trimesh.creation.icosphere(3)
        centre = ball.vertices[ball.faces].mean(axis=1)
        angle = 2 * np.pi * np.arange(3) / 3
        away = centre @ np.stack([np.cos(angle), np.sin(angle), 0 * angle])
        used, number = np.unique(ball.faces[(away < 0.9).all(axis=1)], return_inverse=True)
        mesh = Mesh(ball.vertices[used], number.reshape(-1, 3))
        result = gso.tno.optimize(mesh, task="flatten")
        assert is_disk(result.pattern.mesh)
        assert result.metrics["strain_mean"] < 0.15

    def test_each_component_on_its_own(self):
        one, other = tube(CYLINDER), Mesh.from_grid(saddle(9))
        n = len(one.vertices)
        mesh = Mesh(
            np.concatenate([one.vertices, other.vertices + 10]),
            np.concatenate([one.faces, other.faces + n]),
        )
        pattern = gso.tno.optimize(mesh, task="flatten").pattern
        assert len(pattern.vertex) == len(mesh.vertices) + 9
        strain = metrics.principal_strains(pattern.surface(mesh), pattern.flat).values
        assert np.isfinite(strain).all()

    def test_units_and_places_do_not_matter(self):
        mesh = tube(CONE)
        far = Mesh(1000.0 * mesh.vertices + 1e5, mesh.faces)
        here, there = (gso.tno.optimize(m, task="flatten").pattern for m in (mesh, far))
        assert np.array_equal(here.seams, there.seams)
        assert np.allclose(1000.0 * here.flat, there.flat, atol=1e-4)

    def test_conformal_and_isometry_have_one_too(self):
        mesh = shuffled(tube(CONE))
        conformal = gso.tno.optimize(mesh, task="conformal")
        assert conformal.metrics["angle_distortion_p99"] < 1e-6
        assert np.allclose(conformal.cell_scale, 1.0)
        joint = gso.tno.optimize(mesh, formulation="isometry")
        assert joint.metrics["strain_p99"] < 1e-6
        assert joint.flat is None
        assert len(joint.mesh.vertices) == len(mesh.vertices)

    def test_conformal_scales_belong_to_the_faces(self):
        mesh = shuffled(tube(sleeve, along=13))
        result = gso.tno.optimize(mesh, task="conformal")
        large, small = metrics.stretches(result.pattern.surface(mesh), result.pattern.flat)
        assert np.corrcoef(np.sqrt(large * small), result.cell_scale)[0, 1] > 0.99

    def test_isometry_of_a_tube_keeps_it_closed(self):
        mesh = tube(lambda a, s: ring(0.3 * np.sin(np.pi * s), 2.0)(a, s))
        result = gso.tno.optimize(mesh, formulation="isometry")
        assert result.metrics["loss_gc"] < result.metrics["loss_gc_before"]
        assert result.pattern.is_cut
        assert result.metrics["flipped_cells"] == 0

    def test_constraints_leave_it_whole(self):
        mesh = tube(CYLINDER)
        fixed = gso.Handle([0, 3], [[0.0, 0.0], [0.5, 0.0]])
        result = gso.tno.optimize(mesh, task="flatten", constraints=[fixed])
        assert not result.pattern.is_cut
        assert any("cut it open" in note for note in result.notes)


@pytest.fixture(scope="module")
def result():
    return gso.tno.optimize(tube(CONE), task="flatten")


class TestFiles:
    def test_everything_comes_back(self, result, tmp_path):
        result.save(tmp_path / "r.npz")
        again = Result.load(tmp_path / "r.npz")
        for name in ("flat", "faces", "vertex", "seams"):
            assert np.array_equal(getattr(again.pattern, name), getattr(result.pattern, name))
        assert again.metrics == result.metrics
        assert np.array_equal(again.mesh.vertices, result.mesh.vertices)

    def test_files_without_a_pattern_have_one(self, tmp_path):
        result = gso.tno.optimize(saddle(9), task="flatten")
        result.save(tmp_path / "r.npz")
        again = Result.load(tmp_path / "r.npz")
        assert np.array_equal(again.pattern.flat, result.flat)
        assert again.pattern.vertex.tolist() == list(range(81))

    def test_damaged_patterns_are_refused(self, result, tmp_path):
        result.save(tmp_path / "r.npz")
        with np.load(tmp_path / "r.npz") as file:
            arrays = dict(file)
        wrong = {"vertex": 0 * result.pattern.vertex, "flat": result.pattern.flat[:-1]}
        for name, value in wrong.items():
            np.savez(tmp_path / "bad.npz", **{**arrays, f"pattern_{name}": value})
            with pytest.raises(gso.MeshError, match="pattern"):
                Result.load(tmp_path / "bad.npz")

    def test_meshes_and_drawings_are_of_the_pattern(self, result, tmp_path):
        result.save(tmp_path / "p.obj")
        assert gso.load(tmp_path / "p.obj").grid_shape == (25, 9)
        result.save(tmp_path / "p.svg")
        assert "outline" in (tmp_path / "p.svg").read_text()
        gso.tno.optimize(saddle(9)).save(tmp_path / "d.svg")  # of any developable result
        assert "outline" in (tmp_path / "d.svg").read_text()

    def test_pictures(self, result, tmp_path):
        pytest.importorskip("matplotlib")
        from gso.plot import plot_result

        plot_result(result, tmp_path / "flatten.png")
        plot_result(gso.tno.optimize(tube(CONE), task="conformal"), tmp_path / "conformal.png")
        plot_result(gso.tno.optimize(tube(CONE), formulation="isometry"), tmp_path / "i.png")
        assert all(p.stat().st_size > 5000 for p in tmp_path.iterdir())
        assert len(list(tmp_path.iterdir())) == 3

    def test_command_line(self, tmp_path):
        gso.save(tube(CYLINDER), tmp_path / "tube.obj")
        for name in ("pattern.svg", "pattern.obj", "pattern.npz"):
            arguments = [str(tmp_path / "tube.obj"), "-o", str(tmp_path / name), "-q"]
            with pytest.raises(SystemExit) as end:
                main(["optimize", "--task", "flatten", *arguments])
            assert end.value.code == 0
        assert is_disk(gso.load(tmp_path / "pattern.obj"))


def test_turning_tells_ends_from_holes():
    mesh = tube(CYLINDER)
    assert np.allclose(metrics.turning(mesh), 0.0)
    flat = tube(ring(1.0, 0.0))
    assert np.allclose(sorted(metrics.turning(flat)), [-2 * np.pi, 2 * np.pi])


def test_pattern_of_a_whole_surface():
    mesh = Mesh.from_grid(saddle(5))
    pattern = Pattern.whole(mesh, mesh.vertices[:, :2])
    assert pattern.surface(mesh) is mesh
    assert not pattern.is_cut
