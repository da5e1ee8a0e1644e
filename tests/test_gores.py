"""Bodies of revolution: their axis and profile, and gores that are all alike."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gso
from gso import OptionError, metrics
from gso.mesh import Mesh
from gso.seams import Gores, Revolution, Segmentation
from gso.verdict import Code
from tests.conftest import codes


def turned(profile: np.ndarray, count: int, quads: bool = False) -> Mesh:
    """A profile (p, 2) of radius and height turned about z; one point for each end on the axis."""
    turn = 2 * np.pi * np.arange(count) / count
    x, z = profile.T
    points = np.stack([np.outer(x, np.cos(turn)), np.outer(x, np.sin(turn))], axis=-1)
    points = np.concatenate([points, np.broadcast_to(z[:, None, None], (*points.shape[:2], 1))], 2)
    ids = np.arange(points[..., 0].size).reshape(points.shape[:2])
    if np.array_equal(profile[0], profile[-1]):
        ids[-1] = ids[0]
    ids[x == 0.0] = ids[x == 0.0][:, :1]
    near = np.roll(ids, -1, axis=1)
    faces = np.stack([ids[:-1], near[:-1], near[1:], ids[1:]], axis=-1).reshape(-1, 4)
    used, faces = np.unique(faces, return_inverse=True)
    mesh = points.reshape(-1, 3)[used], faces.reshape(-1, 4)
    if quads:
        return Mesh(*mesh)
    halves = np.concatenate([mesh[1][:, [0, 1, 2]], mesh[1][:, [0, 2, 3]]])
    apart = (halves != np.roll(halves, 1, axis=1)).all(axis=1)
    return Mesh(mesh[0], halves[apart])


def ball(count: int, low: float = -np.pi / 2, high: float = np.pi / 2, **how: bool) -> Mesh:
    """A sphere of radius 1 between two latitudes."""
    angle = np.linspace(low, high, count // 2 + 1)
    profile = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    profile[np.abs(profile) < 1e-12] = 0.0
    return turned(profile, count, **how)


def vase() -> Mesh:
    z = np.linspace(0, 3, 40)
    return turned(np.stack([0.7 + 0.25 * np.sin(2.2 * z), z], axis=1), 60)


def ring() -> Mesh:
    angle = np.linspace(0, 2 * np.pi, 41)
    profile = np.stack([1.0 + 0.35 * np.cos(angle), 0.35 * np.sin(angle)], axis=1)
    profile[-1] = profile[0]
    return turned(profile, 80)


def gores(mesh: Mesh, distance: float | str, **more: object) -> Segmentation:
    return gso.pieces(mesh, max_deviation=distance, symmetric=True, workers=0, **more)


@pytest.fixture(scope="module")
def lamp() -> Mesh:
    """A globe of quads with an opening at each end."""
    return ball(48, -1.2, 1.35, quads=True)


@pytest.fixture(scope="module")
def found(lamp) -> Segmentation:
    return gores(lamp, 0.05)


def moved(mesh: Mesh, seed: int) -> Mesh:
    """A mesh renumbered, turned, moved and scaled by 40."""
    rng = np.random.default_rng(seed)
    order, turn = rng.permutation(len(mesh.vertices)), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    place = np.argsort(order)
    faces = np.where(mesh.faces < 0, -1, place[mesh.faces])[rng.permutation(len(mesh.faces))]
    return Mesh(40.0 * mesh.vertices[order] @ turn.T + [3.0, -20.0, 7.0], faces)


class TestTheBody:
    @pytest.mark.parametrize(("mesh", "poles", "closed"), [(vase(), 0, False), (ring(), 0, True)])
    def test_axis_and_profile_are_found(self, mesh, poles, closed):
        body = Revolution.of(moved(mesh, 1), 0.02 * 40)
        assert body.poles == poles and body.is_closed == closed
        there = (body.profile[:, 0] / 40).max()
        assert there == pytest.approx(np.hypot(*mesh.vertices[:, :2].T).max(), rel=3e-3)

    def test_a_ball_has_two_poles(self):
        body = Revolution.of(ball(48), 0.03)
        assert body.poles == 2 and body.reach == pytest.approx(1.0, rel=0.01)

    def test_other_surfaces_are_none(self):
        egg = ball(40)
        flat = egg.replaced(egg.vertices * [1.0, 0.9, 1.1])
        whole = ring()
        half = Mesh(whole.vertices, whole.faces[whole.vertices[whole.faces].mean(axis=1)[:, 1] > 0])
        box = Mesh(
            np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float),
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
        )
        y, x = np.mgrid[-1:1:20j, -1:1:20j]
        saddle = Mesh.from_grid(np.dstack([x, y, 0.5 * x * y]))
        two = Mesh(
            np.concatenate([egg.vertices, egg.vertices + 5.0]),
            np.concatenate([egg.faces, egg.faces + len(egg.vertices)]),
        )
        for mesh in (flat, half, box, saddle, two):
            assert Revolution.of(mesh, 0.02) is None

    def test_noise_within_the_distance_does_not_matter(self):
        mesh = vase()
        noise = np.random.default_rng(0).normal(0, 0.004, mesh.vertices.shape)
        body = Revolution.of(mesh.replaced(mesh.vertices + noise), 0.04)
        assert abs(body.axis[2]) == pytest.approx(1.0, abs=1e-4)
        wave = 0.7 + 0.25 * np.sin(2.2 * (body.profile[:, 1] + body.origin[2]))
        assert np.abs(body.profile[:, 0] - wave).max() < 0.005


class TestTheGores:
    @pytest.mark.parametrize("distance", [0.1, 0.04, 0.012])
    def test_a_ball_takes_as_many_as_the_formula_says(self, distance):
        # Half as far inside as outside: R tan(pi / 2 k)^2.
        least = int(np.ceil(np.pi / (2 * np.arctan(np.sqrt(distance)))))
        out = gores(ball(60), distance)
        assert out.usable and len(out) in (least, least + 1)
        assert any("both poles" in note for note in out.notes)

    def test_they_are_alike_and_exact(self, found):
        assert found.usable and len(found.alike()) == 1
        assert found.metrics["strain_max"] < 1e-12
        assert any(f"{len(found)} gores, all alike" in note for note in found.notes)
        first = found.sheets[0]
        for sheet in found.sheets:
            assert metrics.area(sheet.mesh) == pytest.approx(metrics.area(first.mesh), rel=1e-12)
            assert sheet.size == pytest.approx(first.size, rel=1e-9)
            # Symmetric about the axis of the strip.
            own = np.sort(np.round(sheet.flat, 9).view(complex).ravel())
            other = np.sort(np.round(sheet.flat * [1, -1] + 0.0, 9).view(complex).ravel())
            np.testing.assert_allclose(own, other, atol=1e-8)
        assert float(np.nanmax(metrics.nonplanarity(found.design))) < 1e-12

    def test_seams_are_closed_and_in_meridian_planes(self, found):
        assert len(found.design.boundary_loops) == 2
        assert found.design.euler_characteristic == 0
        line = found.design.vertices[found.edges]
        turn = np.arctan2(line[..., 1], line[..., 0])
        step = np.pi / len(found) * 2
        off = (turn - turn.ravel()[0]) / step
        np.testing.assert_allclose(off, np.round(off), atol=1e-6)

    def test_random_points_are_within_the_distance(self, found, lamp):
        rng = np.random.default_rng(2)
        for one, two in ((found.design, lamp), (lamp, found.design)):
            share = rng.dirichlet(np.ones(3), 4000)
            face = rng.integers(len(one.triangles), size=4000)
            points = np.einsum("nk,nkd->nd", share, one.vertices[one.triangles[face]])
            far = metrics.point_to_surface(points, two).max()
            assert 0.5 * 0.05 < far <= 0.05

    def test_one_fewer_would_be_too_far(self, found, lamp):
        body = Revolution.of(lamp, 0.05)
        fewer = Gores(body, len(found) - 1).mesh
        assert metrics.largest_distance(lamp, fewer) > 0.05
        same = Gores(body, len(found)).mesh
        assert metrics.largest_distance(lamp, same) == pytest.approx(
            found.metrics["deviation_max"], rel=1e-6
        )

    def test_numbers_places_and_units_do_not_matter(self, found, lamp):
        other = gores(moved(lamp, 5), 40 * 0.05)
        assert len(other) == len(found) and other.usable
        assert other.metrics["seam"] == pytest.approx(found.metrics["seam"], rel=1e-2)

    def test_a_ring_is_opened(self):
        out = gores(ring(), 0.04)
        assert out.usable and len(out.alike()) == 1 and all(piece.is_disk for piece in out)
        assert out.metrics["strain_max"] < 1e-12

    def test_noise_takes_more(self, lamp):
        noise = np.random.default_rng(1).normal(0, 0.003, lamp.vertices.shape)
        out = gores(lamp.replaced(lamp.vertices + noise), 0.05)
        assert out.usable and len(out.alike()) == 1

    def test_budgets_are_reasons_and_sheets_take_more(self, found, lamp):
        few = gores(lamp, 0.05, max_pieces=len(found) - 1, min_size=9.0)
        assert set(codes(few.reasons)) == {Code.PIECES, Code.TOO_SHORT}
        wide = max(min(sheet.size) for sheet in found.sheets)
        narrow = gores(lamp, 0.05, sheet=(5.0, 0.7 * wide))
        assert narrow.usable and len(narrow) > len(found)

    def test_normals_are_those_of_the_design(self, found, lamp):
        inner = gores(Mesh(lamp.vertices, lamp.faces[:, ::-1]), 0.05)
        for out, sign in ((found, 1.0), (inner, -1.0)):
            middle = out.design.vertices[out.design.faces].mean(axis=1)
            assert (sign * (metrics.face_normals(out.design) * middle).sum(axis=1) > 0).all()
            assert all(not len(sheet.inverted) for sheet in out.sheets)
            assert (out.folded.angles > 0).all() == (sign > 0)


class TestTheWorkshop:
    @pytest.mark.parametrize("formulation", ["ruled", "curvature"])
    def test_gores_are_counted_once(self, lamp, found, formulation, tmp_path):
        job = gso.fabricate(
            lamp,
            tmp_path,
            unit="m",
            max_deviation=0.05,
            symmetric=True,
            formulation=formulation,
            formats=("svg",),
            workers=0,
        )
        assert [part.count for part in job.parts] == [len(found)] and not job.certificate["reasons"]
        assert {notch.text for notch in job.parts[0].notches} == {"1"}
        assert (
            len(job.parts[0].bends) >= len(found.sheets[0].folded.lines(found.sheets[0].flat)) / 2
        )

    def test_rings_have_a_second_kind_of_seam(self, tmp_path):
        job = gso.fabricate(
            ring(),
            tmp_path,
            unit="m",
            max_deviation=0.06,
            symmetric=True,
            formats=("svg",),
            workers=0,
        )
        assert len(job.parts) == 1 and job.parts[0].count > 4
        assert len({notch.text for notch in job.parts[0].notches}) == 2

    def test_files_say_which_pieces_are_alike(self, found, tmp_path):
        names = found.save(tmp_path)
        said = json.loads((tmp_path / "pieces.json").read_text())
        assert [len(group) for group in said["alike"]] == [len(found)]
        assert "patterns.svg" in names and len(names) == len(found) + 3


class TestWhenThereAreNone:
    def test_a_cylinder_stays_as_it_is(self):
        z = np.linspace(0, 2, 9)
        tube = turned(np.stack([np.ones(9), z], axis=1), 48, quads=True)
        out = gores(tube, "1%")
        assert out.usable and len(out) == 1 and out.metrics["deviation_max"] == 0.0

    def test_seams_that_are_given_stay(self):
        small = ball(12, -1.0, 1.0, quads=True)
        on_rim = small.half_edges.boundary_vertex[small.edges]
        line = small.edges[on_rim.sum(axis=1) == 1][:1]
        out = gores(small, "8%", keep=line, max_strain=0.5)
        assert len(out.kept) == 2  # With the mirror image.
        assert not any("gores" in note for note in out.notes)

    def test_a_note_says_that_there_could_be(self):
        out = gso.pieces(ball(16, -1.0, 1.0), max_deviation="6%", max_strain=0.3, workers=0)
        assert any("body of revolution" in note for note in out.notes)

    def test_mirror_asks_for_a_plane_only(self):
        out = gso.pieces(
            ball(12, -1.0, 1.0, quads=True),
            max_deviation="6%",
            max_strain=0.3,
            symmetric="mirror",
            workers=0,
        )
        assert not any("gores" in note for note in out.notes)
        with pytest.raises(OptionError, match="mirror"):
            gso.pieces(ball(16), max_deviation="6%", symmetric="plane")
