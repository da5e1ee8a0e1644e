"""Pleats of strips: none where bends follow the design, known ones where they do not."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import faults
from gso.mesh import Mesh
from gso.ruled import Folds, pleats, sharpest_fold
from gso.verdict import Code

NONE = Folds(np.empty((0, 2), np.int64), np.empty(0), np.empty(0))


def profile(heights, step=0.1, width=1.0):
    """A sheet of quads between straight rulings, one for each height of its profile."""
    x = step * np.arange(len(heights))
    ends = [np.column_stack([x, np.full_like(x, y), heights]) for y in (0.0, width)]
    return np.stack(ends, axis=1)


def sheet(points):
    """Return a profile's quads as a mesh, its rulings, and their angles in radians."""
    ids = np.arange(2 * len(points)).reshape(-1, 2)
    faces = np.stack([ids[:-1, 0], ids[1:, 0], ids[1:, 1], ids[:-1, 1]], axis=1)
    way = np.diff(points[:, 0], axis=0)
    angles = -np.diff(np.arctan2(way[:, 2], way[:, 0]))
    return Mesh(points.reshape(-1, 3), faces), ids[1:-1], angles


def measured(points, design):
    """Return the pleats of a profile in degrees, with all of its rulings as bends."""
    mesh, edges, angles = sheet(points)
    strip = np.zeros(len(mesh.faces), np.int64)
    found = pleats(mesh, strip, Folds(edges, angles, np.ones(len(edges))), NONE, design)
    return np.degrees(found)


def flat(length=1.6, width=1.0, count=9):
    x, y = np.meshgrid(np.linspace(0, length, count), np.linspace(0, width, count), indexing="ij")
    return gso.as_mesh(np.dstack([x, y, np.zeros_like(x)]))


def zigzag(slope):
    """Heights whose profile goes up and down in turn by an angle in degrees."""
    return 0.05 * np.tan(np.radians(slope)) * (-1.0) ** np.arange(17)


def test_a_zigzag_over_a_plane_has_pleats_of_twice_its_slope():
    points = profile(zigzag(10.0))
    assert measured(points, flat()) == pytest.approx([20.0], abs=1e-9)


def test_a_design_that_goes_up_and_down_itself_is_followed():
    points = profile(zigzag(10.0))
    assert measured(points, sheet(points)[0]).max() <= 1e-9
    # Half of the angles are the design's.
    assert measured(points, sheet(profile(zigzag(5.0)))[0]) == pytest.approx([10.0], abs=1e-6)


def test_the_sharpest_fold_is_that_beyond_the_design():
    roof = profile(np.tan(np.radians(15.0)) * np.abs(0.1 * np.arange(17) - 0.8))
    mesh, edges, angles = sheet(roof)
    given = mesh, np.zeros(len(mesh.faces), np.int64), Folds(edges, angles, angles), NONE
    assert np.degrees(sharpest_fold(*given, flat())) == pytest.approx(30.0, abs=1e-6)
    # A ridge of the design is meant.
    assert sharpest_fold(*given, mesh) == pytest.approx(0.0, abs=1e-9)
    none = Folds(NONE.edges, NONE.angles, NONE.angles)
    assert sharpest_fold(*given[:2], none, NONE, flat()) == 0.0


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_smooth_wave_has_no_pleats(turn):
    x = 0.1 * np.arange(17)
    points = profile(0.2 * np.sin(4.0 * x + turn))
    fine = np.linspace(0, 1.6, 161)
    design, _, _ = sheet(profile(0.2 * np.sin(4.0 * fine + turn), step=0.01))
    assert measured(points, design).max() < 0.5


def test_a_flat_face_between_does_not_hide_a_pleat():
    heights = np.zeros(17)
    heights[8:10] = 0.03
    points = profile(heights)
    angle = np.degrees(np.arctan2(0.03, 0.1))
    assert measured(points, flat()) == pytest.approx([angle], abs=1e-6)
    # Nor do bends of one degree on that face.
    heights[8:12] = [0.03, 0.031, 0.031, 0.03]
    assert measured(profile(heights), flat())[0] > angle - 2.0


def test_one_bend_is_no_pleat_and_strips_count_alone():
    heights = np.r_[np.zeros(8), 0.05 * np.arange(9)]
    assert measured(profile(heights), flat()) == pytest.approx([0.0], abs=1e-9)
    # Two bends in opposite directions, with the boundary between two strips in between.
    heights = np.r_[np.zeros(6), 0.05 * np.arange(5), np.full(6, 0.2)]
    points = profile(heights)
    assert measured(points, flat())[0] > 20.0
    mesh, edges, angles = sheet(points)
    strip = (np.arange(len(mesh.faces)) >= 8).astype(np.int64)
    crease = Folds(edges[7:8], np.zeros(1), np.zeros(1))
    kept = np.arange(len(edges)) != 7
    rulings = Folds(edges[kept], angles[kept], np.ones(kept.sum()))
    assert pleats(mesh, strip, rulings, crease, flat()).max() == 0.0


def test_pleats_do_not_depend_on_place_size_or_order():
    points, design = profile(zigzag(8.0) + 0.01 * np.arange(17)), flat()
    known = measured(points, design)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    mesh, edges, angles = sheet(points)
    place = np.random.default_rng(2).permutation(len(mesh.vertices))
    moved = np.empty_like(mesh.vertices)
    moved[place] = 300.0 * mesh.vertices @ turn.T + 5.0
    other = Mesh(moved, place[mesh.faces][::-1])
    far = design.replaced(300.0 * design.vertices @ turn.T + 5.0)
    strip = np.zeros(len(other.faces), np.int64)
    rulings = Folds(place[edges], angles, np.ones(len(edges)))
    assert np.degrees(pleats(other, strip, rulings, NONE, far)) == pytest.approx(known, abs=1e-6)


def saddle(count):
    u, v = np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1.3, 1.3, count), indexing="ij")
    return gso.as_mesh(np.dstack([u, v, 0.5 * u * v]))


@pytest.mark.slow
def test_strips_near_a_twisted_saddle_are_not_pleated():
    """A single strip of many pleats would hold this distance."""
    mesh = saddle(11)
    result = gso.strips(mesh, max_deviation=0.02 * mesh.diagonal)
    assert result.usable, result.reasons
    assert result.metrics["pleat_max"] <= faults.PLEATED
    assert 1 < result.ruled.strips <= 4
    assert result.metrics["distance_max"] <= 2.0 + 1e-6


def test_pleats_of_a_number_that_was_named_are_a_note():
    """The nearest strips of this number were asked for."""
    result = gso.strips(saddle(13), strips=2, options="fast")
    assert result.usable and result.metrics["pleat_max"] > faults.PLEATED
    assert any("pleated" in note for note in result.notes)


def test_pleats_count_where_the_number_is_to_be_found():
    """Of a twisted saddle no single strip within this distance is smooth."""
    options = gso.RuledOptions(max_strips=1, starts=("design",))
    with pytest.warns(gso.ConvergenceWarning):
        # Under constraints it is not cut, and strips do not run along its lines.
        result = gso.tno.optimize(
            saddle(9), options=options, constraints=[gso.Fixed([40])], max_deviation="10%"
        )
    (reason,) = (reason for reason in result.reasons if reason.code is Code.PLEATED)
    assert reason.value == result.metrics["pleat_max"] > faults.PLEATED == reason.bound
