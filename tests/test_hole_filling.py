"""Holes of designs: found, filled, and cut out of strips that were made without them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import gso
from gso import metrics
from gso.mesh import Mesh
from gso.ruled.paneling import filled, holes, without_holes


def sheet(height, windows=(), n: int = 24, size=(2.0, 2.0)) -> Mesh:
    """A rectangle of triangles with round windows (x, y, radius), over a height of its plan."""
    x, y = np.meshgrid(np.linspace(0, size[0], n + 1), np.linspace(0, size[1], n + 1))
    points = np.stack([x, y, height(x, y)], axis=-1)
    grid = Mesh.from_grid(points)
    middle = grid.vertices[grid.triangles].mean(axis=1)
    keep = np.ones(len(middle), bool)
    for a, b, radius in windows:
        keep &= np.hypot(middle[:, 0] - a, middle[:, 1] - b) > radius
    used, number = np.unique(grid.triangles[keep], return_inverse=True)
    return Mesh(grid.vertices[used], number.reshape(-1, 3))


def saddle(x, y):
    return 0.35 * ((x - 1.0) ** 2 - (y - 1.0) ** 2)


WINDOWS = [(0.6, 0.7, 0.25), (1.4, 1.2, 0.2)]


def test_windows_are_holes_and_the_ends_of_tubes_are_not():
    wall = sheet(saddle, WINDOWS)
    assert sorted(map(len, holes(wall))) == sorted(map(len, wall.boundary_loops[1:]))
    a, z = np.meshgrid(np.linspace(0, 2 * np.pi, 41)[:-1], np.linspace(0, 2, 11))
    k = np.arange(400)
    on = k // 40 * 40 + (k + 1) % 40
    quads = np.stack([k, on, on + 40, k + 40], axis=1)
    points = np.stack([np.cos(a), np.sin(a), z], axis=-1).reshape(-1, 3)
    tube = Mesh(points, np.delete(quads, 205, axis=0))
    assert len(tube.boundary_loops) == 3
    assert [len(loop) for loop in holes(tube)] == [4]
    # The mouths of a ball are all that it has.
    pole = 0.5 + 0.5 * (np.pi - 1.0) * z
    ball = np.stack([np.cos(a) * np.sin(pole), np.sin(a) * np.sin(pole), np.cos(pole)], axis=-1)
    assert holes(Mesh(ball.reshape(-1, 3), quads)) == []


def test_filled_holes_go_on_as_the_surface_does():
    plane = sheet(lambda x, y: 0.3 * x - 0.2 * y, WINDOWS)
    whole = filled(plane)
    x, y, z = whole.vertices.T
    assert len(whole.boundary_loops) == 1
    assert metrics.area(whole) == pytest.approx(4.0 * np.sqrt(1.13), rel=1e-9)
    assert np.abs(z - 0.3 * x + 0.2 * y).max() < 1e-6
    curved = sheet(saddle, WINDOWS)
    whole = filled(curved)
    given = len(curved.vertices)
    assert np.array_equal(whole.vertices[:given], curved.vertices)
    x, y, z = whole.vertices[given:].T
    # A plane across would be 0.02 away.
    assert np.abs(z - saddle(x, y)).max() < 2e-3


def test_what_cannot_be_filled_is_left():
    assert filled(sheet(saddle)) is None
    # What is left is a frame.
    assert filled(sheet(saddle, [(1.0, 1.0, 0.85)])) is None


def test_holes_are_cut_out_of_bent_strips_and_their_pattern():
    def height(x, y):
        return np.sqrt(4.0 - (x - 1.0) ** 2)

    design, whole = sheet(height, WINDOWS), sheet(height)
    bent = gso.strips(whole, strips=1).ruled
    outlines = [design.vertices[loop] for loop in holes(design)]
    made = without_holes(bent, design, outlines)
    lost = metrics.area(whole) - metrics.area(design)
    assert len(made.mesh.boundary_loops) == 3
    assert made.strips == 1
    assert made.sound
    assert metrics.area(bent.mesh) - metrics.area(made.mesh) == pytest.approx(lost, rel=0.01)
    assert made.strains["strain_max"] < 1e-8
    assert made.farthest < 1.05 * bent.farthest
    assert made.rulings.largest_angle == pytest.approx(bent.rulings.largest_angle, abs=1e-9)


def test_a_hole_within_one_face_is_cut_out():
    flat = sheet(lambda x, y: 0.0 * x, [(1.1, 0.9, 0.2)])
    bent = gso.strips(sheet(lambda x, y: 0.0 * x), max_deviation=0.01).ruled
    assert len(bent.rulings.edges) == 0
    made = without_holes(bent, flat, [flat.vertices[loop] for loop in holes(flat)])
    assert len(made.mesh.boundary_loops) == 2
    assert len(made.rulings.edges) == 0
    assert metrics.area(made.mesh) == pytest.approx(metrics.area(flat), rel=1e-9)
    assert made.strains["strain_max"] < 1e-9


def test_a_surface_that_is_steep_around_a_hole_is_left():
    def height(x, y):
        return np.sqrt(1.02 - (x - 1.0) ** 2)

    design = sheet(height, [(1.0, 1.0, 0.6)], n=60)
    bent = gso.strips(sheet(height, n=60), strips=1).ruled
    rim = design.vertices[holes(design)[0]]
    assert without_holes(bent, design, [rim]) is not None
    wide = rim * [1.66, 1.0, 1.0] - [0.66, 0.0, 0.0]
    wide[:, 2] = height(wide[:, 0], 0.0)
    assert without_holes(bent, design, [wide]) is None


def test_windows_do_not_make_strips_more():
    design, whole = sheet(saddle, WINDOWS, n=16), sheet(saddle, n=16)
    bound = 0.01 * design.diagonal
    one, other = gso.strips(design, max_deviation=bound), gso.strips(whole, max_deviation=bound)
    assert one.usable, one
    assert one.ruled.strips == other.ruled.strips
    assert len(one.mesh.boundary_loops) == 3
    assert one.deviation <= bound
    # Distances count from the design with its holes.
    assert one.ruled.distances(design).largest == pytest.approx(one.deviation, rel=1e-6)


def test_a_dome_with_bolt_holes_becomes_rings():
    ball = gso.as_mesh(trimesh.creation.icosphere(4))
    middle = ball.vertices[ball.triangles].mean(axis=1)
    keep = middle[:, 2] > 0.3
    for turn in (0.4, 2.3, 4.5):
        bolt = np.array([0.6 * np.cos(turn), 0.6 * np.sin(turn), 0.8])
        keep &= np.linalg.norm(middle - bolt, axis=1) > 0.06
    used, number = np.unique(ball.triangles[keep], return_inverse=True)
    dome = Mesh(ball.vertices[used], number.reshape(-1, 3))
    assert len(holes(dome)) == 3
    made = gso.strips(dome, max_deviation="1%")
    assert made.usable, made
    assert made.ruled.strips <= 3
    assert len(made.mesh.boundary_loops) == 4
