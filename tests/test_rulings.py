"""Rulings, curvatures and Gauss image, on surfaces where they are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

import gso
from gso import geometry, metrics
from gso.cli import main
from gso.mesh import topology
from gso.rulings import shape_operator, trace
from gso.rulings.walk import Field, walk
from tests.conftest import meshes, saddle, shuffled, sphere_cap


def skew(u, v):
    """Parameters whose lines cross the rulings at an angle, and not evenly."""
    s, t = 0.92 * u - 0.39 * v, 0.39 * u + 0.92 * v
    return s + 0.08 * np.sin(2 * t), t + 0.1 * s * s


def stack(*xyz):
    return np.stack(np.broadcast_arrays(*xyz), axis=-1)


# Each returns points, Gaussian and absolute mean curvature, and the ruling (or None).


def cylinder(u, v, radius=0.8):
    s, t = skew(u, v)
    points = stack(radius * np.sin(s / radius), t, radius * np.cos(s / radius))
    return points, 0.0 * s, 0.0 * s + 0.5 / radius, stack(0.0 * s, 1.0, 0.0)


def cone(u, v, half_angle=0.5):
    s, t = skew(u, v)
    t = t + 2.5
    ruling = stack(
        np.sin(half_angle) * np.cos(s), np.sin(half_angle) * np.sin(s), np.cos(half_angle)
    )
    return t[..., None] * ruling, 0.0 * s, 0.5 / (t * np.tan(half_angle)), ruling


def tangents_of_helix(u, v, a=1.0, b=0.6):
    s, t = skew(u, v)
    t, c = t + 2.2, np.hypot(a, b)
    ruling = stack(-a * np.sin(s / c), a * np.cos(s / c), b) / c
    helix = stack(a * np.cos(s / c), a * np.sin(s / c), b * s / c)
    return helix + t[..., None] * ruling, 0.0 * s, 0.5 * b / (a * t), ruling


def torus(u, v, large=2.0, small=0.8):
    s, t = skew(u, v)
    r = large + small * np.cos(t)
    points = stack(r * np.cos(s), r * np.sin(s), small * np.sin(t))
    one, two = 1.0 / small, np.cos(t) / r
    return points, one * two, 0.5 * (one + two), stack(-np.sin(s), np.cos(s), 0.0)


def ellipsoid(u, v, axes=(1.0, 1.4, 0.8)):
    s, t = skew(u, v)
    t = 0.6 * t
    points = stack(np.cos(t) * np.cos(s), np.cos(t) * np.sin(s), np.sin(t)) * axes
    h = ((points / np.square(axes)) ** 2).sum(axis=-1)
    product = np.prod(np.square(axes))
    excess = np.abs((points**2).sum(axis=-1) - np.square(axes).sum())
    return points, 1.0 / (product * h**2), excess / (2.0 * product * h**1.5), None


DEVELOPABLE = [cylinder, cone, tangents_of_helix]
SURFACES = [*DEVELOPABLE, torus, ellipsoid]


def parameters(n, middle=False):
    u = np.linspace(-1.0, 1.0, n)
    u = (u[1:] + u[:-1]) / 2 if middle else u
    return np.meshgrid(u, u, indexing="ij")


def grid(surface, n):
    return gso.Mesh.from_grid(surface(*parameters(n))[0])


def errors(surface, mesh, u, v):
    """Errors of K, H and, where there is one, the ruling's sine, per face."""
    _, gaussian, mean, ruling = surface(u, v)
    shape = shape_operator(mesh)
    assert np.allclose(shape.curvatures.mean(axis=1), shape.H)
    out = [shape.K - gaussian, np.abs(shape.H) - mean]
    if ruling is not None:
        out.append(np.linalg.norm(np.cross(shape.rulings, ruling), axis=1))
    return np.abs(out)


@pytest.mark.parametrize("surface", SURFACES)
def test_second_order_on_grids_up_to_the_boundary(surface):
    found = []
    for n in (25, 97):
        u, v = (p.ravel() for p in parameters(n, middle=True))
        e = errors(surface, grid(surface, n), u, v)
        inner = np.maximum(np.abs(u), np.abs(v)) < 0.7
        found.append([np.sqrt((e**2).mean(axis=1)), e[:, inner].max(axis=1), e.max(axis=1)])
    coarse, fine = found
    mean, inside, everywhere = (
        np.log(c / f) / np.log(4.0) for c, f in zip(coarse, fine, strict=True)
    )
    assert (mean > 1.9).all()
    assert (inside > 1.3).all()
    assert (everywhere > 1.6).all()
    assert fine[1].max() < 1e-4
    assert fine[2].max() < 5e-3


def triangles(n):
    """Parameters and faces of an irregular triangulation of the square."""
    rng = np.random.default_rng(0)
    u, v = parameters(n)
    shift = rng.uniform(-0.6, 0.6, (2, n, n)) / (n - 1)
    shift[0, [0, -1]], shift[1, :, [0, -1]] = 0.0, 0.0
    points = np.stack([u + shift[0], v + shift[1]], axis=-1).reshape(-1, 2)
    return points, Delaunay(points).simplices


def quads(n):
    points, _ = triangles(n)
    return points, topology.grid_faces(n, n)


@pytest.mark.parametrize("layout", [triangles, quads])
@pytest.mark.parametrize("surface", [cylinder, tangents_of_helix, torus])
def test_first_order_on_irregular_meshes(layout, surface):
    found = []
    for n in (17, 65):
        points, faces = layout(n)
        mesh = gso.Mesh(surface(*points.T)[0], faces)
        e = errors(surface, mesh, *points[faces].mean(axis=1).T)
        found.append(np.sqrt((e**2).mean(axis=1)))
        assert np.percentile(e, 99) < 1.5 / n
    assert (np.log(found[0] / found[1]) / np.log(4.0) > 0.9).all()


def test_curvature_is_the_ratio_of_determinants():
    mesh = grid(torus, 9)
    shape, image = shape_operator(mesh), gso.rulings.gauss_image(mesh)
    v, n = mesh.vertices[mesh.faces], image[mesh.faces]

    def det(p):
        return (np.cross(p[:, 3] - p[:, 1], p[:, 2] - p[:, 0]) * shape.normals).sum(axis=1)

    assert np.allclose(shape.K, det(n) / det(v), rtol=1e-12)
    assert shape.gauss_area == pytest.approx(0.5 * np.abs(det(n)).sum())
    assert np.allclose(shape.areas, 0.5 * np.abs(det(v)))


def test_shape_operators_of_every_kind_of_number():
    torch = pytest.importorskip("torch")
    vectors = np.random.default_rng(0).standard_normal((4, 3))
    s = np.array(geometry.shape_matrix(*map(tuple, vectors)))
    frame = np.stack(geometry.tangent_frame(*map(tuple, vectors[:2])))
    assert np.allclose(frame @ frame.T, np.eye(3))
    a, b, da, db = vectors @ frame[:2].T
    assert np.allclose(s @ np.stack([a, b], axis=1), np.stack([da, db], axis=1))
    again = geometry.shape_matrix(*(tuple(torch.tensor(v)) for v in vectors))
    assert np.allclose(np.array([[float(x) for x in row] for row in again]), s)
    high, low, angle = geometry.eigen(s[0, 0], s[0, 1], s[1, 1])
    symmetric = np.array([[s[0, 0], s[0, 1]], [s[0, 1], s[1, 1]]])
    assert np.allclose(np.linalg.eigvalsh(symmetric), [low, high])
    vector = np.array([np.cos(angle), np.sin(angle)])
    assert np.allclose(symmetric @ vector, high * vector)


def test_gauss_image_satisfies_the_relation_of_jiang():
    unit, scaled = [], []
    for n in (17, 33):
        mesh = grid(torus, n)
        image, faces, normals = (
            gso.rulings.gauss_image(mesh),
            mesh.faces,
            metrics.face_normals(mesh),
        )
        cosine = (image[faces] * normals[:, None]).sum(axis=2)
        mean = np.bincount(faces.ravel(), cosine.ravel()) / np.bincount(faces.ravel())

        def defect(points, faces=faces, normals=normals):
            ends = points[faces] + np.roll(points[faces], -1, axis=1)
            return np.abs((ends * normals[:, None]).sum(axis=2) - 2.0).max(axis=1)

        inside = ~mesh.half_edges.boundary_vertex[faces].any(axis=1)
        unit.append(defect(image).max())
        scaled.append(defect(image / mean[:, None])[inside].max())
    assert unit[0] / unit[1] > 2**1.8
    assert scaled[0] / scaled[1] > 2**2.8


def test_rotation_scale_and_numbering_change_nothing():
    mesh = grid(torus, 12)
    turn = Rotation.from_rotvec([0.3, 1.0, -0.2]).as_matrix()
    shape = shape_operator(mesh)
    moved = shape_operator(mesh.replaced(50.0 * mesh.vertices @ turn.T + 1e3))
    assert np.allclose(moved.K, shape.K / 2500.0, rtol=1e-7)
    assert np.allclose(moved.H, shape.H / 50.0, rtol=1e-7)
    assert np.allclose(moved.normals, shape.normals @ turn.T, atol=1e-7)
    cosine = (moved.rulings * (shape.rulings @ turn.T)).sum(axis=1)
    assert np.allclose(np.abs(cosine), 1.0)
    assert moved.thickness == pytest.approx(shape.thickness)
    assert moved.gauss_area == pytest.approx(shape.gauss_area)
    mixed = shape_operator(shuffled(mesh))
    order, other = (np.lexsort(s.points.round(9).T) for s in (shape, mixed))
    assert np.allclose(shape.points[order], mixed.points[other])
    assert np.allclose(shape.K[order], mixed.K[other])
    assert np.allclose(shape.curvatures[order], mixed.curvatures[other])


@pytest.mark.parametrize("factor", [1e-80, 1e80])
def test_any_unit_of_length(factor):
    mesh = grid(cone, 12)
    other = mesh.replaced(factor * mesh.vertices)
    assert np.allclose(shape_operator(other).H * factor, shape_operator(mesh).H)
    here, there = trace(mesh, count=4), trace(other, count=4)
    for one, two in zip(here.lines, there.lines, strict=True):
        assert np.allclose(two / factor, one)


def test_signs_follow_the_orientation():
    mesh = gso.Mesh.from_grid(sphere_cap(17, radius=2.0))
    assert (metrics.face_normals(mesh)[:, 2] > 0).all()
    shape = shape_operator(mesh)
    assert np.allclose(shape.H, 0.5, rtol=2e-3)
    assert np.allclose(shape.K, 0.25, rtol=4e-3)
    under = shape_operator(gso.Mesh(mesh.vertices, topology.reverse(mesh.faces)))
    assert np.allclose(under.H, -shape.H, rtol=1e-9)
    assert np.allclose(under.K, shape.K, rtol=1e-9)
    curved_both_ways = shape_operator(saddle(17))
    assert (curved_both_ways.K < 0).all()
    assert (curved_both_ways.curvatures.prod(axis=1) < 0).all()


def test_gauss_images_of_spheres_and_developable_surfaces():
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3, radius=2.0)
    shape = shape_operator((ball.vertices, ball.faces))
    assert shape.gauss_area == pytest.approx(4.0 * np.pi, rel=0.01)
    assert shape.thickness == pytest.approx(1.0, abs=0.01)
    for surface in DEVELOPABLE:
        assert shape_operator(grid(surface, 33)).thickness < 1e-3


def test_planes_have_no_rulings():
    for mesh in (saddle(6, strength=0.0), meshes()["triangles"].vertices * [1, 1, 0]):
        if mesh.ndim == 2:
            mesh = (mesh, meshes()["triangles"].faces)
        shape = shape_operator(mesh)
        for values in (shape.K, shape.H, shape.curvatures):
            assert np.abs(values).max() < 1e-9
        assert shape.flat.all()
        assert (shape.rulings == 0.0).all()
        assert shape.thickness == 0.0
        rulings = trace(mesh)
        assert len(rulings) == len(rulings.lines) == rulings.straightness.size == 0


@pytest.mark.parametrize(
    "kind", ["grid", "triangles", "quads", "pole", "quad", "triangle", "fan", "thin"]
)
def test_odd_meshes_give_numbers(kind):
    turn = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    fan = np.c_[np.cos(turn), np.sin(turn), 0 * turn]
    around = np.arange(200)
    odd = {
        "quad": ([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0]], [[0, 1, 2, 3]]),
        "triangle": ([[0, 0, 0], [1, 0, 0], [9, 9, 9], [0, 1, 0.5]], [[0, 1, 3]]),
        "fan": (
            np.r_[fan, [[0.0, 0.0, 1.0]]],
            np.c_[around, np.roll(around, -1), np.full(200, 200)],
        ),
    }
    odd["thin"] = (
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0.3], [0, 1, 0.2], [2, 1, 0.9]],
        [[0, 1, 2, 3], [0, 3, 4, -1], [3, 2, 5, -1]],
    )
    mesh = gso.Mesh(*odd[kind]) if kind in odd else meshes()[kind]
    with np.errstate(all="raise", under="ignore"):
        shape, rulings = shape_operator(mesh), trace(mesh, count=4)
    for name in ("points", "normals", "areas", "K", "H", "curvatures", "directions"):
        assert np.isfinite(getattr(shape, name)).all(), name
        assert len(getattr(shape, name)) == len(mesh.faces)
    assert np.allclose(np.linalg.norm(shape.directions, axis=2), 1.0)
    assert np.allclose(shape.directions @ shape.normals[..., None], 0.0, atol=1e-12)
    image = gso.rulings.gauss_image(mesh)
    assert np.allclose(np.linalg.norm(image, axis=1), mesh.used)
    assert all(np.isfinite(line).all() and len(line) > 1 for line in rulings.lines)


def test_lines_are_straight_to_second_order():
    for surface in DEVELOPABLE:
        off = [trace(grid(surface, n), count=12).straightness.mean() for n in (17, 65)]
        assert off[0] / off[1] > 4**1.6
        assert off[1] < 1e-3


def test_lines_run_where_the_rulings_are():
    found = []
    for n in (17, 65):
        rulings = trace(grid(cone, n), count=12)
        assert rulings.complete.all()
        ends = np.array([(line[0], line[-1]) for line in rulings.lines])
        # All rulings of this cone pass through the origin.
        miss = np.linalg.norm(np.cross(ends[:, 0], ends[:, 1] - ends[:, 0]), axis=1)
        long = rulings.lengths > 0.5
        found.append((miss / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))[long].max())
    assert found[0] / found[1] > 4**1.5
    assert found[1] < 1e-3


@pytest.mark.parametrize("kind", ["grid", "triangles"])
def test_lines_are_evenly_spread(kind):
    radius, n = 0.8, 33
    u, v = parameters(n)
    points = stack(radius * np.sin(u / radius), v, radius * np.cos(u / radius))
    mesh = gso.Mesh.from_grid(points)
    if kind == "triangles":
        mesh = gso.Mesh(mesh.vertices, mesh.triangles)
    rulings = trace(mesh, count=8)
    assert len(rulings) == 8
    assert np.allclose(rulings.lengths, 2.0, rtol=1e-4)
    at = np.sort([radius * np.arctan2(*line.mean(axis=0)[[0, 2]]) for line in rulings.lines])
    gaps = np.diff(np.r_[-1.0 - (at[0] + 1.0), at, 1.0 + (1.0 - at[-1])])
    assert gaps.max() < 2.0 * gaps.min()


def test_given_seeds_give_the_same_lines_in_any_frame():
    mesh = grid(tangents_of_helix, 21)
    seeds = mesh.vertices[[105, 220, 330]] + 1e-3
    turn = Rotation.from_rotvec([0.3, 1.0, -0.2]).as_matrix()
    here = trace(mesh, seeds=seeds)
    moved = shuffled(mesh.replaced(7.0 * mesh.vertices @ turn.T))
    there = trace(moved, seeds=7.0 * seeds @ turn.T)
    assert len(here) == len(there) == 3
    for one, two, seed in zip(here.lines, there.lines, seeds, strict=True):
        two = two @ turn / 7.0
        if np.linalg.norm(two[0] - one[0]) > np.linalg.norm(two[-1] - one[0]):
            two = two[::-1]
        # Quads of a mesh in disorder may be split along the other diagonal.
        assert np.allclose(two[[0, -1]], one[[0, -1]], atol=0.15)
        assert np.linalg.norm(one - seed, axis=1).min() < 0.2


def test_lines_end_at_holes():
    n = 25
    u, v = parameters(n)
    mesh = gso.Mesh.from_grid(stack(np.sin(u), v, np.cos(u)))
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    inside = (np.abs(middle[:, :2]) < 0.4).all(axis=1)
    rulings = trace(gso.Mesh(mesh.vertices, mesh.faces[~inside]), count=16)
    assert rulings.complete.all()
    short = rulings.lengths < 1.0
    assert short.any()
    assert not short.all()
    for line in rulings.lines:
        assert not (np.abs(line[:, :2]) < 0.3).all(axis=1).any()


def test_lines_end_before_flat_regions():
    u, v = parameters(41)
    # Flat for u < 0, and a cylinder whose axis is at an angle to its border.
    s = np.maximum(u + 0.3 * v, 0.0)
    mesh = gso.Mesh.from_grid(stack(u, v, 0.3 * s**2))
    rulings = trace(mesh, count=10, flat=0.1)
    assert rulings.complete.all()
    middles = np.array([line.mean(axis=0) for line in rulings.lines])
    assert (middles[:, 0] + 0.3 * middles[:, 1] > -0.15).all()
    assert rulings.straightness.max() < 0.02
    shape = shape_operator(mesh, flat=0.1)
    far = shape.points[:, 0] + 0.3 * shape.points[:, 1] < -0.2
    assert shape.flat[far].all()
    assert (shape.rulings[far] == 0.0).all()


def test_lines_in_the_flat_image():
    radius, n = 0.8, 33
    u, v = skew(*parameters(n))
    mesh = gso.Mesh.from_grid(stack(radius * np.sin(u / radius), v, radius * np.cos(u / radius)))
    rulings = trace(mesh, count=6)
    flat = rulings.on(np.stack([u.ravel(), v.ravel()], axis=1))
    for plane, space in zip(flat, rulings.lines, strict=True):
        assert plane.shape == (len(space), 2)
        assert np.ptp(plane[:, 0]) < 5e-3
        assert np.allclose(plane[:, 1], space[:, 1])
    with pytest.raises(gso.MeshError, match=r"per vertex \(1089\)"):
        rulings.on(np.zeros((5, 2)))


def test_a_line_between_two_regions_goes_along_their_common_side():
    y, x = np.mgrid[:3, :9].astype(float)
    mesh = gso.Mesh.from_grid(stack(x, y, 0.0))
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    slope = np.where(middle[:, 1] < 1.0, 0.3, -0.3)
    field = Field.along(mesh, stack(1.0, slope, 0.0), np.zeros(len(middle), bool))
    start = np.array([np.linalg.norm(middle - [1.0, 0.5, 0.0], axis=1).argmin()])
    steps = walk(mesh, field, start, np.ones(1))
    assert steps.arrived.all()
    corners = mesh.vertices[mesh.triangles[steps.triangle]]
    points = (steps.weights[..., None] * corners).sum(axis=1)
    assert points[-1, 0] == pytest.approx(8.0)
    late = points[:, 0] > 5.0
    assert np.abs(points[late, 1] - 1.0).max() < 5e-3
    assert (np.diff(points[:, 0]) > -1e-2).all()


def test_a_few_lines_lie_in_the_middles_of_their_shares():
    u, v = parameters(33)
    rulings = trace(gso.Mesh.from_grid(stack(u, v, 0.3 * u**2)), count=3)
    at = np.sort([line[:, 0].mean() for line in rulings.lines])
    assert np.allclose(at, [-2 / 3, 0.0, 2 / 3], atol=0.12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 0}, "count=0"),
        ({"count": 2.5}, r"count=2\.5"),
        ({"flat": -1.0}, r"flat=-1\.0"),
        ({"flat": "no"}, "flat='no'"),
        ({"flat": np.nan}, "flat=nan"),
        ({"seeds": [0, 1]}, "seeds"),
        ({"seeds": [[0, 1, np.inf]]}, "seeds"),
        ({"seeds": "here"}, "seeds"),
    ],
)
def test_mistakes_are_named(options, words):
    with pytest.raises(gso.OptionError, match=words):
        trace(saddle(), **options)


def test_lines_as_files(tmp_path):
    lines = trace(saddle(), count=3).lines
    path = tmp_path / "lines.obj"
    gso.io.save_lines(lines, path)
    rows = [row.split() for row in path.read_text().splitlines()]
    points = np.array([row[1:] for row in rows if row[0] == "v"], float)
    index = [np.array(row[1:], int) - 1 for row in rows if row[0] == "l"]
    assert len(index) == len(lines)
    for number, line in zip(index, lines, strict=True):
        assert np.array_equal(points[number], line)
    for bad in ([[0.0, 0.0, 0.0]], np.zeros((3, 2)), np.full((2, 3), np.nan), "line"):
        with pytest.raises(gso.MeshError, match="line 1"):
            gso.io.save_lines([lines[0], bad], path)
    assert path.exists()


def test_lines_in_a_drawing(tmp_path):
    mesh = gso.Mesh.from_grid(saddle())
    path = tmp_path / "pattern.svg"
    flat = mesh.vertices[:, :2]
    gso.io.save_flat(flat, mesh, path, lines=trace(mesh, count=3).on(flat))
    text = path.read_text()
    layer = text[text.index('id="lines"') : text.index('id="outline"')]
    assert layer.count("<path") == 3
    gso.io.save_flat(flat, mesh, path)
    assert 'id="lines"' not in path.read_text()
    with pytest.raises(gso.MeshError, match="line 0"):
        gso.io.save_flat(flat, mesh, path, lines=[np.zeros((4, 3))])


def test_pictures_on_the_command_line(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    gso.save(saddle(), "small.obj")
    gso.tno.optimize("small.obj", options="fast").save("full.npz")
    for words in (["small.obj"], ["small.obj", "--before", "small.obj"], ["full.npz"]):
        done = CliRunner().invoke(main, ["plot", *words, "-o", "out.png", "--rulings", "5"])
        assert done.exit_code == 0, done.output
        assert Path("out.png").stat().st_size > 1000
        Path("out.png").unlink()
    done = CliRunner().invoke(
        main, ["plot", "small.obj", "-o", "out.png", "--rulings", "5", "--color", "none"]
    )
    assert done.exit_code == 1
    assert "--rulings and --color" in done.stderr
