"""Exactly ruled surfaces: first rulings, planarity, the solve, trimming and unrolling."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gso
from gso import faults, metrics, parametrization
from gso.mesh import Mesh
from gso.ruled import Conditions, Domain, Folds, Strips, strip_fit
from gso.ruled.chords import chords
from gso.ruled.copies import copies, with_copies
from gso.ruled.descent import planarised
from gso.ruled.extended import Extended
from gso.verdict import Code
from tests.conftest import codes, cylinder, rotation, saddle, shuffled

ROOT = Path(__file__).resolve().parents[1]


def domain(points) -> Domain:
    mesh = points if isinstance(points, Mesh) else Mesh.from_grid(points)
    mesh = mesh.replaced(mesh.vertices / mesh.diagonal)
    return Domain(mesh, parametrization.begin(mesh).flat)


def bent_strip(count=9):
    """Vertices of a strip that is not planar, with rulings of a helicoid."""
    u = np.linspace(0.0, 1.0, count)
    way = np.stack([np.cos(0.5 * u), np.sin(0.5 * u), 0.2 * u], axis=1)
    first = np.stack([0 * u, 0.3 * u, u], axis=1)
    return np.stack([first, first + way], axis=1).reshape(-1, 3)


def test_design_continues_beyond_its_outline():
    there = domain(np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))]))
    corner = there.flat[there.outline].min(axis=0) - 0.5 * there.margin
    inside = there.flat.mean(axis=0)
    a, b = there.points(np.array([corner, inside]))
    assert np.linalg.norm(a - b) == pytest.approx(np.linalg.norm(corner - inside), rel=1e-6)
    assert a[2] == pytest.approx(0.0, abs=1e-12)


def test_extrapolation_is_exact_for_parabolas():
    u, v = np.meshgrid(np.linspace(-1, 1, 65), np.linspace(-1, 1, 65), indexing="ij")
    mesh = Mesh.from_grid(np.stack([u, v, 0.3 * u * u], axis=-1))
    there = Domain(mesh, mesh.vertices[:, :2].copy())
    x = 1.0 + 0.8 * there.margin
    (found,) = there.points(np.array([[x, 0.0]]))
    np.testing.assert_allclose(found, [x, 0.0, 0.3 * x * x], atol=2e-4)


def test_cheapest_chords_of_a_cylinder_are_its_rulings():
    there = domain(cylinder(33, turn=0.4))
    strips, places = chords(there, 33)
    ends = places[strips.index[0]]
    way = ends[:, 1] - ends[:, 0]
    size = np.linalg.norm(way, axis=1)
    long = size > 0.5 * size.max()
    assert long.sum() > 16
    # None crosses the one before: its ends are on one side of it.
    side = np.einsum("kd,ked->ke", way[:-1] @ [[0, 1], [-1, 0]], ends[1:] - ends[:-1, :1])
    assert (side > 0).all() or (side < 0).all()
    way = way[long] / size[long, None]
    middle = np.linalg.svd(way)[2][0]
    assert np.degrees(np.arccos(np.clip(np.abs(way @ middle), 0, 1))).max() < 6.0


def test_chords_do_not_depend_on_numbering():
    mesh = Mesh.from_grid(cylinder(17, turn=0.5))
    mixed = shuffled(mesh)
    lengths = [
        np.sort(
            np.linalg.norm(np.diff(chords(domain(m), 17)[1].reshape(-1, 2, 2), axis=1), axis=2)[
                :, 0
            ]
        )
        for m in (mesh, mixed)
    ]
    np.testing.assert_allclose(lengths[1], lengths[0], atol=0.05)


def volumes(strips, vertices):
    """Six times the volumes of the tetrahedra of the quads' corners: zero where they are planar."""
    corners = vertices[strips.corners]
    return np.linalg.det(corners[:, 1:] - corners[:, :1])


def made_planar(strips, vertices):
    there = domain(saddle(9))
    job = strip_fit.Job(Extended(there), there.mesh.vertices)
    return planarised(job.energy(strips, vertices).system, vertices)


def test_planar_strips_are_left_alone_and_others_become_planar():
    strips = Strips.sequence(9)
    assert np.abs(volumes(strips, bent_strip())).max() > 1e-4
    planar = made_planar(strips, bent_strip())
    np.testing.assert_allclose(volumes(strips, planar), 0.0, atol=1e-14)
    np.testing.assert_array_equal(made_planar(strips, planar), planar)


def test_halved_strips_stay_planar_and_merged_ends_are_triangles():
    strips = Strips.sequence(9)
    planar = made_planar(strips, bent_strip())
    more, vertices = strips.halved(planar)
    assert more.count == 2
    np.testing.assert_allclose(volumes(more, vertices), 0.0, atol=1e-14)
    fan, there = strips.merged(planar, np.array([[0, 2], [2, 4]]))
    assert len(fan.corners) - len(fan.quads) == 2
    assert fan.size == len(there) == strips.size - 2


@pytest.mark.parametrize("power", [2.0, 4.0])
@pytest.mark.parametrize("conditions", [False, True])
def test_gradient_of_the_energy_is_that_of_differences(power, conditions):
    there = domain(saddle(17, strength=0.25))
    first, places = chords(there, 9)
    strips, vertices = first.halved(there.points(places))
    lines = there.mesh.vertices[[[0, 288]]] + [0.0, 0.0, 0.1]
    wanted = Conditions(points=lines[0], lines=lines, radius=2.0) if conditions else Conditions()
    job = strip_fit.Job(Extended(there), there.lattice(200), conditions=wanted)
    energy = job.energy(strips, vertices)
    rng = np.random.default_rng(0)
    vertices = vertices + 1e-4 * rng.standard_normal(vertices.shape)
    changed = {"back": 0.0, "gap": 0.0, "fold": 1e-6, "hold": 1.0, "radius": 1e-3}
    w, scale = replace(job.weights, power=power, **changed), 0.01
    measured = energy.measure(vertices)
    gradient, _ = energy.derivatives(vertices, measured, w, scale)
    step = 1e-7 * rng.standard_normal(vertices.shape)

    def value(at):
        return energy.value(at, energy.measure(at), w, measured.back_weight, scale)

    change = 0.5 * (value(vertices + step) - value(vertices - step))
    assert (gradient * step).sum() == pytest.approx(change, rel=2e-3)


def checked(result, most):
    """Check what must hold for each ruled surface, and its largest distance in per cent."""
    surface, pattern = result.ruled, result.pattern
    mesh, size = surface.mesh, result.design.diagonal
    assert result.usable, result.reasons
    assert surface.crossed == 0
    assert result.metrics["distance_max"] < most
    quads = mesh.faces[mesh.faces[:, 3] >= 0]
    corner = mesh.vertices[quads]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    gap = np.einsum("qd,qd->q", corner[:, 1] - corner[:, 0], normal)
    assert np.abs(gap).max(initial=0.0) < 1e-12 * size
    sheet = pattern.surface(mesh)
    ends = sheet.edges
    there, flat = (
        np.linalg.norm(np.subtract(*x[ends].transpose(1, 0, 2)), axis=1)
        for x in (sheet.vertices, pattern.flat)
    )
    assert np.abs(there - flat).max() < 1e-12 * size
    assert len(faults.overlaps(sheet, pattern.flat)) == 0
    assert len(mesh.boundary_loops) == len(result.design.boundary_loops)


@pytest.mark.parametrize(
    ("points", "most"),
    [(cylinder(33, turn=0.5), 0.4), (saddle(33, strength=0.25), 6.0)],
    ids=["cylinder", "saddle"],
)
def test_ruled_surfaces_are_exactly_developable(points, most):
    result = gso.tno.optimize(points, options=gso.RuledOptions(strips=1))
    checked(result, most)
    assert result.flat.shape == (len(result.mesh.vertices), 2)
    assert result.ruled.strips == 1
    assert result.on_design().faces.shape == result.design.faces.shape


def test_rulings_of_a_cylinder_have_its_direction_and_radius():
    result = gso.tno.optimize(cylinder(65), options=gso.RuledOptions(rulings=33))
    a, b = result.mesh.vertices[result.rulings.edges].transpose(1, 0, 2)
    way = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    axis = np.linalg.svd(way)[2][0]
    inner = slice(3, -3)
    assert np.degrees(np.arccos(np.clip(np.abs(way @ axis), 0, 1)))[inner].max() < 1.0
    # All folds are on one side.
    angles = result.rulings.angles
    assert (angles > 0).all() or (angles < 0).all()


def bowl(count=33):
    u = np.linspace(-1.0, 1.0, count)
    return np.stack(np.broadcast_arrays(u[:, None], u, 0.3 * u[:, None] ** 2 + 0.1 * u**2), axis=-1)


def test_more_strips_are_closer_and_share_creases():
    points = bowl()
    far = []
    for strips in (1, 2, 3):
        result = gso.tno.optimize(points, options=gso.RuledOptions(strips=strips))
        checked(result, 6.0)
        assert result.ruled.strips == strips
        far.append(result.metrics["distance_mean"])
        assert len(result.pattern.seams) == len(result.ruled.creases.edges)
        assert (result.flat is None) == (strips > 1)
    assert far[0] > far[1] > far[2]


def test_as_few_strips_as_the_bound_allows():
    mesh = Mesh.from_grid(bowl())
    bound = 0.01 * mesh.diagonal
    result = gso.tno.optimize(mesh, formulation="ruled", max_deviation=bound)
    assert result.usable, result.reasons
    tried = dict(x.split(": ") for x in result.details["tried"].split("; "))
    fewer = [float(v.rstrip(" %")) for k, v in tried.items() if int(k) < result.ruled.strips]
    assert result.ruled.strips > 1
    assert all(far > 1.0 for far in fewer)


def test_unreachable_bounds_are_said():
    points = saddle(17, strength=0.5)
    options = gso.RuledOptions(strips=1)
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.tno.optimize(points, options=options, max_deviation=1e-4)
    assert not result.usable
    assert result.status is gso.Status.TARGET_MISSED
    found = codes(result.reasons)
    assert found[0] is Code.TARGET_MISSED
    # A single strip so far from its design may be folded, too.
    assert found[-1] is Code.DEVIATION
    assert result.reasons[-1].value == result.deviation > 1e-4


def test_triangles_holes_and_numbering():
    mesh = shuffled(Mesh.from_grid(saddle(25, strength=0.2)))
    four = mesh.faces[mesh.faces[:, 3] >= 0]
    triangles = np.concatenate([four[:, :3], four[:, [0, 2, 3]]])
    checked(gso.tno.optimize(Mesh(mesh.vertices, triangles), formulation="ruled"), 6.0)
    grid = Mesh.from_grid(saddle(25, strength=0.2))
    middle = grid.vertices[grid.faces].mean(axis=1)
    away = np.linalg.norm((middle - middle.mean(axis=0))[:, :2], axis=1)
    holed = Mesh(grid.vertices, grid.faces[away > 0.25 * away.max()])
    checked(gso.tno.optimize(holed, formulation="ruled"), 6.0)


def test_unit_position_and_numbering_do_not_matter_much():
    """Rounding errors may lead to another local minimum, whose distance is similar."""
    mesh = Mesh.from_grid(bowl(17))
    moved = mesh.replaced(1000.0 * mesh.vertices @ rotation(3).T + 5000.0)
    results = [
        gso.tno.optimize(m, options=gso.RuledOptions(starts=("design",)))
        for m in (mesh, moved, shuffled(mesh))
    ]
    one, two, three = (r.metrics["distance_mean"] for r in results)
    assert two == pytest.approx(one, rel=0.5)
    assert three == pytest.approx(one, rel=0.5)
    assert all(r.usable for r in results)
    radius = [r.metrics["bend_radius_min"] for r in results]
    assert 100.0 * radius[0] < radius[1] < 10000.0 * radius[0]


def test_results_come_back_from_files(tmp_path):
    result = gso.tno.optimize(saddle(17, strength=0.25), options=gso.RuledOptions(strips=2))
    result.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.mesh.faces, result.mesh.faces)
    np.testing.assert_array_equal(again.pattern.flat, result.pattern.flat)
    np.testing.assert_array_equal(again.rulings.angles, result.rulings.angles)
    np.testing.assert_array_equal(again.on_design().vertices, result.on_design().vertices)
    assert again.metrics == pytest.approx(result.metrics)
    result.save(tmp_path / "a.svg")
    drawing = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert drawing.count("degrees, radius") == np.count_nonzero(result.rulings.angles)
    result.save(tmp_path / "a.obj")
    assert len(gso.load(tmp_path / "a.obj").faces) == len(result.mesh.faces)


def test_strips_report_their_progress_and_can_be_stopped():
    names = []

    def watch(progress):
        names.append(progress.name)
        return "strips: 2" not in names

    points = saddle(17, strength=0.25)
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.tno.optimize(points, options=gso.RuledOptions(strips=4), callback=watch)
    assert names[-1] == "strips: 2"
    assert "strips: 1" in names
    assert result.status is gso.Status.CANCELLED
    # The single strip that was there already.
    assert result.ruled.strips == 1
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.tno.optimize(
            points, formulation="ruled", callback=lambda p: not p.name.startswith("strips")
        )
    assert result.status is gso.Status.CANCELLED
    assert result.ruled is None


@pytest.mark.parametrize("settings", [{"strips": 1}, {"strips": 4}, {"flats": True}])
def test_flat_sheets_stay_flat_and_whole(settings):
    sheet = np.dstack([*np.mgrid[:9.0, :17.0], np.zeros((9, 17))])
    result = gso.tno.optimize(sheet, options=gso.RuledOptions(**settings))
    assert result.usable, result.reasons
    assert result.metrics["distance_max"] < 0.02
    assert np.abs(result.rulings.angles).max() < 1e-6
    # The outline keeps its corners.
    corners = sheet[[0, 0, -1, -1], [0, -1, 0, -1]]
    apart = np.linalg.norm(corners[:, None] - result.mesh.vertices, axis=2).min(axis=1)
    np.testing.assert_allclose(apart, 0.0, atol=1e-6)
    assert result.rulings.smallest_radius > 1e6
    assert metrics.area(result.mesh) == pytest.approx(128.0, rel=1e-4)


def rails():
    """Two curves of a hull: the chine and the deck."""
    t = np.linspace(0.0, 1.0, 40)
    deck = np.stack([4.0 * t, 0.6 * np.sin(0.5 * np.pi * t) - 0.2, 0.5 + 0.6 * t**2], axis=1)
    chine = np.stack([4.2 * t, 0.8 * np.sin(0.5 * np.pi * t), 0.2 * t**2], axis=1)
    return deck, chine


def test_lofts_are_planar_between_rails():
    curves = rails()
    strip = gso.loft(*curves)
    assert strip.sound
    off = np.linalg.norm(strip.moved - np.concatenate(curves), axis=1)
    assert off.max() < 1e-3
    mesh, flat = strip.mesh, strip.pattern.flat
    quads = mesh.faces[mesh.faces[:, 3] >= 0]
    volume = np.linalg.det(mesh.vertices[quads[:, 1:]] - mesh.vertices[quads[:, :1]])
    assert np.abs(volume).max() < 1e-12
    a, b = mesh.edges.T
    there, here = (np.linalg.norm(x[a] - x[b], axis=1) for x in (mesh.vertices, flat))
    np.testing.assert_allclose(here, there, atol=1e-12)
    # Twice as many rulings: a quarter of the distance.
    finer = gso.loft(*curves, rulings=65)
    less = np.linalg.norm(finer.moved - np.concatenate(curves), axis=1)
    assert less.max() < 0.35 * off.max()


def test_lofts_of_cones_are_cones_and_impossible_ones_are_not_sound():
    t = np.linspace(0.0, 1.0, 50)
    circle = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    cone = gso.loft(circle, 2.0 * circle + [0.0, 0.0, 1.0])
    a, b = cone.mesh.vertices[cone.rulings.edges].transpose(1, 0, 2)
    apex = np.array([0.0, 0.0, -1.0])
    way, true = b - a, 0.5 * (a + b) - apex
    sine = np.linalg.norm(np.cross(way, true), axis=1)
    sine /= np.linalg.norm(way, axis=1) * np.linalg.norm(true, axis=1)
    assert np.degrees(sine.max()) < 0.05
    wave = np.stack([4.0 * t, 1.0 + 0.4 * np.sin(3.0 * t), 0.3 * np.cos(4.0 * t)], axis=1)
    assert not gso.loft(rails()[0], wave).sound
    with pytest.raises(gso.MeshError, match="curve `other`"):
        gso.loft(circle, circle[:2])
    with pytest.raises(gso.OptionError, match="rulings"):
        gso.loft(circle, circle + 1.0, rulings=2)


@pytest.mark.parametrize("strips", [1, 2])
def test_strips_pass_through_fixed_vertices_and_handles(strips):
    mesh = Mesh.from_grid(saddle(25, strength=0.2))
    middle = len(mesh.vertices) // 2
    lifted = mesh.vertices[middle] + [0.0, 0.0, 0.02 * mesh.diagonal]
    for constraint in (gso.Fixed([0, middle]), gso.Handle(middle, lifted)):
        options = gso.RuledOptions(strips=strips)
        result = gso.tno.optimize(
            mesh, options=options, constraints=[constraint], max_deviation=0.1 * mesh.size
        )
        assert result.usable, result.reasons
        (missed,) = result.details["constraints"].values()
        assert missed < 1e-7 * mesh.diagonal
    off = metrics.point_to_surface(lifted[None], result.mesh)
    assert off.max() < 1e-7 * mesh.diagonal


@pytest.mark.parametrize("strips", [1, 2])
def test_beams_are_rulings(strips):
    u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    mesh = Mesh.from_grid(np.stack([u, v, 0.2 * u * u - 0.05 * v], axis=-1))
    # One beam along the rulings of the cylinder, one across them at an angle.
    for ends in ([5 * 17, 5 * 17 + 16], [5 * 17, 8 * 17 + 16]):
        options = gso.RuledOptions(strips=strips)
        result = gso.tno.optimize(mesh, options=options, constraints=[gso.Ruling(ends)])
        assert result.usable, result.reasons
        a, b = mesh.vertices[ends]
        p, q = result.mesh.vertices[result.rulings.edges].transpose(1, 0, 2)
        way = (b - a) / np.linalg.norm(b - a)
        off = [np.linalg.norm(np.cross(x - a, way), axis=1) for x in (p, q)]
        on = np.maximum(*off) < 1e-7
        # Its pieces, one for each strip, cover the beam inside the outline.
        covered = np.abs((q - p)[on] @ way).sum()
        assert covered == pytest.approx(np.linalg.norm(b - a), rel=0.02)


@pytest.mark.parametrize("strips", [1, 2, 3])
def test_results_are_symmetric(strips):
    u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    design = np.stack([u, v, 0.3 * u * u * v + 0.2 * u * u], axis=-1)
    mirror = gso.SymmetryPlane([0, 0, 0], [1, 0, 0])
    options = gso.RuledOptions(strips=strips, starts=("design",))
    result = gso.tno.optimize(design, options=options, constraints=[mirror])
    assert result.usable, result.reasons
    ends = result.ruled.untrimmed.vertices
    image = ends * [-1.0, 1.0, 1.0]
    apart = np.linalg.norm(image[:, None] - ends, axis=2).min(axis=1)
    assert apart.max() < 1e-9
    with pytest.raises(gso.OptionError, match="flats=True"):
        gso.tno.optimize(design, options=gso.RuledOptions(flats=True), constraints=[mirror])


def test_bends_keep_the_smallest_radius():
    u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    design = 10.0 * np.stack([u, v, 0.3 * u * u * v + 0.2 * u * u], axis=-1)
    for least, kept in ((6.0, True), (200.0, False)):
        options = gso.RuledOptions(starts=("design",), min_radius=least)
        result = gso.tno.optimize(design, options=options)
        assert result.usable is kept
        assert (result.rulings.smallest_radius >= least) is kept
    assert result.status is gso.Status.TARGET_MISSED


def test_chords_follow_given_lines():
    there = domain(saddle(17, strength=0.25))
    given = np.array([there.flat[[3, 287]]])
    strips, places = chords(there, 17, given=given)
    p, q = places[strips.index[0]].transpose(1, 0, 2)
    way = (q - p) / np.linalg.norm(q - p, axis=1, keepdims=True)
    off = [np.abs((x - p)[:, 0] * way[:, 1] - (x - p)[:, 1] * way[:, 0]) for x in given[0]]
    assert np.maximum(*off).min() < 1e-9


def test_planar_faces_in_cad_files_share_edges(tmp_path):
    pytest.importorskip("OCP")
    rhino = pytest.importorskip("rhino3dm")
    result = gso.tno.optimize(saddle(17, strength=0.25), options=gso.RuledOptions(strips=2))
    for suffix in ("step", "iges", "3dm"):
        gso.io.save_faces(result.mesh, tmp_path / f"a.{suffix}", unit="cm")
    text = (tmp_path / "a.step").read_text(encoding="utf-8")
    assert text.count("ADVANCED_FACE") == len(result.mesh.faces)
    assert text.count("EDGE_CURVE") == len(result.mesh.edges)
    model = rhino.File3dm.Read(str(tmp_path / "a.3dm"))
    assert len(model.Objects) == len(result.mesh.faces)


def test_creases_do_not_zigzag():
    panel = gso.load(ROOT / "examples" / "panel.obj")
    result = gso.tno.optimize(panel, options=gso.RuledOptions(strips=4, starts=("design",)))
    assert result.metrics["crease_turn_max"] < 20.0
    edges = np.array([[0, 1], [1, 2], [3, 4]])
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 0, 0]])
    turns = Folds(edges, np.zeros(3), np.zeros(3)).turns(corner)
    np.testing.assert_allclose(turns, [0.5 * np.pi], atol=1e-12)


def test_trees_have_flat_regions_and_one_sheet():
    points = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 33)] * 2, indexing="ij"), axis=-1)
    x, y = points[..., 0], points[..., 1]
    # Three ridges that meet: a single family of rulings does not fit.
    design = np.dstack([x, y, 0.1 * (x**3 - 3.0 * x * y**2)])
    options = {"starts": ("design",)}
    one, tree = (
        gso.tno.optimize(design, options=gso.RuledOptions(flats=f, **options)) for f in (0, 1)
    )
    checked(tree, 8.0)
    assert tree.ruled.strips == 1
    assert tree.ruled.flat.any()
    assert not one.ruled.flat.any()
    assert tree.metrics["distance_mean"] < one.metrics["distance_mean"]
    with pytest.raises(gso.OptionError, match="single strip"):
        gso.RuledOptions(flats=True, strips=2)


def test_slits_count_with_their_depth():
    flat = np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))])
    mesh = Mesh.from_grid(flat)
    copy = np.arange(81).reshape(9, 9)
    faces = mesh.faces.copy()
    slit = np.isin(faces, copy[4, 5:]) & (np.arange(64) >= 32)[:, None]
    faces[slit] += 81
    points = np.concatenate([mesh.vertices, mesh.vertices])
    used = np.unique(faces)
    opened = Mesh(points[used], np.searchsorted(used, faces))
    there, back = metrics.boundary_distance(mesh, opened)
    assert there == pytest.approx(4.0)
    assert back == 0.0


def test_what_cannot_be_ruled_is_refused():
    t = np.linspace(0.0, 2.0 * np.pi, 33)
    tube = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), t[:, None]), axis=-1)
    faces = Mesh.from_grid(tube).faces
    with pytest.raises(gso.MeshError, match="boundary"):
        sphere = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0.0]])
        gso.tno.optimize(
            Mesh(sphere, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]), formulation="ruled"
        )
    two = np.concatenate([tube.reshape(-1, 3), tube.reshape(-1, 3) + 9.0])
    with pytest.raises(gso.MeshError, match="components"):
        gso.tno.optimize(
            Mesh(two, np.concatenate([faces, faces + tube[..., 0].size])), formulation="ruled"
        )
    with pytest.raises(gso.OptionError, match=r"take Fixed.*Ruling"):
        planar = gso.PlanarFaces()
        gso.tno.optimize(saddle(9), formulation="ruled", constraints=[planar])
    for wrong in ({"strips": 0}, {"strips": "many"}, {"rulings": 3}, {"starts": ("x",)}):
        with pytest.raises(gso.OptionError):
            gso.RuledOptions(**wrong)


def test_parts_that_touch_in_a_point_get_vertices_of_their_own():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    faces = np.array([[0, 1, 2, -1], [0, 3, 4, -1]])
    found, table = with_copies(points, faces)
    assert len(found) == 6
    assert len(np.intersect1d(table[0], table[1][:3])) == 0
    for row, own in zip(faces, table, strict=True):
        np.testing.assert_array_equal(found[own[:3]], points[row[:3]])
    # Two triangles that share an edge share its ends, unless they are different parts.
    pair = np.array([[0, 1, 2, -1], [0, 2, 3, -1]])
    assert len(copies(pair, np.array([0, 0]))[0]) == 4
    vertex, table = copies(pair, np.array([0, 1]))
    np.testing.assert_array_equal(vertex, [0, 1, 2, 0, 2, 3])
    np.testing.assert_array_equal(table, [[0, 1, 2, -1], [3, 4, 5, -1]])
