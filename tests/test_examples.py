"""The shapes in examples/: what their sources say about them holds."""

from __future__ import annotations

import doctest
import importlib
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import gso

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture(autouse=True)
def examples_on_path(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))


def load(name):
    if name == "terrain":
        pytest.importorskip("matplotlib")
    if name == "sheet_metal":
        pytest.importorskip("OCP", exc_type=ImportError)
    return importlib.import_module(name)


@cache
def whole(name):
    """Vertices and faces of a design of whole.py, read only."""
    vertices, faces = load("whole").DESIGNS[name]()
    for array in (vertices, faces):
        array.flags.writeable = False
    return vertices, faces


class Connectivity:
    """Edges, valences and boundary loops of oriented faces."""

    def __init__(self, faces):
        self.faces = faces
        sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        self.directed = Counter(map(tuple, sides.tolist()))
        self.edges = {tuple(sorted(e)) for e in self.directed}
        self.boundary = {a: b for a, b in self.directed if (b, a) not in self.directed}
        self.boundary_sides = sum((b, a) not in self.directed for a, b in self.directed)

    def is_manifold(self):
        """No directed edge twice, and one boundary edge at most leaves each vertex."""
        once = max(self.directed.values()) == 1
        return once and len(self.boundary) == self.boundary_sides

    def loops(self):
        left, count = dict(self.boundary), 0
        while left:
            start, vertex = left.popitem()
            while vertex != start:
                vertex = left.pop(vertex)
            count += 1
        return count

    def components(self):
        return self.pieces().max() + 1

    def pieces(self):
        """Number of the component of each vertex."""
        i, j = np.array(sorted(self.edges)).T
        size = self.faces.max() + 1
        return connected_components(coo_array((np.ones(len(i)), (i, j)), (size, size)), False)[1]

    def inner_valences(self):
        valence = Counter(v for e in self.edges for v in e)
        return Counter(n for v, n in valence.items() if v not in self.boundary)


def corner_angles(vertices, faces):
    p = vertices[faces]
    ahead, behind = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    cosine = np.sum(ahead * behind, axis=-1) / (
        np.linalg.norm(ahead, axis=-1) * np.linalg.norm(behind, axis=-1)
    )
    return np.degrees(np.arccos(cosine))


def normals(vertices, faces):
    p = vertices[faces]
    return np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])


def rotated(net, turns):
    """Control points turned about z by quarter turns, as a sorted set of points."""
    turn = np.linalg.matrix_power(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), turns)
    points = np.round(net.reshape(-1, 3) @ turn.T, 9) + 0.0
    return sorted(map(tuple, points.tolist()))


def read_obj(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([r[1:] for r in rows if r[0] == "v"], float)
    faces = np.array([r[1:] for r in rows if r[0] == "f"], int) - 1
    return vertices, faces


@pytest.mark.parametrize(
    "name", ["_write", "_sheets", "teapot", "terrain", "great_court", "irregular", "whole"]
)
def test_docstrings_hold(name):
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    assert doctest.testmod(load(name), optionflags=flags).failed == 0


def test_teapot_table_is_complete():
    numbers = np.loadtxt(EXAMPLES / "teapot_patches.csv", delimiter=",", dtype=int)
    vertices = np.loadtxt(EXAMPLES / "teapot_vertices.csv", delimiter=",")
    assert vertices.shape == (306, 3)
    assert numbers.shape == (32, 16)
    # Newell's knob had a hole of radius 0.002 on top; the printed patches close it.
    assert set(range(1, 307)) - set(numbers.ravel().tolist()) == {205, 206, 216, 223}


@pytest.mark.parametrize("first", [0, 4, 8, 20, 24, 28])
def test_teapot_parts_have_fourfold_symmetry(first):
    net = load("teapot").control_net()
    # All parts but the bottom go round clockwise.
    sign = 1 if first == 28 else -1
    for k in range(4):
        assert rotated(net[first], sign * k) == rotated(net[first + k], 0)


@pytest.mark.parametrize("k", [12, 14, 16, 18])
def test_teapot_handle_and_spout_are_mirror_symmetric(k):
    net = load("teapot").control_net()
    np.testing.assert_array_equal(net[k][:, ::-1] * [1, -1, 1], net[k + 1])


def test_teapot_patches_join_except_at_the_known_gaps():
    teapot = load("teapot")
    edges = {}
    poles = 0
    for k in range(32):
        g = np.round(teapot.patch(k, 5), 9) + 0.0
        # Each side in the direction that leaves the patch on its left.
        for side in (g[:, 0], g[-1], g[::-1, -1], g[0, ::-1]):
            if np.ptp(side, axis=0).max() == 0:
                poles += 1
                continue
            line = tuple(map(tuple, side.tolist()))
            assert line not in edges, "two patches run along this edge in one direction"
            edges[line] = k
    free = Counter(k // 4 for line, k in edges.items() if line[::-1] not in edges)
    assert poles == 8
    # Rim to lid on both sides, and both ends of handle and spout.
    assert free == {0: 4, 6: 4, 3: 4, 4: 4}


def test_teapot_surface_has_the_known_size_and_faces_out():
    teapot = load("teapot")
    p = teapot.patches(33)
    assert p.shape == (32, 33, 33, 3)
    np.testing.assert_allclose(p.min(axis=(0, 1, 2)), [-3, -2, 0], atol=1e-12)
    np.testing.assert_allclose(p.max(axis=(0, 1, 2)), [3.434, 2, 3.15], atol=5e-4)
    body = p[4:12]
    n = np.cross(body[:, 1:, :-1] - body[:, :-1, :-1], body[:, :-1, 1:] - body[:, :-1, :-1])
    assert np.all(np.sum((n * body[:, :-1, :-1])[..., :2], axis=-1) > 0)


def test_teapot_rejects_a_patch_that_does_not_exist():
    with pytest.raises(ValueError, match="0 to 31"):
        load("teapot").patch(32)


def test_panel_is_the_patch_the_script_makes():
    teapot = load("teapot")
    path = EXAMPLES / "panel.obj"
    vertices, faces = read_obj(path)
    assert path.stat().st_size < 100_000
    assert faces.shape == (1024, 4)
    expected = teapot.patch(teapot.PANEL, 33).reshape(-1, 3)
    np.testing.assert_allclose(vertices, expected, atol=6e-7)
    np.testing.assert_array_equal(faces, load("_write").grid_faces(33, 33))


def test_terrain_is_in_metres():
    grid = load("terrain").terrain()
    assert grid.shape == (344, 403, 3)
    east, north = grid[0, 1, 0] - grid[0, 0, 0], grid[0, 0, 1] - grid[1, 0, 1]
    # A nautical mile is a minute of latitude, that is 20 samples; the sphere is 1 % off.
    assert north == pytest.approx(1852 / 20, rel=0.01)
    assert east / north == pytest.approx(np.cos(np.radians(36.59)), rel=0.01)
    assert (grid[..., 2].min(), grid[..., 2].max()) == (236, 1076)
    np.testing.assert_allclose(grid[-1, 0, :2], 0)


def test_terrain_windows_are_cut_from_the_whole():
    terrain = load("terrain")
    whole = terrain.terrain()
    cut = terrain.terrain((10, 60, 100, 180), step=2)
    np.testing.assert_array_equal(cut, whole[10:60:2, 100:180:2])
    with pytest.raises(ValueError, match="344 x 403"):
        terrain.terrain((0, 345, 0, 10))


def test_great_court_has_its_heights_on_both_boundaries():
    g = load("great_court")
    t = np.linspace(0, 2 * np.pi, 101)
    np.testing.assert_allclose(g.height(g.A * np.cos(t), g.A * np.sin(t)), g.HEIGHT_CENTRE)
    x, y = np.linspace(-g.B, g.B, 51), np.linspace(-g.D, g.C, 51)
    for edge in (g.height(x, g.C), g.height(x, -g.D), g.height(g.B, y), g.height(-g.B, y)):
        np.testing.assert_allclose(edge, g.HEIGHT_EDGE, rtol=1e-14)


def published_height(x, y, a=22.245, b=36.625, c=46.025, d=51.125):
    """The formula at one point, written in the polar angle and with its divisions."""
    from math import atan2, cos, exp, hypot, sin

    r, theta = hypot(x, y), atan2(y, x)
    even, odd, s = 1 + cos(2 * theta), 1 - cos(2 * theta), sin(theta)
    psi = (1 - x / b) * (1 + x / b) * (1 - y / c) * (1 + y / d)
    eta = psi / (
        (1 - a * x / (r * b))
        * (1 + a * x / (r * b))
        * (1 - a * y / (r * c))
        * (1 + a * y / (r * d))
    )
    alpha = (r / a - 1) * psi
    z2 = (1 - 0.5) * (
        (35 + 10 * psi) * even / 2 + 24 / 2 * (odd / 2 + s) + (7.5 + 12 * psi) * (odd / 2 - s) - 1.6
    )
    z2 += -10 / 2 * even + 10 * ((odd / 2 + s) / 2) ** 2 * (1 - 3 * alpha)
    z2 += 2.5 * ((odd / 2 - s) / 2) ** 2 * (r / a - 1) ** 2
    beta = (1 - a / r) / sum(hypot(p, q) / (p * q) for p in (b - x, b + x) for q in (c - y, d + y))
    z3 = 0.5 * (3.5 / 2 * even + 3 / 2 * odd + 0.3 * s) + 1.05 * (
        exp(-14 * (1 - x / b)) + exp(-14 * (1 + x / b))
    ) * (exp(-14 * (1 - y / c)) + exp(-14 * (1 + y / d)))
    return (20.955 - 19.71) * eta + 19.71 + alpha * z2 + beta * z3


@pytest.mark.parametrize(
    "x, y", [(30, 1), (0, 35), (5, -40), (-36, 45.5), (-20, 20), (36.6, -51), (-25, -8)]
)
def test_great_court_is_the_published_formula(x, y):
    assert load("great_court").height(x, y) == pytest.approx(published_height(x, y), rel=1e-13)


def test_great_court_mesh_is_a_ring_over_its_plan():
    g = load("great_court")
    vertices, faces = g.roof()
    mesh = Connectivity(faces)
    assert (mesh.is_manifold(), mesh.components(), mesh.loops()) == (True, 1, 2)
    assert set(mesh.inner_valences()) == {4}
    assert np.all(normals(vertices, faces)[:, 2] > 0)
    np.testing.assert_allclose(vertices.min(axis=0), [-g.B, -g.D, g.HEIGHT_EDGE])
    np.testing.assert_allclose(vertices.max(axis=0)[:2], [g.B, g.C])
    # East and west mirror each other.
    np.testing.assert_allclose(g.quarter("east")[..., 2], g.quarter("west")[:, ::-1, 2], rtol=1e-12)


@pytest.mark.parametrize("side", ["south", "east", "north", "west"])
def test_great_court_quarter_runs_from_circle_to_side(side):
    g = load("great_court")
    grid = g.quarter(side, (9, 17))
    assert grid.shape == (9, 17, 3)
    np.testing.assert_allclose(np.hypot(grid[0, :, 0], grid[0, :, 1]), g.A)
    np.testing.assert_allclose(grid[-1, [0, -1], :2], g.SIDES[side])
    np.testing.assert_allclose(grid[-1, :, 2], g.HEIGHT_EDGE)


@pytest.mark.parametrize("name, loops", [("with_hole", 2), ("disk", 1), ("disk_with_hole", 2)])
def test_irregular_mesh(name, loops):
    vertices, faces = getattr(load("irregular"), name)()
    mesh = Connectivity(faces)
    assert 1500 <= len(faces) <= 4000
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    assert (mesh.is_manifold(), mesh.components(), mesh.loops()) == (True, 1, loops)
    assert len(vertices) - len(mesh.edges) + len(faces) == 2 - loops
    assert {3, 4, 5} <= set(mesh.inner_valences()) <= {3, 4, 5, 6, 7}
    angles = corner_angles(vertices, faces)
    assert angles.min() > 25
    assert angles.max() < 150
    outward = vertices[faces].mean(axis=1) * [1, 1, 0]
    assert np.all(np.sum(normals(vertices, faces) * outward, axis=1) > 0)


@pytest.mark.parametrize("name", ["with_hole", "disk"])
def test_irregular_mesh_lies_on_the_teapot(name):
    teapot = load("teapot")
    vertices, _ = getattr(load("irregular"), name)()
    # All four patches are one profile r(u), z(u) times one plane curve, so a vertex is on
    # the body if its angle gives it the distance from the axis that its height asks for.
    fine = np.linspace(0, 1, 2001)
    profile = teapot.point(4, fine, 0.0)
    radius = np.interp(-vertices[:, 2], -profile[:, 2], profile[:, 0])
    plane = teapot.point(4, 0.0, fine)[:, :2] / teapot.point(4, 0.0, 0.0)[0]
    angle = np.arctan2(-plane[:, 1], plane[:, 0])
    at = np.mod(-np.arctan2(vertices[:, 1], vertices[:, 0]), np.pi / 2)
    expected = radius * np.interp(at, angle, np.hypot(*plane.T))
    np.testing.assert_allclose(np.hypot(vertices[:, 0], vertices[:, 1]), expected, rtol=1e-6)


@pytest.mark.parametrize("name", ["with_hole", "disk"])
def test_a_cone_fits_the_irregular_mesh_within_one_percent(name):
    vertices, _ = getattr(load("irregular"), name)()
    radius, z = np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]
    slope = np.linspace(0, np.pi, 361)[:, None]
    across = radius * np.cos(slope) + z * np.sin(slope)
    miss = np.ptp(across, axis=1).min() / 2
    assert miss < 0.01 * np.linalg.norm(np.ptp(vertices, axis=0))


# Components, boundary loops, faces, smallest angle, size in millimetres.
WHOLE = {
    "sphere": (1, 0, 5120, 50, (1000, 1000, 1000)),
    "helmet": (1, 1, 2904, 24, (300, 247, 181)),
    "hull": (1, 1, 2632, 20, (6000, 1920, 1174)),
    "canopy": (1, 1, 6032, 20, (19916, 11335, 3218)),
    "quad_dome": (1, 1, 1680, 65, (14000, 11000, 3000)),
    "teapot": (4, 6, 7708, 12, (321.4, 200, 157.5)),
}


@pytest.mark.parametrize("name", WHOLE)
def test_whole_design(name):
    components, loops, count, angle, size = WHOLE[name]
    vertices, faces = whole(name)
    mesh = Connectivity(faces)
    assert len(faces) == count
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    assert (mesh.is_manifold(), mesh.components(), mesh.loops()) == (True, components, loops)
    # All components are spheres with holes.
    assert len(vertices) - len(mesh.edges) + len(faces) == 2 * components - loops
    assert len(np.unique(np.sort(faces, axis=1), axis=0)) == count
    angles = corner_angles(vertices, faces)
    assert angles.min() > angle
    assert angles.max() < (180 - 2 * angle if faces.shape[1] == 3 else 130)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), size, rtol=1e-3)
    checked = gso.Mesh(vertices, faces)
    np.testing.assert_array_equal(checked.faces, faces)
    if components == 1:
        assert checked.notes == ()


@pytest.mark.parametrize(
    "name, resolution, count",
    [
        ("sphere", 2, 320),
        ("helmet", 10, 600),
        ("hull", 6, 480),
        ("canopy", 8, 576),
        ("quad_dome", 10, 220),
        ("teapot", 8, 2152),
    ],
)
def test_whole_design_at_another_resolution(name, resolution, count):
    vertices, faces = load("whole").DESIGNS[name](resolution)
    mesh = Connectivity(faces)
    assert len(faces) == count
    assert (mesh.is_manifold(), mesh.components(), mesh.loops()) == (True, *WHOLE[name][:2])
    np.testing.assert_allclose(np.ptp(vertices, axis=0), WHOLE[name][4], rtol=0.03)


@pytest.mark.parametrize("name", ["sphere", "helmet", "teapot"])
def test_hollow_design_faces_out(name):
    vertices, faces = whole(name)
    piece = Connectivity(faces).pieces()[faces[:, 0]]
    for p in np.unique(piece):
        corners = vertices[faces[piece == p]]
        corners = corners - corners.mean(axis=(0, 1))
        assert np.linalg.det(corners).sum() > 0


@pytest.mark.parametrize("name, side", [("hull", -1), ("canopy", 1), ("quad_dome", 1)])
def test_open_design_faces_one_way(name, side):
    vertices, faces = whole(name)
    corners = vertices[faces]
    up = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])[:, 2]
    assert np.all(side * up > 0)


def test_sphere_has_its_radius_and_twelve_corners():
    vertices, faces = whole("sphere")
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 500)
    assert Connectivity(faces).inner_valences() == {5: 12, 6: 2550}


def test_quad_dome_has_four_irregular_vertices_and_its_formula():
    vertices, faces = whole("quad_dome")
    assert Connectivity(faces).inner_valences() == {3: 4, 4: 1621}
    x, y, z = vertices.T / 1000
    np.testing.assert_allclose(z, 3 * (1 - (x / 7) ** 2 - (y / 5.5) ** 2), atol=1e-9)


@pytest.mark.parametrize("name", ["helmet", "hull"])
def test_helmet_and_hull_are_mirror_symmetric(name):
    vertices, faces = whole(name)
    distance, other = cKDTree(vertices).query(vertices * [1, -1, 1])
    assert distance.max() < 1e-6
    mirrored = {frozenset(f) for f in other[faces].tolist()}
    assert mirrored == {frozenset(f) for f in faces.tolist()}


def test_hull_is_pointed_in_front_and_round_behind():
    vertices, _ = whole("hull")
    t = 0.5 - vertices[:, 0] / 6000
    sheer = 450 * (1 - t) ** 2 + 120 * t**2
    keel = 900 * (1 - (1 - t) ** 6) * np.sqrt(np.maximum(1 - t**4, 0))
    middle = np.abs(vertices[:, 1]) < 1e-6
    np.testing.assert_allclose(vertices[middle, 2], (sheer - keel)[middle], atol=1e-6)
    top = np.abs(vertices[:, 2] - sheer) < 1e-6
    breadth = 1100 * (1 - (1 - t) ** 3) * np.sqrt(np.maximum(1 - t**4, 0))
    np.testing.assert_allclose(np.abs(vertices[top, 1]), breadth[top], atol=1e-3)


def test_canopy_is_curved_both_ways():
    vertices, faces = whole("canopy")
    curvature = np.full(len(vertices), 2 * np.pi)
    np.subtract.at(curvature, faces, np.radians(corner_angles(vertices, faces)))
    inner = np.setdiff1d(np.arange(len(vertices)), list(Connectivity(faces).boundary))
    assert 0.2 < np.mean(curvature[inner] > 0) < 0.8


def test_whole_teapot_lies_on_its_patches():
    teapot = load("teapot")
    vertices = whole("teapot")[0] / 50
    t = np.linspace(0, 1, 65)
    grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    miss = np.full(len(vertices), np.inf)
    for k in range(32):
        distance, nearest = cKDTree(teapot.point(k, *grid.T)).query(vertices)
        near = np.flatnonzero(distance < 0.05)
        at = grid[nearest[near]]
        for _ in range(10):
            here = teapot.point(k, *at.T)
            ahead = [teapot.point(k, *(at + d).T) - here for d in 1e-6 * np.eye(2)]
            inverse = np.linalg.pinv(np.stack(ahead, axis=-1) / 1e-6, rcond=1e-6)
            move = np.einsum("nij,nj->ni", inverse, vertices[near] - here)
            at = np.clip(at + move, 0, 1)
        left = np.linalg.norm(teapot.point(k, *at.T) - vertices[near], axis=1)
        miss[near] = np.minimum(miss[near], left)
    assert miss.max() < 1e-6


@pytest.mark.parametrize(
    "name, options, files",
    [
        ("teapot", ["-n", "3"], 32),
        ("terrain", ["--step", "40"], 2),
        ("great_court", [], 5),
        ("irregular", [], 3),
        ("whole", [], 6),
        ("whole", ["sphere", "helmet"], 2),
        ("sheet_metal", [], 2),
    ],
)
def test_scripts_write_their_files(name, options, files, tmp_path, monkeypatch):
    module = load(name)
    monkeypatch.setattr(sys, "argv", [name, "-o", str(tmp_path / "out"), *options])
    module.main()
    written = sorted((tmp_path / "out").iterdir())
    assert len(written) == files
    for path in written:
        if path.suffix == ".obj":
            vertices, faces = read_obj(path)
            assert np.isfinite(vertices).all()
            assert (faces.min(), faces.max()) == (0, len(vertices) - 1)


def test_fox_is_closed_symmetric_and_as_high_as_it_says():
    vertices, faces = load("fox").fox()
    found = Connectivity(faces)
    assert found.is_manifold() and not found.boundary and found.components() == 1
    assert np.ptp(vertices[:, 2]) == 79.0
    mirrored = vertices * [1, -1, 1]
    assert cKDTree(vertices).query(mirrored)[0].max() < 1e-12
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert np.einsum("td,td->", a, np.cross(b, c)) > 0


def test_scan_is_the_helmet_with_noise():
    helmet, _ = whole("helmet")
    noise = load("scan").scan()[0] - helmet
    assert noise.std() == pytest.approx(load("scan").NOISE, rel=0.03)


def test_duct_unrolls_to_pipes_of_its_radius(tmp_path):
    made = load("sheet_metal")
    made.write(made.duct(), tmp_path / "duct.step")
    made.write(made.bracket(), tmp_path / "bracket.step")
    found = gso.recognition.recognise(gso.load(tmp_path / "duct.step"))
    assert [face.kind for face in found.faces] == ["cylinder"] * 3
    for face in found.faces:
        assert face.radius == pytest.approx(made.PIPE, rel=1e-9)
    job = gso.fabricate(tmp_path / "bracket.step", tmp_path / "job", formats=("svg",), workers=0)
    (part,) = job.parts
    straight = sum(made.FLANGES) - 2 * (made.INNER + made.THICK)
    turn = 0.5 * np.pi * (made.INNER + 0.5 * made.THICK)
    np.testing.assert_allclose(part.size, [straight + turn, made.WIDTH], atol=1e-6)
