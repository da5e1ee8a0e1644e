"""Pieces of fine triangle meshes within a distance: the search on a copy at its scale."""

import numpy as np
import pytest

import gso
from gso import metrics
from gso.hierarchy import thinned
from gso.mesh import Mesh, Nearest
from gso.seams import CoarseCopy, Creases, Regions, RemainingTime, Segmentation, Slice


def ball(side: int) -> Mesh:
    """Half an ellipsoid of triangles, with side^2 vertices."""
    x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    grid = Mesh.from_grid(np.dstack([x, y, 0.8 * np.sqrt(2.2 - x**2 - y**2)]))
    return Mesh(grid.vertices, grid.triangles)


def roof(side: int, angle: float = 0.0) -> Mesh:
    """Two planes that meet at a straight crease, turned by an angle."""
    x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    grid = Mesh.from_grid(np.dstack([x, y, -np.abs(x)]))
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    return Mesh(grid.vertices @ turn.T, grid.triangles)


class TestTheCopy:
    def test_its_size_depends_on_the_distance_and_not_on_the_file(self):
        copies = [CoarseCopy.of(ball(side), 0.05).mesh for side in (60, 120)]
        sizes = [len(copy.vertices) for copy in copies]
        assert abs(sizes[0] - sizes[1]) < 0.05 * sizes[1]
        assert len(CoarseCopy.of(ball(120), 0.1).mesh.vertices) < 0.6 * sizes[1]

    def test_it_lies_within_the_distance(self):
        mesh = ball(90)
        noise = np.random.default_rng(0).normal(0, 0.004, mesh.vertices.shape)
        rough = mesh.replaced(mesh.vertices + noise)
        copy = CoarseCopy.of(rough, 0.05)
        assert metrics.largest_distance(rough, copy.mesh) < 0.05
        # The noise is smoothed.
        bent = metrics.dihedral_angles(copy.smooth).mean()
        assert bent < 0.4 * metrics.dihedral_angles(rough).mean()

    def test_creases_stay_creases(self):
        copy = CoarseCopy.of(roof(61, 0.3), 0.05)
        on = copy.mesh.vertices[copy.lines].reshape(-1, 3)
        assert len(copy.lines) > 3
        np.testing.assert_allclose(on[:, 2], 0.0, atol=1e-5)

    def test_division_of_long_edges_keeps_the_shape(self):
        box = Mesh(
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0], [0.5, 0.5, 1]],
            [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        )
        fine = CoarseCopy.of(box, 0.1).base
        assert fine.edge_lengths.max() <= 0.2
        assert metrics.area(fine) == pytest.approx(metrics.area(box), rel=1e-12)
        assert Nearest(box).distances(fine.vertices).max() < 1e-12

    def test_lines_are_thinned_along_themselves(self):
        mesh = roof(41)
        lines = Creases(35.0).edges(mesh)
        assert len(lines) == 40
        thin = thinned(mesh.vertices, mesh.faces, 150, lines=lines)
        ends = mesh.vertices[thin.ids][thin.lines]
        assert 1 < len(thin.lines) < 40
        np.testing.assert_allclose(ends[..., 0], 0.0, atol=1e-12)
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
        assert length == pytest.approx(2.0)


def test_a_search_ends_where_its_pieces_are_not_fewer():
    mesh, said = ball(33), []
    with pytest.raises(gso.MeshError, match="not be fewer than 1"):
        gso.pieces(mesh, max_deviation="0.5%", fewer_than=1, workers=0, callback=said.append)
    assert not any("design's own" in text for text in said)
    with pytest.raises(gso.OptionError, match="fewer_than is 0"):
        gso.pieces(mesh, max_deviation="0.5%", fewer_than=0)


def seam_edges(mesh: Mesh, label: np.ndarray) -> np.ndarray:
    """The edges between faces of different regions."""
    he = mesh.half_edges
    k = he.interior
    k = k[label[he.face[k]] != label[he.face[he.twin[k]]]]
    return np.stack([he.origin[k], he.dest[k]], axis=1)


def seam_faces(mesh: Mesh, label: np.ndarray) -> np.ndarray:
    """The faces with a vertex on a seam."""
    on = np.zeros(len(mesh.vertices), bool)
    on[seam_edges(mesh, label)] = True
    return np.flatnonzero(on[mesh.faces].any(axis=1))


class TestRegions:
    def test_a_zigzag_becomes_straight_and_divides_triangles(self):
        x, y = np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 31), indexing="ij")
        grid = Mesh.from_grid(np.dstack([x, y, 0 * x]))
        mesh = Mesh(grid.vertices, grid.triangles)
        middle = mesh.vertices[mesh.faces].mean(axis=1)
        zigzag = 0.5 + 0.03 * np.sign(np.sin(40 * middle[:, 1]))
        regions = Regions(mesh, np.empty((0, 2), np.int64))
        label = regions.fair((middle[:, 0] > zigzag).astype(np.int64), 0.06)
        divided = regions.cut_between(regions.fields(label, 0.06))
        ends = divided.mesh.vertices[seam_edges(divided.mesh, divided.label)]
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
        assert length < 1.02
        assert np.abs(ends[..., 0] - 0.5).max() < 0.04
        assert metrics.area(divided.mesh) == pytest.approx(1.0)
        # The same division of other points.
        np.testing.assert_allclose(divided.moved(mesh.vertices), divided.mesh.vertices, atol=1e-12)

    def test_single_faces_go_to_their_neighbours(self):
        grid = Mesh.from_grid(np.dstack([*np.mgrid[:11.0, :11.0], np.zeros((11, 11))]))
        mesh = Mesh(grid.vertices, grid.triangles)
        half = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 5).astype(np.int64)
        inside = np.flatnonzero(np.bincount(seam_faces(mesh, half), minlength=len(half)) == 0)
        regions = Regions(mesh, np.empty((0, 2), np.int64))
        for face in inside:
            label = half.copy()
            label[face] = 1 - label[face]
            assert (regions.connected(label) == half).all()

    def test_boundaries_stay_on_creases(self):
        mesh = roof(31)
        middle = mesh.vertices[mesh.faces].mean(axis=1)
        label = (middle[:, 0] > 0).astype(np.int64)
        regions = Regions(mesh, Creases(35.0).edges(mesh))
        divided = regions.cut_between(regions.fields(regions.fair(label, 0.2), 0.2))
        ends = divided.mesh.vertices[seam_edges(divided.mesh, divided.label)]
        np.testing.assert_allclose(ends[..., 0], 0.0, atol=1e-12)
        assert len(divided.mesh.vertices) == len(mesh.vertices)


def skew_ball() -> Mesh:
    """A ball that is only symmetric from x to -x, with vertices that have no mirror images."""
    side = 33
    t = np.linspace(-1, 1, side)
    x, y = np.meshgrid(t + 0.15 * (1 - t * t), t, indexing="ij")
    x = x + 0.1 * (1 - x * x) * y
    height = (1 + 0.3 * y) * np.sqrt(2.2 - x**2 - y**2)
    grid = Mesh.from_grid(np.dstack([x, y, 0.8 * height]))
    return Mesh(grid.vertices, grid.triangles)


def searched(**options) -> Segmentation:
    """Pieces of the ball, at a first look."""
    return gso.pieces(ball(32), max_deviation=0.05, effort="draft", workers=0, **options)


@pytest.fixture(scope="module")
def told() -> tuple[Segmentation, list[str]]:
    """Pieces of which nothing else is asked, and what the search for them said."""
    said: list[str] = []
    return searched(callback=said.append), said


@pytest.fixture(scope="module")
def free(told) -> Segmentation:
    """Pieces of which nothing else is asked."""
    return told[0]


class TestNoise:
    def test_it_is_not_cut(self):
        smooth = ball(36)
        noise = np.random.default_rng(0).normal(0, 0.004, smooth.vertices.shape)
        rough = smooth.replaced(smooth.vertices + noise)
        allowed = {"max_strain": 0.02, "workers": 0}
        cut = gso.pieces(rough, **allowed)
        assert any("noisy" in note for note in cut.notes)
        found = gso.pieces(rough, denoise="auto", **allowed)
        assert len(found) <= 0.5 * len(cut)
        assert found.seam_length < 0.7 * cut.seam_length
        assert any("was denoised" in note for note in found.notes)
        # No farther than the noise.
        away = np.linalg.norm(found.given.vertices - rough.vertices, axis=1)
        assert 0.001 < away.mean() < away.max() < 6 * 0.004

    def test_smooth_designs_stay(self):
        found = gso.pieces(ball(20), max_strain=0.05, denoise="auto")
        assert not any("denoised" in note for note in found.notes)
        np.testing.assert_array_equal(found.given.vertices, ball(20).vertices)

    def test_another_word_is_an_error(self):
        with pytest.raises(gso.OptionError, match="denoise is 'yes'"):
            gso.pieces(ball(8), denoise="yes")


class TestTheRemainingTime:
    def test_it_is_known_from_the_second_solve_on(self):
        said, now = [], iter([0.0, 2.0, 5.0, 9.0])
        remaining = RemainingTime(said.append, lambda: next(now))
        for name, possible in (("one", 4), ("two", 2), ("three", 0)):
            remaining.of_copy(name, possible)
        remaining.of_design("four", 0)
        left = [int(text.split(", about ")[1].removesuffix(" s left")) for text in said[1:]]
        assert said[0] == "one" and left == sorted(left, reverse=True)
        # Of three solves, at three seconds each; the design's own pieces take longer than one.
        assert 3.0 < left[-1] <= 5 * 3.0

    def test_it_grows_with_what_may_follow_and_with_the_time_of_a_solve(self):
        def left(seconds, possible):
            said, now = [], iter([0.0, seconds])
            remaining = RemainingTime(said.append, lambda: next(now))
            remaining.of_copy("one", 0)
            remaining.of_copy("two", possible)
            return int(said[1].split("about ")[1].split(" ")[0])

        assert left(20.0, 0) < left(20.0, 4) < left(20.0, 40)
        assert left(80.0, 4) == pytest.approx(4 * left(20.0, 4), rel=0.1)

    def test_a_search_says_it(self, told):
        _, said = told
        left = [int(x.split("about ")[1].split(" ")[0]) for x in said if "s left" in x]
        assert left and min(left) >= 0
        assert "s left" not in next(x for x in said if "way 1" in x)


class TestTheSearch:
    def test_pieces_hold_the_distance_and_use_it(self):
        mesh = ball(36)
        allowed = 0.06
        found = gso.pieces(mesh, max_deviation=allowed, effort="draft", workers=0)
        assert found.usable, found.reasons
        assert len(found) <= 5
        assert 0.7 * allowed <= found.metrics["deviation_max"] <= allowed
        assert found.metrics["strain_max"] <= 1e-3
        assert found.metrics["neck_share"] > 0.1
        assert found.metrics["seam_turn"] < 8.0
        # By another route: middles of faces against the design, and of the design's against them.
        for one, two in ((found.result.pieces.design, mesh), (mesh, found.result.pieces.design)):
            middles = one.vertices[one.faces].mean(axis=1)
            assert Nearest(two).distances(middles).max() <= 1.001 * allowed
        for piece in found:
            assert piece.is_disk

    def test_budgets_change_the_result_or_are_named(self, free):
        few = searched(max_pieces=1)
        assert len(few) <= len(free)
        assert [reason.code for reason in few.reasons] in ([], ["pieces"])
        # No piece of it is as long as the whole.
        long = searched(min_size=5.0)
        assert not long.usable
        assert {reason.code for reason in long.reasons} == {"too_short"}

    def test_necks_become_wider(self, free):
        least = 1.2 * free.metrics["neck"]
        wide = searched(min_neck=least)
        assert wide.metrics["neck"] >= least or "neck" in {r.code for r in wide.reasons}

    def test_kept_seams_stay_and_others_join_them(self):
        found = searched(keep=Slice([0.3, 0, 0], [1, 0.2, 0]))
        assert found.usable, found.reasons
        height = (found.design.vertices - [0.3, 0, 0]) @ [1, 0.2, 0]
        given = found.given.vertices
        on = np.abs((given - [0.3, 0, 0]) @ [1, 0.2, 0]) < 1e-9
        assert on.sum() > 25
        seam = np.zeros(len(height), bool)
        seam[found.edges] = True
        rim = found.design.half_edges.boundary_vertex
        assert (seam | rim)[: len(given)][on].all()

    def test_seams_keep_away_from_faces(self, free):
        middle = ball(32).vertices[ball(32).faces].mean(axis=1)
        found = searched(avoid=np.hypot(middle[:, 0], middle[:, 1]) < 0.35)
        assert found.usable, found.reasons
        ends = found.design.vertices[found.edges].mean(axis=1)
        inside = np.hypot(ends[:, 0], ends[:, 1]) < 0.3
        assert found.lengths[inside].sum() < 0.02 * found.lengths.sum()

    def test_symmetric_seams_need_no_symmetric_mesh(self):
        found = gso.pieces(
            skew_ball(), max_deviation=0.06, symmetric=True, effort="draft", workers=0
        )
        assert found.usable, found.reasons
        points = found.design.vertices[found.edges].mean(axis=1)
        mirrored = points * [-1.0, 1.0, 1.0]
        away = np.linalg.norm(points[:, None] - mirrored[None], axis=2).min(axis=1)
        assert away.max() < 0.02 * found.design.diagonal

    def test_what_is_not_symmetric_is_refused(self):
        bent = ball(36)
        points = bent.vertices + np.stack(
            [0 * bent.vertices[:, 0]] * 2
            + [0.6 * np.sin(2.0 * bent.vertices[:, 0] + bent.vertices[:, 1] ** 3)],
            axis=1,
        )
        with pytest.raises(gso.OptionError, match="no plane of symmetry"):
            gso.pieces(bent.replaced(points), max_deviation=0.06, symmetric=True, workers=0)

    @pytest.mark.parametrize("allowed", [1e-200, 3.0, 1e80])
    def test_any_distance_has_a_copy(self, allowed):
        copy = CoarseCopy.of(ball(30), allowed)
        assert 100 < len(copy.mesh.vertices) <= 2 * 30**2

    def test_an_unknown_effort_is_named(self):
        with pytest.raises(gso.OptionError, match="no effort 'quick'"):
            gso.pieces(ball(8), max_deviation=0.1, effort="quick")
