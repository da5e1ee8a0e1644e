"""Holonomy of holes: angle defects of inner outlines, and solves that make them close."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Mesh
from tests.conftest import shuffled


def band(radius, height, around: int = 40, along: int = 6) -> Mesh:
    """A surface of revolution between two circles: radius(s), height(s), s from zero to one."""
    a, s = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.linspace(0, 1, along))
    points = np.stack([radius(s) * np.cos(a), radius(s) * np.sin(a), height(s) + 0 * a], axis=-1)
    k = np.arange(around * (along - 1))
    on = k // around * around + (k + 1) % around
    return Mesh(points.reshape(-1, 3), np.stack([k, on, on + around, k + around], axis=1))


def sheet(height, holes, n: int = 24) -> Mesh:
    """A square of quads with square holes (i0, i1, j0, j1), over a height of its plan points."""
    x = np.linspace(-1.0, 1.0, n + 1)
    plan = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    ids = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    keep = np.ones((n, n), bool)
    for i0, i1, j0, j1 in holes:
        keep[i0:i1, j0:j1] = False
    faces = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1)[keep]
    used, number = np.unique(faces, return_inverse=True)
    points = np.c_[plan, height(*plan.T)][used]
    return Mesh(points, number.reshape(-1, 4))


@pytest.mark.parametrize("rise", [0.0, 0.5, 2.0])
def test_a_cone_lacks_the_angle_of_its_tip(rise):
    cone = band(lambda s: 0.5 + s, lambda s: rise * s, around=400)
    lacking = 360.0 * (1.0 - 1.0 / np.hypot(1.0, rise))
    assert metrics.hole_defects(cone) == pytest.approx([lacking], abs=0.02)


def test_a_pyramid_lacks_the_angle_of_its_sides_exactly():
    pyramid = band(lambda s: 1.0 + s, lambda s: -2.0 * s, around=7)
    side, edge = 2.0 * np.sin(np.pi / 7), np.hypot(1.0, 2.0)
    tip = 7 * 2.0 * np.arcsin(0.5 * side / edge)
    assert metrics.hole_defects(pyramid) == pytest.approx([360.0 - np.degrees(tip)], abs=1e-9)


def test_holes_in_a_bent_sheet_close():
    mesh = sheet(lambda x, y: 0 * x, [(4, 9, 5, 8), (14, 20, 12, 17)])
    x, y, _ = mesh.vertices.T
    rolled = mesh.replaced(np.stack([np.sin(x), y, np.cos(x)], axis=1))
    for surface in (mesh, rolled, shuffled(mesh)):
        assert metrics.hole_defects(surface) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_tube_has_a_full_turn_until_it_is_cut_open():
    tube = band(lambda s: 1.0 + 0 * s, lambda s: 2.0 * s)
    assert metrics.hole_defects(tube) == pytest.approx([360.0])
    result = gso.tno.optimize(tube, task="flatten")
    assert result.pattern.is_cut
    assert metrics.hole_defects(result.pattern.surface(tube)).size == 0


def test_surfaces_with_one_outline_or_none_have_no_defect():
    bowl = sheet(lambda x, y: x**2 + y**2, [])
    assert metrics.hole_defects(bowl).size == 0
    two = Mesh(np.r_[bowl.vertices, bowl.vertices + 5.0], np.r_[bowl.faces, bowl.faces + 625])
    assert metrics.hole_defects(two).size == 0
    cube = Mesh(
        np.indices((2, 2, 2)).reshape(3, -1).T.astype(float),
        np.array(
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        ),
    )
    assert metrics.hole_defects(cube).size == 0


def test_defects_and_curvature_add_up_to_the_turning_of_the_outline():
    dented = sheet(
        lambda x, y: 0.3 * np.sin(2 * x + y) * np.cos(y), [(4, 9, 5, 8), (14, 20, 12, 17)]
    )
    inside = 0.0
    triangles, points = dented.triangles, dented.vertices
    angles = np.zeros(len(points))
    for k in range(3):
        a, b, c = (points[triangles[:, (k + j) % 3]] for j in range(3))
        cosine = np.einsum("td,td->t", b - a, c - a)
        cosine /= np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
        np.add.at(angles, triangles[:, k], np.arccos(cosine))
    rim = np.zeros(len(points), bool)
    rim[np.concatenate(dented.boundary_loops)] = True
    inside = (2.0 * np.pi - angles[~rim]).sum()
    outline = (np.pi - angles[dented.boundary_loops[0]]).sum()
    total = inside + outline + np.radians(metrics.hole_defects(dented)).sum()
    assert total == pytest.approx(2.0 * np.pi, abs=1e-9)
