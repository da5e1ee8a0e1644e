"""Holonomy of holes: angle defects of inner outlines, and solves that make them close."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import geometry, metrics
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


def wavy_ring() -> Mesh:
    """A ring whose outline goes up and down three times."""
    ring = band(lambda s: 0.35 + 0.65 * s, lambda s: 0.0 * s, around=64, along=15)
    x, y, _ = ring.vertices.T
    height = 0.18 * (x**2 + y**2) * np.cos(3.0 * np.arctan2(y, x))
    return ring.replaced(np.c_[x, y, height])


def largest_strain(surface: Mesh, flat) -> float:
    """The largest |l'/l - 1| in any direction of any triangle, by Gram matrices."""
    gram = []
    for points in (surface.vertices, flat):
        a, b, c = (points[surface.triangles[:, k]] for k in range(3))
        edges = np.stack([b - a, c - a], axis=1)
        gram.append(edges @ edges.transpose(0, 2, 1))
    squared = np.linalg.eigvals(np.linalg.solve(*gram)).real
    return float(np.abs(np.sqrt(squared) - 1.0).max())


def test_a_ring_closes_in_the_plane():
    design = wavy_ring()
    far = {"max_strain": 1.0, "max_deviation": 1.0}
    strains, defects, curved = [], [], []
    for weight in (0.0, gso.DevelopableOptions().w_holes):
        options = gso.DevelopableOptions(w_holes=weight)
        result = gso.tno.optimize(design, options=options, **far)
        assert not result.pattern.is_cut
        strains.append(largest_strain(result.mesh, result.pattern.flat))
        defects.append(np.abs(metrics.hole_defects(result.mesh)).max())
        assert result.metrics["hole_defect_max"] == pytest.approx(defects[-1])
        assert metrics.surface_distance(design, result.mesh).there_max < 0.04 * design.diagonal
        curved.append(metrics.loss_gc(result.mesh) / metrics.loss_gc(design))
    assert strains[1] < 0.2 * strains[0]
    assert defects[1] < 0.2 * defects[0]
    assert max(curved) < 0.02


def test_holes_that_lack_an_angle_are_left_to_cuts():
    cap = sheet(lambda x, y: np.sqrt(4.0 - x**2 - y**2), [(4, 9, 5, 8), (14, 20, 12, 17)])
    assert (metrics.hole_defects(cap) > 0.0).all()
    one, two = (
        gso.tno.optimize(cap, options=gso.DevelopableOptions(w_holes=w)) for w in (0.0, 1.0)
    )
    assert np.array_equal(one.mesh.vertices, two.mesh.vertices)
    assert one.usable
    assert one.pattern.is_cut
    assert "hole_defect_max" not in one.metrics


def test_designs_with_one_outline_do_not_depend_on_the_weight():
    mesh = shuffled(sheet(lambda x, y: 0.2 * (x**2 - y**2), []))
    one, two = (
        gso.tno.optimize(mesh, options=gso.DevelopableOptions(w_holes=w)) for w in (0.0, 1.0)
    )
    assert np.array_equal(one.mesh.vertices, two.mesh.vertices)


def test_targets_close_a_loop_in_the_plane():
    """Turning angles of :func:`gso.geometry.closing`, once more and again, close a polygon."""
    rng = np.random.default_rng(2)
    n = 30
    turn, length = -2.0 * np.pi / n + rng.normal(0.0, 0.1, n), rng.uniform(0.5, 1.5, n)
    number = np.zeros(n, int)
    for _ in range(20):
        turn = geometry.closing(turn, length, number).turn
    heading = np.cumsum(turn)
    assert turn.sum() == pytest.approx(-2.0 * np.pi)
    ends = [(length * f(heading)).sum() for f in (np.cos, np.sin)]
    assert ends == pytest.approx([0.0, 0.0], abs=1e-6)


def test_an_unrolled_hole_has_the_gap_of_a_shifted_sheet():
    """Two cones of opposite defects at a distance shift what goes around both by a gap."""
    sides = np.array([3.0, 2.0, 3.5, 2.0])
    found = geometry.closing(np.full(4, -0.5 * np.pi), sides, np.zeros(4, int))
    assert found.defect == pytest.approx([0.0])
    assert found.gap == pytest.approx([0.5])


@pytest.mark.parametrize("rise", [0.2, 0.4, 0.6])
def test_rings_on_a_cone_are_cut_open(rise):
    cone = band(lambda s: 0.35 + 0.65 * s, lambda s: 0.65 * rise * s, around=72, along=17)
    result = gso.tno.optimize(cone, task="flatten")
    assert result.pattern.is_cut
    assert largest_strain(result.pattern.surface(cone), result.pattern.flat) < 1e-9
    assert gso.tno.optimize(cone).usable
