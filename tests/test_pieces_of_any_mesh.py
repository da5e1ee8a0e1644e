"""Meshes as people bring them, cut into pieces: not manifold, one-sided, with many components."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import faults
from gso.cli import main
from gso.io import Unwelded
from gso.mesh import Cut, Mesh
from gso.seams import Edges, Pieces, inverted_at_seams
from gso.unfolding import manifold_mesh
from gso.verdict import Code


def rows(height: int, width: int) -> np.ndarray:
    """Triangles of a grid of vertices."""
    i, j = np.mgrid[: height - 1, : width - 1]
    k = (i * width + j).ravel()
    return np.concatenate(
        [
            np.stack([k, k + width, k + width + 1], axis=1),
            np.stack([k, k + width + 1, k + 1], axis=1),
        ]
    )


def dome(side: int, bend: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    points = np.stack([u, v, bend * (1 - u * u - v * v)], axis=-1)
    return points.reshape(-1, 3), rows(side, side)


def with_fin(side: int) -> tuple[np.ndarray, np.ndarray]:
    """A dome, and a fin that stands on its middle line: three faces at an edge."""
    points, faces = dome(side)
    line = np.arange(side) * side + side // 2
    levels, ids = [points], [line]
    for k in range(1, 4):
        levels.append(points[line] + [0.0, 0.0, 0.2 * k])
        ids.append(side * side + (k - 1) * side + np.arange(side))
    return np.concatenate(levels), np.concatenate([faces, np.stack(ids).ravel()[rows(4, side)]])


def ball_with_a_wall(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Two cones that meet at a wide angle, and a wall where they meet."""
    turn = np.arange(count) * 2 * np.pi / count
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    points = np.concatenate([ring, [[0, 0, 3.0], [0, 0, -3.0], [0, 0, 0.0]]])
    k, after = np.arange(count), np.roll(np.arange(count), -1)
    fans = [np.stack([k, after, np.full(count, count + c)], axis=1) for c in range(3)]
    return points, np.concatenate([fans[0], fans[1][:, ::-1], fans[2]])


def moebius(count: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    t, s = np.meshgrid(np.arange(count) * 2 * np.pi / count, np.linspace(-0.4, 0.4, width))
    t, s = t.T, s.T
    r = 1 + s * np.cos(t / 2)
    points = np.stack([r * np.cos(t), r * np.sin(t), s * np.sin(t / 2)], axis=-1).reshape(-1, 3)
    ids = np.arange(count * width).reshape(count, width)
    ids = np.concatenate([ids, ids[:1, ::-1]])
    return points, ids.ravel()[rows(count + 1, width)]


def components(mesh: Mesh) -> int:
    return len(set(mesh.components[mesh.used].tolist()))


class TestDivision:
    def test_any_triangles_become_manifold_and_stay_where_they_are(self):
        for seed in range(150):
            rng = np.random.default_rng(seed)
            count = int(rng.integers(4, 12))
            some = [rng.permutation(count)[:3] for _ in range(int(rng.integers(2, 30)))]
            faces = np.unique(np.sort(some, axis=1), axis=0)
            points = rng.normal(size=(count, 3))
            # The mesh refuses what is not manifold.
            mesh, vertex = manifold_mesh((points, faces), sheets=True)
            np.testing.assert_array_equal(np.sort(vertex[mesh.faces], axis=1), faces)
            np.testing.assert_array_equal(mesh.vertices, points[vertex])

    def test_quads_stay_whole(self):
        plates = [[0, 1, 2, 3], [0, 1, 4, 5], [0, 1, 6, 7]]
        points = [[0, 0, 0], [0, 0, 9], [5, 0, 9], [5, 0, 0]]
        points += [[0, 6, 9], [0, 6, 0], [-7, -1, 9], [-7, -1, 0]]
        mesh, vertex = manifold_mesh((np.array(points, float), plates), sheets=True)
        assert np.sort(vertex[mesh.faces], axis=1).tolist() == np.sort(plates, axis=1).tolist()
        # The plates that go on nearly straight stay joined.
        assert components(mesh) == 2

    def test_a_sheet_goes_on_below_a_fin(self):
        points, faces = with_fin(9)
        mesh, vertex = manifold_mesh((points, faces), sheets=True)
        assert components(mesh) == 2 and len(vertex) == len(points) + 9
        assert sorted(len(loop) for loop in mesh.boundary_loops) == [22, 32]
        assert "8 edges have more than two faces" in mesh.notes[0]

    def test_a_wall_inside_a_body_is_a_sheet_of_its_own(self):
        given = ball_with_a_wall(12)
        mesh, _ = manifold_mesh(given, sheets=True)
        assert components(mesh) == 2 and len(mesh.boundary_loops) == 1
        with pytest.raises(gso.MeshError, match="inside a body"):
            manifold_mesh(given)

    def test_a_moebius_strip_is_cut_open(self):
        mesh, vertex = manifold_mesh(moebius(40, 5), sheets=True)
        assert components(mesh) == 1 and len(mesh.boundary_loops) == 1
        assert mesh.euler_characteristic == 1
        assert "one-sided and was cut along" in mesh.notes[0]
        # Not much longer than the strip is wide.
        assert len(vertex) - 200 <= 12
        with pytest.raises(gso.MeshError, match="one-sided"):
            manifold_mesh(moebius(40, 5))

    def test_of_files_whose_faces_have_vertices_of_their_own(self, tmp_path):
        points, faces = with_fin(5)
        own = points[faces].reshape(-1, 3)
        text = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in own]
        text += [f"f {k + 1} {k + 2} {k + 3}" for k in range(0, len(own), 3)]
        path = tmp_path / "fin.obj"
        path.write_text("\n".join(text))
        for given in (
            Unwelded(str(path), 1e-9),
            Unwelded((own, np.arange(len(own)).reshape(-1, 3)), 0.0),
        ):
            mesh, _ = manifold_mesh(given, sheets=True)
            assert components(mesh) == 2
            assert any("weld" in note for note in mesh.notes)
            assert any("divided" in note for note in mesh.notes)


class TestPieces:
    def test_of_what_is_not_manifold_with_a_note(self):
        points, faces = with_fin(9)
        found = gso.pieces((points, faces), max_deviation="3%", workers=0)
        # The fin is not joined to the dome, and may pass through it by less than the distance.
        assert {reason.code for reason in found.reasons} <= {Code.CROSSES_ITSELF}
        assert "divided at 9 vertices" in found.notes[0]
        assert found.metrics["deviation_max"] <= 0.03 * found.given.diagonal

    def test_of_a_moebius_strip(self):
        found = gso.pieces(moebius(40, 5), max_deviation="3%", workers=0)
        assert found.usable, found.reasons
        assert "one-sided" in found.notes[0]

    def test_given_seams_are_cut_on_all_copies(self):
        points, faces = with_fin(5)
        line = np.arange(5) * 5 + 2
        given = np.stack([line[:-1], line[1:]], axis=1)
        for keep in ([Edges(given)], given.tolist()):
            found = gso.pieces((points, faces), keep=keep, max_strain=0.5)
            # On the dome the edges are a seam, on the fin they are the border.
            assert len(found) == 3
        with pytest.raises(gso.OptionError, match="keep: 0-24 is no edge"):
            gso.pieces((points, faces), keep=[[0, 24]])
        with pytest.raises(gso.OptionError, match="along: 0-24 is no edge"):
            gso.pieces((points, faces), along=[[0, 24]])

    def test_of_a_file_at_the_command_line(self, tmp_path):
        points, faces = with_fin(5)
        text = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in points]
        text += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        (tmp_path / "fin.obj").write_text("\n".join(text))
        asked = ["pieces", str(tmp_path / "fin.obj"), "-o", str(tmp_path / "cut")]
        done = CliRunner().invoke(main, [*asked, "--max-strain", "20%"])
        assert done.exit_code == 0, done.output
        assert "note: the surface was divided at 5 vertices" in done.output

    def test_tiny_components_stay_as_they_are_beside_others(self):
        points, faces = dome(9)
        tiny = np.array([[5.0, 0, 0], [5.1, 0, 0], [5.1, 0.1, 0], [5, 0.1, 0.05]])
        every = np.concatenate([points, points + np.array([0, 3, 0]), tiny])
        count = len(points)
        table = np.concatenate([faces, faces + count, np.array([[0, 1, 2], [0, 2, 3]]) + 2 * count])
        found = gso.pieces((every, table), max_deviation="4%", workers=0)
        assert found.usable, found.reasons
        assert found.metrics["deviation_max"] > 0
        last = found.result.mesh.vertices[found.result.design.vertices[:, 0] > 4]
        np.testing.assert_allclose(np.unique(last, axis=0), np.unique(tiny, axis=0), atol=1e-12)

    def test_pieces_that_pass_through_each_other_are_not_usable(self):
        points, faces = dome(7, 0.2)
        wall = np.array([0.5, 0.5, 0.2]) * points[:, [0, 2, 1]] + [0.1, 0.07, 0.1]
        both = np.concatenate([points, wall])
        for given in ({"max_deviation": "2%"}, {"max_strain": 0.3}):
            found = gso.pieces(
                (both, np.concatenate([faces, faces + len(points)])), workers=0, **given
            )
            assert [r.code for r in found.reasons if r.code is Code.CROSSES_ITSELF]


class TestErrors:
    """What cannot be used is named, with what to do."""

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ("nan", "coordinates of vertex 7 are not finite.*remove or replace"),
            ("twice", r"face 0 = .* is there 2 times; delete"),
            ("thin", r"face 32 = .* has no area .*delete it"),
            ("soup", "weld"),
            ("corner", "vertex 25 lies on the edge from vertex .* add it to that face"),
        ],
    )
    def test_of_a_mesh(self, change, words):
        points, faces = dome(5)
        if change == "nan":
            points[7] = np.nan
        elif change == "twice":
            faces = np.concatenate([faces, faces[:1]])
        elif change == "thin":
            points = np.concatenate([points, points[:1] + points[-1:], 2 * points[:1]])
            faces = np.concatenate([faces, [[0, 25, 26]]])
            points[25] = 1.5 * points[0]
        elif change == "soup":
            points, faces = points[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
        else:
            # One face has a vertex on its outer edge that another component shares at its corner.
            points = np.concatenate([points, 0.5 * (points[:1] + points[1:2]), [[-2, -2, 0]]])
            faces = np.concatenate([faces, [[25, 1, 26]]])
        with pytest.raises(gso.MeshError, match=words):
            gso.pieces((points, faces), max_deviation="2%", workers=0)


def test_stars_that_pass_through_themselves_are_found():
    """A star of triangles that winds around its vertex more than once, and one that does not."""
    for turns, crossed in ((1.0, False), (2.0, True)):
        angle = np.arange(12) * 2 * np.pi * turns / 12 + 0.05
        height = 0.4 * np.cos(angle / turns)
        rim = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
        mesh = Mesh(
            np.concatenate([rim, np.zeros((1, 3))]),
            [[12, k, (k + 1) % 12] for k in range(12)],
        )
        assert bool(len(faults.crossings_at_vertices(mesh))) is crossed
        assert not len(faults.crossings(mesh))


class TestTurnedAtSeams:
    def strips(self, x: np.ndarray):
        """A flat sheet in three strips, and the result in which its columns are at x."""
        across, along = np.meshgrid(np.arange(4.0), np.arange(7.0), indexing="ij")
        sheet = np.stack([across, along, 0 * across], axis=-1).reshape(-1, 3)
        design = Mesh(sheet, rows(4, 7))
        column = np.arange(7)
        seams = [np.stack([c + column[:-1], c + column[1:]], axis=1) for c in (7, 14)]
        pieces = gso.cut(design, np.concatenate(seams))
        after = sheet.copy()
        after[:, 0] = np.repeat(x, 7)
        after[:, 2] = 0.01 * sheet[:, 0]
        opened = pieces.opened
        moved = opened.mesh.replaced(after[opened.vertex])
        solved = Pieces(design.replaced(after), Cut(moved, opened.vertex, opened.seams))
        return pieces, gso.Result(
            "developable",
            "curvature",
            opened.mesh,
            moved,
            None,
            gso.Status.CONVERGED,
            pieces=solved,
        )

    def test_a_piece_between_two_others_on_its_back_is_found(self):
        pieces, result = self.strips(np.array([0.0, 1.7, 1.3, 3.0]))
        middle = pieces.of_face[
            np.abs(pieces.design.vertices[pieces.design.faces, 0] - 1.5).max(1) < 1
        ]
        found = inverted_at_seams(result)
        assert set(pieces.of_face[found].tolist()) == set(middle.tolist())
        assert len(found) == 12

    def test_pieces_that_meet_away_from_their_seam_pass_through_each_other(self):
        pieces, _ = self.strips(np.arange(4.0))
        points = pieces.design.vertices.copy()
        # The last strip turns back over the second one, and down through the first.
        points[:, 2] = np.repeat([0.0, 0.0, 1.0, -1.0], 7)
        points[:, 0] = np.repeat([0.0, 2.0, 2.0, 0.5], 7)
        points[14:, 1] += 0.05
        pairs = faults.crossings(pieces.design.replaced(points))
        sides = np.unique(np.sort(pieces.of_face[pairs], axis=1), axis=0)
        assert len(sides) == 1 and sides[0, 0] != sides[0, 1]

    def test_a_sharp_edge_between_pieces_is_none(self):
        _, result = self.strips(np.array([0.0, 1.0, 2.0, 3.0]))
        assert len(inverted_at_seams(result)) == 0
        # The thin rim of a shell: both sheets keep their sides.
        opened, design = result.pieces.opened, result.pieces.design
        x = np.abs(opened.mesh.vertices[:, 0] - 1.0)
        side = np.sign(opened.mesh.vertices[:, 0] - 1.0)
        rim = np.stack([x, opened.mesh.vertices[:, 1], 0.1 * side * x], axis=1)
        whole = design.vertices.copy()
        whole[opened.vertex] = rim
        sharp = replace(
            result,
            design=result.design.replaced(rim),
            mesh=result.mesh.replaced(rim),
            pieces=Pieces(design.replaced(whole), opened),
        )
        assert len(faults.folded(sharp.pieces.design)) == 12
        assert len(inverted_at_seams(sharp)) == 0
