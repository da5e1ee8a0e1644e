"""Strips along a design's own lines: planar designs are met, others approached."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import gso
from gso import faults, metrics
from gso.mesh import Mesh
from gso.ruled.lines import LineStrips, families
from gso.ruled.solve import Wanted
from tests.conftest import EXHAUSTIVE


def scaled(points) -> Mesh:
    mesh = points if isinstance(points, Mesh) else gso.as_mesh(points)
    return mesh.replaced((mesh.vertices - mesh.vertices.mean(axis=0)) / mesh.diagonal)


def translational(rows=6, columns=11):
    """A profile moved along another: every quad is a parallelogram."""
    u, v = np.linspace(-1, 1, rows + 1)[:, None], np.linspace(-1.5, 1.5, columns + 1)[None]
    return np.stack(np.broadcast_arrays(u, v, 0.3 * u**2 + 0.2 * np.sin(v)), axis=-1)


def scale_translational(rows=6, columns=9):
    """A profile scaled and moved: every quad is a trapezoid."""
    u, v = np.linspace(-1, 1, rows + 1)[:, None], np.linspace(0, 2, columns + 1)[None]
    size = 1.0 + 0.3 * np.sin(v)
    return np.stack(np.broadcast_arrays(size * u, v, 0.4 * size * u**2 - 0.1 * v**2), axis=-1)


def revolved(rows=6, around=24):
    """A barrel, closed around: every quad is a trapezoid."""
    h, t = np.linspace(-1, 1, rows + 1)[:, None], 2 * np.pi * np.arange(around)[None] / around
    r = 1.0 - 0.3 * h**2
    points = np.stack(np.broadcast_arrays(r * np.cos(t), r * np.sin(t), h), axis=-1)
    i, j = np.arange(rows)[:, None] * around, np.arange(around)[None]
    k = (j + 1) % around
    faces = np.stack([i + j, i + k, i + around + k, i + around + j], axis=-1)
    return Mesh(points.reshape(-1, 3), faces.reshape(-1, 4))


def dome(count=17, height=0.5):
    u, v = np.meshgrid(*[np.linspace(-1, 1, count)] * 2, indexing="ij")
    return np.stack([u, v, height * (1 - 0.6 * u * u - 0.4 * v * v + 0.2 * u * v)], axis=-1)


def three_patches(count=8):
    """A paraboloid over a hexagon of three rhombi, whose middle has three quads."""
    corner = np.exp(1j * np.pi * np.arange(6) / 3)
    t = np.linspace(0, 1, count + 1)
    z, faces = [], []
    for k in range(3):
        a, b = corner[2 * k], corner[(2 * k + 2) % 6]
        first = sum(len(x) for x in z)
        z.append((t[:, None] * a + t[None] * b).ravel())
        i = np.arange(count)
        at = first + (i[:, None] * (count + 1) + i[None]).ravel()
        faces.append(np.stack([at, at + count + 1, at + count + 2, at + 1], axis=1))
    z = np.concatenate(z)
    _, kept, number = np.unique(
        np.round([z.real, z.imag], 9), axis=1, return_index=True, return_inverse=True
    )
    points = np.stack([z.real, z.imag, 0.4 * np.abs(z) ** 2], axis=1)[kept]
    return Mesh(points, number.ravel()[np.concatenate(faces)])


def gaps(surface):
    """Largest distance of the corners of a strip's faces from planes, face by face."""
    mesh = surface.mesh
    quads = mesh.vertices[mesh.faces[mesh.faces[:, 3] >= 0]]
    edges = quads[:, 1:] - quads[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return float((np.abs(np.linalg.det(edges)) / area).max(initial=0.0))


def stretched(surface):
    """Largest difference of the lengths of edges and diagonals in pattern and surface."""
    pattern, mesh = surface.pattern, surface.mesh
    faces, flat = mesh.triangles, pattern.flat
    table = pattern.mesh.triangles if len(pattern.mesh.triangles) == len(faces) else None
    table = pattern.faces if table is None else table
    worst = 0.0
    for a, b in ((0, 1), (1, 2), (2, 0)):
        there = flat[table[:, a]] - flat[table[:, b]]
        here = (
            mesh.vertices[pattern.vertex[table[:, a]]] - mesh.vertices[pattern.vertex[table[:, b]]]
        )
        worst = max(
            worst, float(np.abs(np.linalg.norm(there, axis=1) - np.linalg.norm(here, axis=1)).max())
        )
    return worst


def checked(surface):
    assert surface.sound
    assert gaps(surface) < 1e-12
    assert stretched(surface) < 1e-11


@pytest.mark.parametrize("make", [translational, scale_translational, revolved])
def test_planar_quads_with_all_rows_are_the_design(make):
    mesh = scaled(make())
    # Strips run along the longer side: six rows.
    found = LineStrips(mesh).strips(6)
    assert found.surface.strips == 6
    assert found.surface.farthest < 1e-6
    checked(found.surface)
    away = np.linalg.norm(found.surface.mesh.vertices[:, None] - mesh.vertices, axis=2).min(axis=0)
    assert away.max() < 1e-6


def test_rings_are_cut_open_once():
    mesh = scaled(revolved())
    assert len(mesh.boundary_loops) == 2
    surface = LineStrips(mesh).strips(6).surface
    loops = surface.pattern.mesh.boundary_loops
    # Each ring of trapezoids is a piece of a cone's surface, one sheet with one outline.
    assert len(loops) == surface.strips == 6
    assert len(surface.rulings.edges) == 6 * 23


def test_more_strips_are_nearer():
    mesh = scaled(dome())
    lines = LineStrips(mesh)
    far = []
    for count in (2, 4, 8, 16):
        surface = lines.strips(count).surface
        checked(surface)
        assert surface.strips == count
        far.append(surface.farthest)
    assert (np.diff(far) < 0).all()
    # The sagitta of strips of a width is that of a parabola: it goes with the square.
    assert far[2] < far[0] / 8


@pytest.mark.parametrize("kind", ["hypar", "pillow"])
def test_twice_as_many_strips_are_not_farther(kind):
    x, y = np.meshgrid(*[np.linspace(-1, 1, 7)] * 2, indexing="ij")
    z = 0.4 * (x * y if kind == "hypar" else np.cos(1.5 * x) * np.cos(1.5 * y))
    mesh = scaled(np.stack([x, y, z], axis=-1))
    # Each number is solved for on its own.
    found = [LineStrips(mesh).strips(count).surface for count in (3, 6)]
    assert all(surface.sound for surface in found)
    far = np.array([surface.farthest for surface in found])
    assert (np.diff(far) <= 0).all()


def test_distances_are_those_of_samples():
    mesh = scaled(dome())
    surface = LineStrips(mesh).strips(4).surface
    rng = np.random.default_rng(0)
    triangles = surface.mesh.vertices[surface.mesh.triangles]
    points = np.einsum("kc,tcd->ktd", rng.dirichlet(np.ones(3), 5), triangles).reshape(-1, 3)
    there = gso.metrics.point_to_surface(points, mesh).max()
    back = gso.metrics.point_to_surface(mesh.vertices, surface.mesh).max()
    assert max(there, back) <= surface.farthest * (1 + 1e-9)
    assert surface.farthest < 0.02


def test_lines_end_at_irregular_vertices():
    mesh = scaled(three_patches())
    assert len(mesh.boundary_loops) == 1 and mesh.grid_index is None
    for family in families(mesh):
        # The bands have every row once.
        rows = np.concatenate([band.rows for band in family.bands])
        assert np.sort(rows).tolist() == list(range(int(family.row.max()) + 1))
    few, many = (LineStrips(mesh).strips(k).surface for k in (4, 12))
    checked(few)
    checked(many)
    assert many.farthest < few.farthest


def test_designs_with_holes():
    mesh = gso.as_mesh(dome(13))
    middle = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, :2]).max(axis=1) < 0.2
    open_ = scaled(gso.as_mesh((mesh.vertices, mesh.faces[~middle])))
    used = open_.used
    assert used.sum() < len(used) or len(open_.boundary_loops) == 2
    surface = LineStrips(open_).strips(8).surface
    checked(surface)
    assert len(surface.mesh.boundary_loops) == 2


def test_named_numbers_and_bounds():
    mesh = scaled(dome())
    lines = LineStrips(mesh)
    assert lines.strips(10_000) is None
    triangles = Mesh(mesh.vertices, mesh.triangles)
    assert LineStrips(triangles).strips(4) is None


def test_a_callback_ends_the_search():
    seen = []

    def tell(count):
        seen.append(count)
        return len(seen) < 2

    lines = LineStrips(scaled(dome()), tell)
    assert lines.strips(2) is not None
    lines.strips(4)
    assert lines.stopped and len(seen) <= 2


def test_a_tube_becomes_strips():
    tube = revolved(rows=12, around=32)
    result = gso.strips(tube, strips=6)
    assert result.usable, result.reasons
    assert result.details["rulings_from"] == "lines"
    assert result.ruled.strips == 6
    assert result.metrics["strain_max"] < 1e-9
    with pytest.raises(gso.MeshError, match="close around"):
        gso.strips(tube, strips=1)


def test_files_keep_strips_along_lines(tmp_path):
    result = gso.strips(revolved(), strips=6)
    result.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.pattern.flat, result.pattern.flat)
    assert again.metrics == pytest.approx(result.metrics)
    result.save(tmp_path / "a.obj")
    assert len(gso.as_mesh(tmp_path / "a.obj").vertices) == len(result.mesh.vertices)


def ramp(turns, rows=5, around=40):
    """A ramp that winds around a cone, and is curved across a little."""
    u, v = np.linspace(0, 1, rows)[:, None], np.linspace(0, turns, int(around * turns) + 1)[None]
    r, turn = 9.0 + 3.5 * u - 1.2 * v, 2 * np.pi * v
    return np.stack(
        np.broadcast_arrays(r * np.cos(turn), r * np.sin(turn), 11 * v + 1.2 * u**2), axis=-1
    )


def test_a_strip_that_winds_around_an_axis_is_divided_across():
    half = gso.strips(ramp(0.8), max_deviation="1%")
    assert half.usable and half.ruled.strips == 1
    assert not any("divided across" in note for note in half.notes)
    result = gso.strips(ramp(2.2), max_deviation="1%")
    assert result.usable and result.ruled.strips == result.details["strips"] == 3
    assert any("divided across" in note for note in result.notes)
    assert not faults.overlaps(result.pattern.surface(result.mesh), result.pattern.flat).size
    # Joints are no bends.
    seams = result.mesh.vertices[result.pattern.vertex[result.pattern.seams[:, 0]]]
    assert len(seams) and result.ruled.creases.largest_angle < np.radians(5)
    areas = np.bincount(result.ruled.strip, metrics.face_areas(result.mesh))
    assert areas.max() < 1.5 * areas.min()


def test_as_few_strips_as_hold_a_distance():
    tube = revolved(rows=16, around=32)
    allowed = 0.01 * tube.diagonal
    result = gso.strips(tube, max_deviation=allowed)
    assert result.usable, result.reasons
    assert result.pieces is None and result.ruled.farthest <= allowed
    fewer = gso.strips(tube, strips=result.ruled.strips - 1)
    assert fewer.ruled.farthest > allowed
    # The profile bends by 0.6 / (2 * 0.6) of the height in all: its sagitta is 0.3 / strips^2.
    assert result.ruled.strips <= np.ceil(np.sqrt(0.3 / allowed))


def sheet(kind, count=13):
    """Part of a cylinder or cone of radius one, with straight columns, and its rulings there."""
    t, h = np.linspace(0, 1.5, count)[:, None], np.linspace(0, 2, 9)[None]
    r = 1.0 + 0.5 * h if kind == "cone" else 1.0 + 0.0 * h
    return np.stack(np.broadcast_arrays(r * np.cos(t), r * np.sin(t), h), axis=-1)


@pytest.mark.parametrize("kind", ["cylinder", "cone"])
def test_developable_designs_are_one_strip_with_their_own_rulings(kind, tmp_path):
    points = sheet(kind)
    result = gso.strips(points)
    assert result.usable and result.ruled.strips == 1
    assert result.ruled.farthest < 1e-12
    a, b = result.mesh.vertices[result.rulings.edges].transpose(1, 0, 2)
    way = (b - a) * np.sign(b - a)[:, 2:]
    # Every inner column is a ruling, over its whole length.
    own = points[1:-1, -1] - points[1:-1, 0]
    order = np.argsort(np.arctan2(a[:, 1], a[:, 0]))
    np.testing.assert_allclose(way[order], own, atol=1e-9)
    if kind == "cylinder":
        assert result.metrics["bend_radius_min"] == pytest.approx(1.0, rel=1e-9)
    # The faces of the pattern are those of the surface, so that splines can be made of it.
    smooth = gso.smooth_strips(result.ruled, result.design)
    assert smooth.is_torsal and smooth.distances[1] < 0.002 * result.design.diagonal


def test_radii_are_those_of_the_surface_where_rulings_meet():
    mesh = scaled(dome())
    surface = LineStrips(mesh).strips(4).surface
    ends = surface.rulings.edges.ravel()
    # Some rulings of a strip meet in a vertex of its crease.
    assert len(np.unique(ends)) < len(ends)
    # Curvatures of the dome are 0.6 and 0.4, a little more where it is steep.
    assert surface.rulings.smallest_radius > 0.2 / gso.as_mesh(dome()).diagonal


def test_the_nearer_strips_are_returned():
    design = gso.as_mesh(dome(9))
    lines = LineStrips(scaled(design)).strips(3).surface
    result = gso.strips(design, strips=3)
    assert result.ruled.farthest <= lines.farthest * design.diagonal * (1 + 1e-6)


def cap(count, shape=(1.3, 1.0)):
    """Triangles in no order of a paraboloid over an ellipse."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(4)
    t = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    inner = np.sqrt(rng.random(count)) * 0.97 * np.exp(2j * np.pi * rng.random(count))
    z = np.r_[np.exp(1j * t), inner]
    points = np.stack([shape[0] * z.real, shape[1] * z.imag], axis=1)
    return Mesh(np.c_[points, 0.5 * (1 - np.abs(z) ** 2)], Delaunay(points).simplices)


def test_strips_of_triangles_along_lines_of_grids():
    mesh = cap(600)
    two, four, eight = (gso.strips(mesh, strips=k) for k in (2, 4, 8))
    assert four.usable and eight.usable and eight.details["rulings_from"] == "lines"
    assert eight.ruled.strips == 8 and eight.metrics["strain_max"] < 1e-9
    far = [r.metrics["distance_max"] for r in (two, four, eight)]
    # Strips across the short side have sagittas of 2.6^2 * 0.6 / 8 / strips^2.
    expected = 100 * 2.6**2 * 0.6 / 8 / mesh.diagonal
    assert far[1] < 2 * expected / 16 and far[2] < 2 * expected / 64
    assert far[2] < far[1] < far[0]


def test_strips_of_triangles_do_not_depend_on_numbering_and_place():
    mesh = cap(500)
    order = np.random.default_rng(1).permutation(len(mesh.vertices))
    t = 0.5
    turn = np.array([[np.cos(t), -np.sin(t), 0], [np.sin(t), np.cos(t), 0], [0, 0, 1.0]])
    moved = 1000.0 * mesh.vertices @ turn.T + [5.0, -3.0, 8.0]
    other = Mesh(moved[order], np.argsort(order)[mesh.faces])
    one, two = (gso.strips(m, strips=8).metrics["distance_max"] for m in (mesh, other))
    assert two == pytest.approx(one, rel=0.1)


def test_tubes_of_triangles_become_strips():
    tube = revolved(rows=12, around=36)
    triangles = Mesh(tube.vertices, tube.triangles)
    allowed = 0.01 * tube.diagonal
    result = gso.strips(triangles, max_deviation=allowed)
    assert result.usable and result.pieces is None and result.ruled.strips <= 6
    assert len(result.mesh.boundary_loops) == 2


def run_along(result) -> np.ndarray:
    """Return the direction of the creases, on the whole."""
    surface = result.ruled
    way = np.diff(surface.mesh.vertices[surface.creases.edges], axis=1)[:, 0]
    return np.linalg.eigh(way.T @ way)[1][:, -1]


@pytest.mark.parametrize("quads", [True, False])
def test_strips_run_along_a_direction_or_a_line(quads):
    mesh = gso.as_mesh(dome(13))
    mesh = mesh if quads else Mesh(mesh.vertices, mesh.triangles)
    for along, axis in (("x", 0), ([0.1, -2.0, 0.3], 1), ([[-1, 0, 0], [0, 0.1, 0], [1, 0, 0]], 0)):
        result = gso.strips(mesh, strips=4, along=along)
        assert result.usable and abs(run_along(result)[axis]) > 0.95


@pytest.mark.parametrize("wrong", ["q", 3, [1, 2], [0, 0, 0], "1,2,x", [[1, 0, 0], [1, 0, 0]]])
def test_directions_that_are_none_are_refused(wrong):
    with pytest.raises(gso.OptionError, match="along is"):
        gso.strips(dome(5), strips=2, along=wrong)


def test_a_direction_takes_several_strips_and_no_constraints():
    with pytest.raises(gso.OptionError, match="along takes strips=2"):
        gso.strips(dome(5), along="x")
    with pytest.raises(gso.OptionError, match="along takes"):
        gso.strips(dome(5), strips=4, along="x", constraints=[gso.constraints.FixedBoundary()])


def stairs(count):
    """Triangles over the squares of a lattice inside a circle: a jagged outline."""
    i, j = (k - count // 2 for k in np.mgrid[:count, :count])
    inside = i**2 + j**2 < (0.45 * count) ** 2
    a, b = np.nonzero(inside[:-1, :-1] & inside[1:, 1:] & inside[1:, :-1] & inside[:-1, 1:])
    k = a * count + b
    quads = np.stack([k, k + count, k + count + 1, k + 1], axis=1)
    points = np.stack([i, j, -0.02 * (i**2 + j**2)], axis=-1).reshape(-1, 3)
    used = np.unique(quads)
    mesh = Mesh(points[used], np.searchsorted(used, quads))
    return Mesh(mesh.vertices, mesh.triangles)


def test_outlines_that_have_no_corners_or_many():
    three = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0.1]], [[0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    assert len(gso.strips(three, strips=2).mesh.faces)
    assert gso.strips(stairs(15), strips=4).metrics["distance_max"] < 1.0


def notched():
    """Triangles of a tube without two of its last ring."""
    tube = revolved(rows=6, around=24)
    middle = tube.vertices[tube.faces].mean(axis=1)
    last = middle[:, 2] > middle[:, 2].max() - 1e-6
    faces = np.delete(tube.faces, np.flatnonzero(last)[0], axis=0)
    return Mesh(tube.vertices, Mesh(tube.vertices, faces).triangles)


def test_grids_laid_over_corners_have_no_points_that_coincide():
    # Both edges of a triangle at a corner may lie on one side of a grid, or on an end of a tube.
    for mesh in (scaled(gso.as_mesh(dome(11))), scaled(stairs(15)), scaled(notched())):
        copies = gso.ruled.lines.grid_copies(mesh)
        assert copies
        for copy in copies:
            ends = copy.vertices[copy.edges]
            assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min() > 1e-6


def test_metrics_of_parts_with_slits():
    tube = gso.as_mesh(sheet("cylinder", count=13))
    row = tube.grid_index[6, :5]
    slit = gso.cut(tube, np.stack([row[:-1], row[1:]], axis=1)).opened.mesh
    found = gso.strips(slit, max_deviation=0.01).metrics
    assert 0 < found["part_circle_min"] < 2.0 and found["part_area_min"] <= 100.0


def test_a_callback_ends_strips_along_a_direction():
    mesh = gso.as_mesh(dome(9))
    triangles = Mesh(mesh.vertices, mesh.triangles)
    result = gso.strips(triangles, strips=4, along="x", callback=lambda progress: False)
    assert result.status is gso.Status.CANCELLED and result.ruled is None
    with pytest.raises(gso.MeshError, match="60 strips are too many"):
        gso.strips(triangles, strips=60, along="x")


@pytest.mark.parametrize("triangles", [False, True])
def test_a_turned_cylinder_has_its_own_rulings_without_a_limit(triangles):
    u, v = np.mgrid[-1:1:33j, -1:1:33j]
    turn = np.radians(30.0)
    x, y = np.cos(turn) * u - np.sin(turn) * v, np.sin(turn) * u + np.cos(turn) * v
    mesh = gso.as_mesh(np.stack([2 * np.sin(x / 2), y, 2 * np.cos(x / 2)], axis=-1))
    if triangles:
        mesh = gso.Mesh(mesh.vertices, mesh.triangles)
    result = gso.strips(mesh)
    assert result.usable and result.ruled.strips == 1 and result.ruled.farthest == 0.0
    lines = np.array([bend.line for bend in result.folded.lines(result.pattern.flat)])
    ways = (lines[:, 1] - lines[:, 0]) @ [1, 1j]
    # Directions do not depend on the sign.
    angles = np.degrees(np.angle(ways**2 / ways[0] ** 2)) / 2
    assert len(lines) > 20
    assert np.abs(angles).max() < 0.05


def test_fair_creases_turn_little():
    surface = LineStrips(scaled(dome())).strips(4).surface
    turns = surface.creases.turns(surface.mesh.vertices)
    a, b = surface.mesh.vertices[surface.creases.edges].transpose(1, 0, 2)
    # Of a circle through the dome they would turn by about 50 degrees.
    assert np.degrees(turns.sum()) < 100.0 * np.linalg.norm(b - a, axis=1).sum()


def test_creases_are_less_fair_where_that_holds_the_distance():
    mesh = scaled(dome())
    fair = LineStrips(mesh).strips(6).surface.farthest
    wanted = Wanted(None, 64, False, 0.97 * fair, None, None, 64)
    found = LineStrips(mesh).within(wanted)
    assert found.surface.strips == 6
    assert found.surface.farthest <= wanted.max_deviation


def awning(u, v):
    """A bilinear patch that sags, with a straight outline."""
    sag = 2.4 * u * (1 - u) * v * (1 - v)
    return 4 * u, 3 * v, 2.2 + 0.7 * u + 1.2 * v - 1.6 * u * v - sag


def wave(u, v):
    slope = 0.5 * np.sin(2 * u + 0.4) * (1 + 0.3 * v)
    return 3 * u + 0.2 * v * v, 2 * v, slope + 0.15 * u * v * v


def canopy(u, v):
    return 2 * u, 3 * v + 0.3 * u * u, 0.4 * np.cos(1.3 * v - 0.2) * np.cos(1.1 * u) + 0.1 * u * v


def sampled(make, rows=17, columns=13):
    u, v = np.linspace(0, 1, rows)[:, None], np.linspace(0, 1, columns)[None]
    return np.stack(np.broadcast_arrays(*make(u, v)), axis=-1)


@cache
def strips_within(make, bound):
    """Strips of a sampled surface, shared by tests that read them."""
    return gso.strips(sampled(make).round(6), max_deviation=bound)


def vault(u, v):
    """A barrel vault whose crown goes up and down."""
    return 4 * u - 2, 3 * v, (1 - (2 * u - 1) ** 2) * (1.17 + 0.3 * np.sin(3 * np.pi * v))


@pytest.mark.slow
def test_a_few_more_strips_are_taken_where_fewer_are_folded_sharply():
    lines = LineStrips(scaled(sampled(vault, 33, 41)))
    found = lines.within(Wanted(None, 32, False, 0.01, None, None, 64)).surface
    fewest = next(k for k, one in sorted(lines.results.items()) if one.surface.farthest <= 0.01)
    assert lines.results[fewest].surface.sound
    assert fewest < found.strips <= fewest + fewest // 3
    folds = [one.rulings.largest_angle for one in (found, lines.results[fewest].surface)]
    assert folds[0] < np.radians(20) < 0.5 * folds[1]


@pytest.mark.parametrize("digits", [6, 9])
def test_rounded_coordinates_of_a_straight_outline_change_nothing(digits):
    exact = sampled(awning, 31, 23)
    far = [
        LineStrips(scaled(points)).strips(4).surface.farthest
        for points in (exact, exact.round(digits))
    ]
    assert far[1] == pytest.approx(far[0], rel=0.05)


#: Ways round of a grid; "both" is transposed and flipped.
WAYS = ("transposed", "flipped", "both", "turned in space")


@pytest.mark.parametrize(
    ("make", "bound", "count", "way"),
    [
        *((awning, 0.03, 3, way) for way in WAYS),
        *(
            pytest.param(*case, way, marks=pytest.mark.slow)
            for case in ((wave, 0.01, 2), (canopy, 0.01, 3))
            for way in (WAYS if EXHAUSTIVE else WAYS[2:])
        ),
    ],
)
def test_the_number_of_strips_does_not_depend_on_the_way_round_of_a_grid(make, bound, count, way):
    points = sampled(make).round(6)
    wanted = strips_within(make, bound)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ [[1, 0, 0], [0, c, -s], [0, s, c]]
    other = {
        "transposed": points.transpose(1, 0, 2),
        "flipped": points[::-1],
        "both": points[:, ::-1].transpose(1, 0, 2),
        "turned in space": points @ turn.T,
    }[way]
    results = [wanted, gso.strips(np.ascontiguousarray(other), max_deviation=bound)]
    assert [result.ruled.strips for result in results] == [count, count]
    assert all(result.usable for result in results)
    far = [result.ruled.farthest for result in results]
    assert far[1] == pytest.approx(far[0], rel=0.1)
