"""Bodies of revolution as rings: parts of cones, as few as hold a distance."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Mesh


def revolved(profile, around=64) -> Mesh:
    """A body of revolution of quads, and triangles at the ends of its profile on the axis."""
    t = 2 * np.pi * np.arange(around) / around
    radius, height = np.asarray(profile, float).T
    points, rows = [], []
    for r, z in zip(radius, height, strict=True):
        first = sum(map(len, points))
        if r == 0.0:
            points.append(np.array([[0.0, 0.0, z]]))
            rows.append(np.full(around, first))
        else:
            points.append(np.stack([r * np.cos(t), r * np.sin(t), 0.0 * t + z], axis=1))
            rows.append(first + np.arange(around))
    faces = []
    for low, high in pairwise(rows):
        for a, b, c, d in zip(low, np.roll(low, -1), np.roll(high, -1), high, strict=True):
            ring = [k for k, other in ((a, d), (b, a), (c, b), (d, c)) if k != other]
            faces.append([*ring, *[-1] * (4 - len(ring))])
    return gso.as_mesh((np.concatenate(points), np.array(faces)))


def ball(rows=48, around=96) -> Mesh:
    up = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)[1:-1]
    inner = np.stack([np.cos(up), np.sin(up)], axis=1)
    return revolved([(0.0, -1.0), *inner, (0.0, 1.0)], around)


@pytest.mark.parametrize("bound", [0.05, 0.02])
def test_a_ball_becomes_as_few_rings_as_its_profile_needs(bound):
    result = gso.strips(ball(), max_deviation=bound)
    assert result.usable, result.reasons
    # Corners are as far outside of a circle as the middles of sides are inside.
    few = next(k for k in range(1, 99) if np.tan(np.pi / (4 * k)) ** 2 <= 0.97 * bound)
    assert result.ruled.strips == few
    assert result.pattern.mesh.components.max() + 1 == few
    # Neither of these is what the profile was divided by.
    radius = np.linalg.norm(result.mesh.vertices, axis=1)
    assert np.abs(radius - 1.0).max() <= bound
    assert metrics.area(result.mesh) == pytest.approx(4 * np.pi, rel=2 * bound)
    strains = metrics.strains(result.pattern.surface(result.mesh), result.pattern.flat)
    assert max(strains.values()) < 1e-12


def test_rings_do_not_depend_on_place_and_size():
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ [[1, 0, 0], [0, c, -s], [0, s, c]]
    # A ball has an axis in every direction.
    design = ball(24, 48)
    design = Mesh(design.vertices * [1.0, 1.0, 1.4], design.faces)
    moved = Mesh(250.0 * design.vertices @ turn.T + [3.0, -700.0, 40.0], design.faces)
    # A per cent of the bounding box would be another length.
    one, two = (gso.strips(m, max_deviation=0.03 * k) for m, k in ((design, 1), (moved, 250)))
    assert one.ruled.strips == two.ruled.strips
    assert two.ruled.farthest == pytest.approx(250.0 * one.ruled.farthest, rel=0.01)


def test_a_torus_becomes_closed_rings():
    turn = np.linspace(0.0, 2 * np.pi, 41)
    design = revolved(np.stack([3.0 - np.cos(turn), -np.sin(turn)], axis=1)[:-1], 72)
    k = np.arange(72)
    last = np.stack([39 * 72 + k, 39 * 72 + np.roll(k, -1), np.roll(k, -1), k], axis=1)
    torus = Mesh(design.vertices, np.concatenate([design.faces, last]))
    result = gso.strips(torus, max_deviation="1%")
    assert result.usable and not result.mesh.boundary_loops
    # Corners are as far outside of a circle as the middles of sides are inside.
    few = next(k for k in range(3, 99) if np.tan(np.pi / (2 * k)) ** 2 <= 0.01 * torus.diagonal)
    assert result.ruled.strips == few
    assert metrics.area(result.mesh) == pytest.approx(4 * np.pi**2 * 3.0, rel=0.05)


def test_circles_of_the_boundary_stay():
    up = np.linspace(-0.9, 1.1, 33)
    vase = revolved(np.stack([1.0 + 0.4 * np.cos(2.0 * up), 1.5 * up], axis=1), 96)
    result = gso.strips(vase, max_deviation="1%")
    assert result.usable and "revolution" in result.notes[-1]
    assert len(result.mesh.boundary_loops) == 2
    for loop in result.mesh.boundary_loops:
        ring = result.mesh.vertices[loop]
        level = min((-1.35, 1.65), key=lambda h: abs(h - ring[:, 2].mean()))
        own = 1.0 + 0.4 * np.cos(2.0 * level / 1.5)
        np.testing.assert_allclose(ring[:, 2], level, atol=1e-3)
        np.testing.assert_allclose(np.hypot(*ring[:, :2].T), own, rtol=3e-3)


def test_cones_of_a_closed_body_come_back():
    design = revolved([(0.0, -2.0), (1.0, 0.0), (0.6, 1.5), (0.0, 1.8)], 96)
    result = gso.strips(design, max_deviation="1%")
    assert result.usable and result.ruled.strips == 3
    assert result.ruled.farthest == 0.0


def dome(rows: int) -> Mesh:
    up = np.linspace(0.0, np.pi / 2, rows + 1)[:-1]
    return revolved([*np.stack([np.cos(up), np.sin(up)], axis=1), (0.0, 1.0)], 48)


def test_rows_of_facets_stay_as_they_are_where_they_are_few():
    # Three rings are within one per cent. The row at the pole is a fan of triangles.
    exact, near = (gso.strips(dome(rows), max_deviation="1%") for rows in (4, 6))
    assert exact.usable and exact.ruled.strips == 4 and exact.ruled.farthest == 0.0
    assert near.usable and near.ruled.strips == 3
    pieces = gso.pieces(dome(6), max_deviation="1%")
    assert pieces.usable and len(pieces) == 6 and pieces.metrics["deviation_max"] == 0.0


def test_a_flanged_tube_stays_as_it_is(tmp_path):
    # Both circles of the flange have as many vertices.
    design = revolved([(1.6, 0.0), (1.6, 1.2), (1.0, 1.2), (1.0, 2.2)])
    job = gso.fabricate(design, tmp_path, max_deviation="1%", unit="m", workers=0, formats=("svg",))
    assert job.usable, job.reasons
    assert len(job.parts) == 3 and job.certificate["designs"][0]["deviation_max"] == 0.0


def test_rings_are_rolled(tmp_path):
    design, bound = ball(24, 64), "0.8%"
    job = gso.fabricate(
        design, tmp_path, max_deviation=bound, unit="m", workers=0, formats=("svg",)
    )
    (record,) = job.certificate["designs"]
    assert job.usable and 0.0 < record["deviation_max"] <= record["allowed"]
    zones = [part["zones"] for part in record["parts"]]
    assert all(len(own) == 1 and own[0]["bent_by"] == "roll" for own in zones)
    # Lengths are those of the circles, not of chords.
    strips = gso.strips(design, max_deviation=bound)
    assert strips.ruled.strips == len(zones)
    area = sum(part["area"] * part["count"] for part in record["parts"])
    assert area == pytest.approx(1e6 * metrics.area(strips.mesh), rel=2e-3)
    assert area > 1e6 * metrics.area(strips.mesh)


def within(mesh: Mesh, keep) -> Mesh:
    """The faces of a mesh whose centres (m, 3) are kept."""
    shown = mesh.faces[:, :3]
    faces = mesh.faces[keep(mesh.vertices[shown].mean(axis=1))]
    used = np.unique(faces[faces >= 0])
    number = np.full(len(mesh.vertices) + 1, -1)
    number[used] = np.arange(len(used))
    return Mesh(mesh.vertices[used], number[faces])


def half_ball(rows=24, around=96) -> Mesh:
    up = np.linspace(0.0, np.pi / 2, rows + 1)[:-1]
    return revolved([*np.stack([np.cos(up), np.sin(up)], axis=1), (0.0, 1.0)], around)


def test_half_of_a_dome_has_half_of_its_rings():
    whole = gso.strips(half_ball(), max_deviation=0.04)
    design = within(half_ball(23, 98), lambda p: p[:, 1] > 0.0)
    half = gso.strips(design, max_deviation=0.04)
    assert half.usable and half.ruled.strips == whole.ruled.strips, half.reasons
    assert metrics.area(half.mesh) == pytest.approx(0.5 * metrics.area(whole.mesh), rel=1e-2)
    assert "part of a body of revolution" in "".join(half.notes)
    # The outline runs over the pole, which is on no other boundary.
    (loop,) = half.mesh.boundary_loops
    plane = half.mesh.vertices[loop]
    assert np.minimum(np.abs(plane[:, 1]), np.abs(plane[:, 2])).max() < 0.01


def test_openings_are_cut_out_of_rings():
    def kept(p):
        door = (p[:, 0] > 0.0) & (np.abs(p[:, 1]) < 0.2) & (p[:, 2] < 0.5)
        window = (p[:, 0] < 0.0) & (np.abs(p[:, 1]) < 0.2) & (np.abs(p[:, 2] - 0.2) < 0.12)
        return ~(door | window)

    design = within(half_ball(32, 128), kept)
    result = gso.strips(design, max_deviation=0.03)
    assert result.usable, result.reasons
    assert result.ruled.strips == gso.strips(half_ball(), max_deviation=0.03).ruled.strips
    assert metrics.area(result.mesh) == pytest.approx(metrics.area(design), rel=0.02)
    given, made = ([len(m.boundary_loops)] for m in (design, result.mesh))
    assert given == made == [2]
    # The window is within a ring, which the door opens: it is a hole of the pattern.
    parts = result.pattern.mesh.components.max() + 1
    assert len(result.pattern.mesh.boundary_loops) == parts + 1
    for loop in result.mesh.boundary_loops:
        off = metrics.point_to_surface(result.mesh.vertices[loop], design)
        assert off.max() <= 0.03


def test_most_of_a_torus_becomes_rings():
    turn = 2 * np.pi * np.arange(40) / 40
    angle = np.linspace(0.0, 1.7 * np.pi, 62)[:, None]
    radius = 3.0 - np.cos(turn)
    points = np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), np.sin(turn))
    k = np.arange(61 * 40)
    after = k - k % 40 + (k + 1) % 40
    pipe = Mesh(np.stack(points, -1).reshape(-1, 3), np.stack([k, k + 40, after + 40, after], 1))
    result = gso.strips(pipe, max_deviation="1%")
    assert result.usable and result.details["rulings_from"] == "revolution"
    assert len(result.mesh.boundary_loops) == 2
    assert metrics.area(result.mesh) == pytest.approx(0.85 * 4 * np.pi**2 * 3.0, rel=0.05)


def test_a_square_of_a_ball_is_no_part_of_a_turned_body():
    x, y = np.meshgrid(*[np.linspace(-0.4, 0.4, 17)] * 2)
    sail = gso.strips(np.dstack([x, y, np.sqrt(1.0 - x**2 - y**2)]), max_deviation="1%")
    assert sail.usable and "revolution" not in "".join(sail.notes)


def test_a_needle_has_no_rings_without_radius():
    up = np.linspace(0.0, np.pi, 21)
    needle = revolved(np.stack([0.02 * np.sin(up).round(12), up], axis=1), 24)
    # A line would be near enough.
    result = gso.strips(needle, max_deviation=0.1)
    assert result.usable and result.ruled.strips == 2
    assert metrics.area(result.mesh) > 0.5 * metrics.area(needle)


def test_rings_are_divided_for_a_sheet():
    result = gso.strips(ball(), max_deviation="1%", sheet=(2.5, 1.2))
    assert result.usable, result.reasons
    few = gso.strips(ball(), max_deviation="1%").pattern.mesh.components.max()
    assert result.pattern.mesh.components.max() > few


def test_more_rings_hold_a_bound_on_creases():
    free = gso.strips(ball(24, 48), max_deviation="1%")
    most = 0.9 * np.degrees(free.ruled.creases.largest_angle)
    result = gso.strips(ball(24, 48), max_deviation="1%", max_crease=most)
    assert result.usable and "revolution" in result.notes[-1]
    assert result.ruled.strips > free.ruled.strips
    assert result.ruled.creases.largest_angle <= np.radians(most)


def test_symmetric_seams_are_still_gores():
    found = gso.pieces(ball(24, 48), max_deviation="2%", symmetric=True)
    assert len(found.alike()) == 1 and "gores" in found.notes[0]
