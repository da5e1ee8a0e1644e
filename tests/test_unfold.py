"""Nets of surfaces of flat faces, with truths from formulas."""

from __future__ import annotations

import itertools
import re
import time

import numpy as np
import pytest
import shapely
from click.testing import CliRunner
from scipy.spatial import ConvexHull

import gso
from gso import Mesh, MeshError, OptionError
from gso.cli import main
from gso.unfolding import join_patches
from gso.workshop import Finish, fitted, of_net, parts_from
from tests.conftest import cylinder, saddle, sphere_cap

GOLD = 0.5 * (1.0 + np.sqrt(5.0))
ROOT = np.sqrt(2.0)


def signed(*rows, even=False):
    """All signs and permutations, or the even ones, of rows of coordinates."""
    orders = [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
    if not even:
        orders = list(itertools.permutations(range(3)))
    out = {
        tuple(round(float(s * row[k]), 12) + 0.0 for s, k in zip(signs, order, strict=True))
        for row in rows
        for order in orders
        for signs in itertools.product((1, -1), repeat=3)
    }
    return np.array(sorted(out))


def hull(points):
    """The convex hull as triangles that face outwards."""
    made = ConvexHull(points)
    p = points[made.simplices]
    out = np.einsum(
        "td,td->t", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), made.equations[:, :3]
    )
    return points, np.where((out > 0)[:, None], made.simplices, made.simplices[:, ::-1])


def prism(outline, height):
    """The prism over a polygon, with a floor and a ceiling of one polygon each."""
    n = len(outline)
    points = np.r_[np.pad(outline, ((0, 0), (0, 1))), np.c_[outline, np.full(n, height)]]
    around = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return points, [list(range(n))[::-1], list(range(n, 2 * n)), *around]


def ring(n, radius, turn=0.0):
    angle = 2.0 * np.pi * np.arange(n) / n + turn
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def nut(n, outer=2.0, inner=1.0, height=0.8):
    """A prism with a hole of as many sides."""
    both = np.r_[ring(n, outer), ring(n, inner)]
    points = np.r_[np.pad(both, ((0, 0), (0, 1))), np.c_[both, np.full(2 * n, height)]]
    faces = []
    for k in range(n):
        m = (k + 1) % n
        faces += [
            [k, m, 2 * n + m, 2 * n + k],
            [n + m, n + k, 3 * n + k, 3 * n + m],
            [2 * n + k, 2 * n + m, 3 * n + m, 3 * n + k],
            [m, k, n + k, n + m],
        ]
    return points, faces


def gear(teeth):
    radii = np.tile([2.0, 2.0, 1.5, 1.5], teeth)
    angle = 2.0 * np.pi * np.arange(4 * teeth) / (4 * teeth)
    return prism(radii[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1), 1.0)


def box(open_by=110.0):
    """A box of 60 x 40 x 25 with a lid that stands open at one edge."""
    x, y, z, a = 60.0, 40.0, 25.0, np.radians(open_by)
    base = np.array([[0, 0], [x, 0], [x, y], [0, y]])
    lid = [[0, y - y * np.cos(a), z + y * np.sin(a)], [x, y - y * np.cos(a), z + y * np.sin(a)]]
    points = np.r_[np.pad(base, ((0, 0), (0, 1))), np.c_[base, np.full(4, z)], lid]
    faces = [[3, 2, 1, 0], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [6, 7, 8, 9]]
    return points, faces


PLATONIC = {
    # Points, faces, and the angle between neighbouring faces in degrees.
    "tetrahedron": (np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]), 4, 1 / 3),
    "cube": (signed((1, 1, 1)), 6, 0.0),
    "octahedron": (signed((1, 0, 0)), 8, -1 / 3),
    "dodecahedron": (
        np.r_[signed((1, 1, 1)), signed((0, 1 / GOLD, GOLD), even=True)], 12, -1 / np.sqrt(5)
    ),
    "icosahedron": (signed((0, 1, GOLD), even=True), 20, -np.sqrt(5) / 3),
}  # fmt: skip
ARCHIMEDEAN = {
    "truncated tetrahedron": (
        np.array([p for p in signed((3, 1, 1)) if np.prod(p) > 0]), 8
    ),
    "cuboctahedron": (signed((1, 1, 0)), 14),
    "truncated cube": (signed((ROOT - 1, 1, 1)), 14),
    "truncated octahedron": (signed((0, 1, 2)), 14),
    "rhombicuboctahedron": (signed((1, 1, 1 + ROOT)), 26),
    "truncated cuboctahedron": (signed((1, 1 + ROOT, 1 + 2 * ROOT)), 26),
    "icosidodecahedron": (
        np.r_[signed((0, 0, GOLD)), signed((0.5, 0.5 * GOLD, 0.5 * GOLD**2), even=True)], 32
    ),
    "truncated icosahedron": (
        signed((0, 1, 3 * GOLD), (1, 2 + GOLD, 2 * GOLD), (GOLD, 2, GOLD**3), even=True), 32
    ),
    "truncated dodecahedron": (
        signed(
            (0, 1 / GOLD, 2 + GOLD), (1 / GOLD, GOLD, 2 * GOLD), (GOLD, 2, GOLD + 1), even=True
        ), 32
    ),
    "rhombicosidodecahedron": (
        signed((1, 1, GOLD**3), (GOLD**2, GOLD, 2 * GOLD), (2 + GOLD, 0, GOLD**2), even=True), 62
    ),
}  # fmt: skip


def check(net):
    """What holds for every net: areas, no overlap, and the way back to the design."""
    p = net.mesh.vertices[net.mesh.faces]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()
    assert net.areas.sum() == pytest.approx(area, rel=1e-9)
    corners = net.pattern.flat[net.pattern.faces]
    sides, design = (np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2) for x in (corners, p))
    assert np.abs(sides - design).max() < 1e-9 * net.mesh.diagonal
    size = float(np.ptp(net.pattern.flat, axis=0).max())
    union = shapely.union_all(shapely.polygons(corners), grid_size=1e-11 * size).area
    assert union == pytest.approx(area, rel=1e-7)
    assert net.misfit() < 1e-6 * net.mesh.diagonal
    # All triangles of a part hang together.
    assert len(np.unique(net.pattern.mesh.components)) == len(net)
    return net


def made(points, faces, **options):
    return check(gso.unfold((points, faces), **options))


@pytest.mark.parametrize("name", PLATONIC)
def test_platonic_solids_are_one_part(name):
    points, count, cosine = PLATONIC[name]
    net = made(*hull(points))
    assert len(net) == 1
    assert len(net.angles) == count - 1
    assert np.abs(net.angles - (180.0 - np.degrees(np.arccos(cosine)))).max() < 1e-9
    edge = np.sort(np.linalg.norm(points[1:] - points[0], axis=1))[0]
    # The cut edges are a tree that reaches every vertex.
    assert net.cut_length == pytest.approx((len(points) - 1) * edge, rel=1e-9)


@pytest.mark.parametrize("name", ARCHIMEDEAN)
def test_archimedean_solids_are_one_part(name):
    points, count = ARCHIMEDEAN[name]
    net = made(*hull(points))
    edge = np.sort(np.linalg.norm(points[1:] - points[0], axis=1))[0]
    assert (len(net), len(net.angles)) == (1, count - 1)
    assert net.cut_length == pytest.approx((len(points) - 1) * edge, rel=1e-9)


def grid_of(points):
    """A torus of quads from points (h, w, 3), closed both ways."""
    h, w = points.shape[:2]
    r, c = np.divmod(np.arange(h * w), w)
    r1, c1 = (r + 1) % h, (c + 1) % w
    quads = np.stack([r * w + c, r * w + c1, r1 * w + c1, r1 * w + c], axis=1)
    return points.reshape(-1, 3), quads.tolist()


def torus(h=8, w=12):
    v, u = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (h, w)), indexing="ij")
    rho = 3.0 + np.cos(v)
    return grid_of(np.stack([rho * np.cos(u), rho * np.sin(u), np.sin(v)], axis=-1))


def hull_of_boat(stations=9):
    """The sides of a boat between keel, chine and gunwale, in triangles."""
    x = np.linspace(0.0, 1.0, stations)
    beam = np.sin(np.pi * (0.1 + 0.8 * x))
    lines = [
        (0.0 * x, 0.3 * (x - 0.4) ** 2),
        (0.22 * beam, 0.15 + 0 * x),
        (0.3 * beam, 0.4 + 0.1 * x),
    ]
    half = np.stack([np.stack([2.5 * x, y, z], axis=1) for y, z in lines])
    points = np.concatenate([half[2, :, :], half[1], half[0], half[1], half[2]])
    points[3 * stations :, 1] *= -1.0
    faces = []
    for row, k in itertools.product(range(4), range(stations - 1)):
        a, b = row * stations + k, (row + 1) * stations + k
        faces += [[a, b, a + 1], [b, b + 1, a + 1]]
    return points, faces


def tetrakis():
    """A cube with a pyramid on each face."""
    points, faces = PLATONIC["cube"][0], []
    tips = 1.5 * np.r_[np.eye(3), -np.eye(3)]
    for k, tip in enumerate(tips):
        own = np.flatnonzero(points @ tip > 1.0)
        middle = tip / np.linalg.norm(tip)
        x = np.eye(3)[(k + 1) % 3]
        turn = np.arctan2(points[own] @ np.cross(middle, x), points[own] @ x)
        around = own[np.argsort(turn)].tolist()
        faces += [[a, b, 8 + k] for a, b in itertools.pairwise([*around, around[0]])]
    return np.r_[points, tips], faces


def star(arms=5):
    radius = np.where(np.arange(2 * arms) % 2 == 0, 2.0, 0.8)
    outline = radius[:, None] * ring(2 * arms, 1.0)
    points = np.r_[np.pad(outline, ((0, 0), (0, 1))), [[0, 0, 0.5], [0, 0, -0.5]]]
    n = 2 * arms
    up = [[k, (k + 1) % n, n] for k in range(n)]
    return points, up + [[(k + 1) % n, k, n + 1] for k in range(n)]


def frustum(sides=6):
    points = np.r_[
        np.c_[ring(sides, 3.0), np.zeros(sides)], np.c_[ring(sides, 1.5), np.full(sides, 2.0)]
    ]
    return points, prism(ring(sides, 1.0), 1.0)[1]


def house():
    gable = np.array([[0, 0], [4, 0], [4, 3], [2, 5], [0, 3.0]])
    return prism(gable, 6.0)


ANGLE = np.array([[0, 0], [5, 0], [5, 2], [2, 2], [2, 6], [0, 6.0]])
SPHERE = np.r_[
    PLATONIC["icosahedron"][0] / np.sqrt(1 + GOLD**2), PLATONIC["dodecahedron"][0] / 3**0.5
]
LOW_POLY = {
    "gear": (gear(7), 1),
    "house": (house(), 1),
    "boat": (hull_of_boat(), 2),
    "nut": (nut(6), 1),
    "star": (star(), 1),
    "sphere": (hull(SPHERE), 1),
    "L-shaped box": (prism(ANGLE, 3.0), 1),
    "frustum": (frustum(), 1),
    "tetrakis cube": (tetrakis(), 1),
    "torus": (torus(), 3),
}


def edge_angles(points, faces):
    """Angles between neighbouring faces in degrees, each by its own normal."""
    normals = {}
    for face in faces:
        p = points[face]
        n = sum(np.cross(p[k] - p[0], p[k + 1] - p[0]) for k in range(1, len(p) - 1))
        for a, b in itertools.pairwise([*face, face[0]]):
            normals.setdefault((min(a, b), max(a, b)), []).append(n)
    pairs = {edge: both for edge, both in normals.items() if len(both) == 2}
    return {
        edge: float(np.degrees(np.arctan2(np.linalg.norm(np.cross(m, n)), m @ n)))
        for edge, (m, n) in pairs.items()
    }


@pytest.mark.parametrize("name", LOW_POLY)
def test_low_poly_models(name):
    (points, faces), most = LOW_POLY[name]
    net = made(points, faces)
    assert len(net) <= most
    angles = edge_angles(points, [list(map(int, face)) for face in faces])
    # Every angle is a fold or at a seam.
    cut = sum(angles.get(edge, 0.0) for edge in edges_of(net))
    assert np.abs(net.angles).sum() + cut == pytest.approx(sum(angles.values()), rel=1e-9)


@pytest.mark.parametrize(
    ("name", "most"), [("tetrahedron", 1.26), ("cube", 1.7), ("octahedron", 1.51)]
)
def test_outlines_are_compact(name, most):
    """A triangle of four, a cross in 3 x 4 squares turned to 10, six triangles in a row and two."""
    points, *_ = PLATONIC[name]
    net = made(*hull(points))
    box = shapely.minimum_rotated_rectangle(shapely.MultiPoint(net.pattern.flat))
    assert box.area < most * net.areas.sum()


@pytest.mark.parametrize("n", [3, 5, 8, 16])
def test_prisms(n):
    net = made(*prism(ring(n, 30.0), 80.0))
    assert len(net) == 1
    # All sides hang together at their longest edges, and floor and ceiling at one edge each.
    assert sorted(net.angles.round(6)) == sorted([round(360.0 / n, 6)] * (n - 1) + [90.0] * 2)
    side = 60.0 * np.sin(np.pi / n)
    assert net.cut_length == pytest.approx(80.0 + 2 * (n - 1) * side, rel=1e-9)


@pytest.mark.parametrize("n", [3, 4, 6, 12])
def test_nuts_are_one_part(n):
    net = made(*nut(n))
    assert len(net) == 1
    # In the plane the inner sides have no room in the holes: floor and ceiling are opened.
    assert "edges in flat faces were cut" in net.notes[-1]
    kinds = {90.0, round(360.0 / n, 6), -round(360.0 / n, 6)}
    assert set(net.angles.round(6).tolist()) <= kinds
    # Without a search the faces stay whole: one side hangs at each of 2 n + 2 others.
    whole = made(*nut(n), effort=0.0)
    assert len(whole.angles) == 2 * n + 2 - len(whole)


@pytest.mark.parametrize("teeth", [3, 6, 12])
def test_gears_are_one_part(teeth):
    net = made(*gear(teeth))
    assert len(net) == 1
    assert len(net.angles) == 4 * teeth + 1


@pytest.mark.parametrize("angle", [20.0, 110.0, 200.0])
def test_box_with_a_lid(angle):
    net = made(*box(angle))
    assert len(net) == 1
    assert len(net.angles) == 5
    assert net.areas.sum() == pytest.approx(2 * 60 * 40 + 2 * 25 * (60 + 40))
    lid = net.angles[np.argmin(np.abs(np.abs(net.angles) - abs(90.0 - angle)))]
    assert lid == pytest.approx(90.0 - angle, abs=1e-9)


def test_concave_faces_keep_their_area_from_every_corner():
    outline = np.array([[0, 0], [30, 0], [30, 10], [10, 10], [10, 30], [0, 30.0]])
    for k in range(6):
        net = made(np.pad(np.roll(outline, k, axis=0), ((0, 0), (0, 1))), [list(range(6))])
        assert net.areas.tolist() == pytest.approx([500.0])
        assert len(net.angles) == 0
    arrow = np.array([[0, 0, 0], [20, 10, 0], [0, 20, 0], [10, 10, 0.0]])
    for k in range(4):
        net = made(np.roll(arrow, k, axis=0), [[0, 1, 2, 3]])
        assert net.areas.tolist() == pytest.approx([100.0])


def test_faces_with_holes_and_straight_corners():
    """A hole that a bridge joins to the outline, and stairs with points on straight sides."""
    square = np.array([[0, 0], [4, 0], [4, 4], [0, 4], [1, 1], [1, 3], [3, 3], [3, 1.0]])
    net = made(np.pad(square, ((0, 0), (0, 1))), [[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]])
    assert net.areas.tolist() == pytest.approx([12.0])
    assert len(net.cut_edges) == 0
    k = np.arange(1.0, 13.0)
    up = np.stack([np.repeat(k, 2) - np.tile([1.0, 0.0], 12), np.repeat(k, 2)], axis=1)
    outline = np.r_[[[0.0, 0.0]], up, [[12.0, 6.0], [12.0, 0.0], [6.0, 0.0], [3.0, 0.0]]][::-1]
    net = made(*prism(outline, 5.0))
    assert len(net) == 1
    assert net.areas.sum() == pytest.approx(2 * 78 + 5 * (4 * 12))


@pytest.mark.parametrize("suffix", ["obj", "off"])
def test_files_with_concave_polygons(tmp_path, suffix):
    points, faces = gear(9)
    rows = [" ".join(f"{x:.17g}" for x in p) for p in points]
    start = 1 if suffix == "obj" else 0
    table = [[start + k for k in face] for face in faces]
    text = [f"v {row}" for row in rows] + ["f " + " ".join(map(str, face)) for face in table]
    if suffix == "off":
        text = ["OFF", f"{len(points)} {len(faces)} 0", *rows]
        text += [f"{len(face)} " + " ".join(map(str, face)) for face in table]
    path = tmp_path / f"gear.{suffix}"
    path.write_text("\n".join(text) + "\n")
    net = check(gso.unfold(path))
    own = made(points, faces)
    assert (len(net), len(net.angles)) == (1, 37)
    assert net.areas.sum() == pytest.approx(own.areas.sum(), rel=1e-12)


def test_folds_say_up_and_down():
    """A hat section: two folds each way, with the angles that it was made with."""
    x = np.array([0.0, 20.0, 20.0, 50.0, 50.0, 70.0])
    z = np.array([0.0, 0.0, 15.0, 15.0, 0.0, 0.0])
    points = np.concatenate([np.stack([x, np.full(6, y), z], axis=1) for y in (0.0, 100.0)])
    net = made(points, [[k, k + 1, k + 7, k + 6] for k in range(5)])
    assert len(net) == 1
    assert np.ptp(net.pattern.flat, axis=0).tolist() == pytest.approx([100.0, 100.0])
    order = np.argsort(
        net.mesh.vertices[net.pattern.vertex[net.folds.edges[:, 0]], 0], kind="stable"
    )
    assert sorted(net.angles[order].round(9).tolist()) == [-90.0, -90.0, 90.0, 90.0]
    top = np.isclose(net.mesh.vertices[net.pattern.vertex[net.folds.edges]][:, :, 2], 15).all(
        axis=1
    )
    assert net.angles[top].tolist() == pytest.approx([90.0, 90.0])


def ball(n):
    """About n points of a lumpy ball, as triangles."""
    k = np.arange(n) + 0.5
    z, a = 1.0 - 2.0 * k / n, np.pi * (1.0 + np.sqrt(5.0)) * k
    p = np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], axis=1)
    _, faces = hull(p)
    return p * (1.0 + 0.2 * np.sin(3 * p[:, :1]) * np.cos(4 * p[:, 1:2])), faces


def test_same_net_for_every_numbering_and_place():
    points, faces = ball(60)
    one = made(points, faces)
    rng = np.random.default_rng(4)
    for _ in range(3):
        order = rng.permutation(len(points))
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        turn *= np.linalg.det(turn)
        new = np.empty_like(points)
        new[order] = points @ turn.T + rng.standard_normal(3)
        table = np.stack([np.roll(row, rng.integers(3)) for row in order[faces]])
        other = made(new, table[rng.permutation(len(table))])
        assert len(other) == len(one)
        assert other.cut_length == pytest.approx(one.cut_length, rel=1e-9)


def test_smooth_surfaces_that_are_doubly_curved_are_said():
    def said(grid, **options):
        mesh = Mesh.from_grid(grid)
        both = (mesh.vertices, mesh.faces), (mesh.vertices, mesh.triangles)
        nets = (gso.unfold(given, effort=0.0, **options) for given in both)
        return {any("doubly curved" in note for note in net.notes) for net in nets}

    assert said(sphere_cap(21, radius=1.0)) == {True}
    assert said(saddle(21)) == {True}
    # A cylinder is developable, but not with the coordinates of a text file.
    assert said(cylinder(21)) == {False}
    assert said(cylinder(21).round(6)) == {True}
    # Low-poly models are meant to be folded, and sharp edges to be cut.
    assert said(sphere_cap(9)) == {False}
    half = np.linspace(0.0, np.pi, 241)
    around = np.c_[np.cos(half), np.sin(half)]
    net = gso.unfold(prism(around, 0.5), effort=0.0)
    assert not any("doubly curved" in note for note in net.notes)


def test_same_input_gives_the_same_net():
    points, faces = ball(80)
    one, other = (gso.unfold((points, faces), seed=3) for _ in range(2))
    assert (one.pattern.flat == other.pattern.flat).all()


def edges_of(net):
    return {tuple(sorted(edge)) for edge in net.vertex[net.cut_edges].tolist()}


def test_edges_to_cut_and_to_keep():
    points, faces = prism(ring(6, 30.0), 80.0)
    keep, cut = [[0, 6], [1, 7]], [[2, 8], [9, 3], [4, 10]]
    net = made(points, faces, keep=keep, cut=cut)
    gone = edges_of(net)
    assert not gone & {(0, 6), (1, 7)}
    assert gone >= {(2, 8), (3, 9), (4, 10)}
    assert len(net) == 1


def test_edges_that_cannot_all_be_kept_are_named():
    points, faces = hull(PLATONIC["tetrahedron"][0])
    every = Mesh(points, faces).edges
    with pytest.raises(OptionError, match=r"edge \d-\d cannot be kept"):
        gso.unfold((points, faces), keep=every)
    with pytest.raises(OptionError, match="cut: 0-9 is no edge"):
        gso.unfold((points, faces), cut=[[0, 9]])
    with pytest.raises(OptionError, match="edge 0-1 is in keep and in cut"):
        gso.unfold((points, faces), cut=[[0, 1]], keep=[[1, 0]])


def test_parts_fit_the_sheet():
    points, faces = prism(ring(8, 30.0), 80.0)
    width = 60.0 * np.sin(np.pi / 8)
    net = made(points, faces, sheet=(100.0, 3.5 * width))
    for part in range(len(net)):
        flat = net.pattern.flat[np.unique(net.pattern.faces[net.part == part])]
        sides = shapely.minimum_rotated_rectangle(shapely.MultiPoint(flat)).exterior.coords
        size = sorted(np.linalg.norm(np.diff(np.array(sides)[:3], axis=0), axis=1))
        assert size[0] <= 3.5 * width + 1e-6
        assert size[1] <= 100.0 + 1e-6
    assert 3 <= len(net) <= 5
    with pytest.raises(OptionError, match="larger than the sheet"):
        gso.unfold((points, faces), sheet=(50.0, 50.0))
    assert len(gso.unfold((0.1 * points, faces), sheet=("2m", 1000), unit="cm")) == 1


def test_what_is_not_manifold_is_divided_with_a_note():
    cube = PLATONIC["cube"][0]
    points, faces = hull(cube)
    # Two cubes that share a vertex, two that share an edge, and three plates at one edge.
    corner = np.r_[faces, faces + 8]
    at = int(np.flatnonzero((points == 1).all(axis=1))[0])
    low = int(np.flatnonzero((points == -1).all(axis=1))[0]) + 8
    corner[corner == low] = at
    net = made(np.r_[points, points + 2.0], corner)
    assert len(net) == 2
    assert f"vertex {at}" in net.notes[0]
    plates = [[0, 1, 2, 3], [0, 1, 4, 5], [0, 1, 6, 7]]
    p = [[0, 0, 0], [0, 0, 9], [5, 0, 9], [5, 0, 0], [0, 6, 9], [0, 6, 0], [-7, -1, 9], [-7, -1, 0]]
    net = made(np.array(p, float), plates)
    assert len(net) == 3
    assert any("0-1" in note for note in net.notes)
    assert net.areas.sum() == pytest.approx(9 * (5 + 6 + np.sqrt(50)))


def test_components_are_parts_of_their_own():
    points, faces = hull(PLATONIC["cube"][0])
    net = made(np.r_[points, points + 9.0], np.r_[faces, faces + 8])
    assert len(net) == 2
    assert net.areas.tolist() == pytest.approx([24.0, 24.0])


def test_plate_with_holes_stays_whole():
    n = np.arange(8)
    y, x = np.divmod(np.arange(81), 9)
    quads = [
        [9 * j + i, 9 * j + i + 1, 9 * j + i + 10, 9 * j + i + 9]
        for j in n
        for i in n
        if (i, j) not in {(2, 2), (5, 5), (5, 4)}
    ]
    points = np.stack([x, y, 0 * x], axis=1).astype(float)
    points[:, 2] = np.maximum(points[:, 0] - 4.0, 0.0)
    net = made(points, quads)
    assert len(net) == 1
    assert len(net.cut_edges) == 0
    assert len(net.pattern.mesh.boundary_loops) == 3
    assert np.unique(net.angles.round(9)).tolist() == [-45.0]


def test_patches_of_other_kinds_are_joined():
    """An unrolled cylinder, which a caller gives, gets its floor and its ceiling."""
    n, radius, height = 60, 20.0, 50.0
    points, faces = prism(ring(n, radius), height)
    flat, table, patch = [], [], []
    side = 2.0 * radius * np.sin(np.pi / n)
    for k in range(n):
        a, b, c, d = faces[2 + k]
        low, high = k * side, (k + 1) * side
        table += [[a, b, c], [a, c, d]]
        flat += [
            [[low, 0], [high, 0], [high, height]],
            [[low, 0], [high, height], [low, height]],
        ]
        patch += [0, 0]
    for number, (own, way) in enumerate(((faces[0], -1.0), (faces[1], 1.0)), start=1):
        for k in range(1, n - 1):
            row = [own[0], own[k], own[k + 1]]
            table.append(row)
            flat.append((points[row, :2] * [way, 1.0]).tolist())
            patch.append(number)
    joined = join_patches(points, np.array(table), np.array(patch), np.array(flat))
    assert joined.part.max() == 0
    union = shapely.union_all(shapely.polygons(joined.flat), grid_size=1e-9).area
    area = n * side * height + n * radius**2 * np.sin(2.0 * np.pi / n)
    assert union == pytest.approx(area, rel=1e-6)
    # Cut are the slit and all but one edge of either disk.
    assert (~joined.whole).sum() == 1 + 2 * (n - 1)


@pytest.mark.parametrize(("count", "seconds", "parts"), [(250, 5.0, 1), (2500, 100.0, 40)])
def test_time(count, seconds, parts):
    points, faces = ball(count)
    begin = time.perf_counter()
    net = gso.unfold((points, faces))
    assert time.perf_counter() - begin < seconds
    assert len(net) <= parts
    check(net)


def test_flat_surfaces_that_cover_themselves_are_divided():
    """A flat ramp of five quarters of a turn, and single triangles."""
    angle = np.radians(15.0) * np.arange(31)
    both = [r * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) for r in (1.0, 2.0)]
    net = made(np.concatenate(both), [[k, 31 + k, 32 + k, k + 1] for k in range(30)])
    assert len(net) == 2
    net = made(np.r_[np.eye(3), np.eye(3) + 5.0], [[0, 1, 2], [3, 4, 5]])
    assert net.areas.tolist() == pytest.approx([0.5 * np.sqrt(3.0)] * 2)


def test_bad_input_is_refused():
    with pytest.raises(MeshError, match="face 0 has 2 corners"):
        gso.unfold((np.eye(3), [[0, 1]]))
    with pytest.raises(MeshError, match="face 0 points outside"):
        gso.unfold((np.eye(3), [[0, 1, 3]]))
    with pytest.raises(MeshError, match="face 0 cannot be divided"):
        crossed = np.array([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0], [-1, 1, 0.0]])
        gso.unfold((crossed, [[0, 1, 2, 3, 4]]))
    with pytest.raises(OptionError, match="effort"):
        gso.unfold((np.eye(3), [[0, 1, 2]]), effort=-1.0)
    with pytest.raises(OptionError, match="seed"):
        gso.unfold((np.eye(3), [[0, 1, 2]]), seed=-1)


@pytest.mark.parametrize("model", [ball(60), gear(9), box(110.0), nut(6)])
def test_parts_of_the_workshop_lose_no_fold_and_no_area(model):
    net = made(*model)
    finish = Finish(notches=None)
    parts, _ = parts_from(fitted(of_net("it", net), 10.0, finish), finish)
    assert len(parts) == len(net)
    p = net.mesh.vertices[net.mesh.faces]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    area = np.linalg.norm(normal, axis=1)
    assert sum(part.area for part in parts) == pytest.approx(50.0 * area.sum(), rel=1e-9)
    # The angles of the design at all edges, without those that were cut.
    he = net.mesh.half_edges
    k = he.interior
    one, other = (normal / area[:, None])[np.stack([he.face[k], he.face[he.twin[k]]])]
    angle = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))
    cut = {tuple(sorted(edge)) for edge in net.cut_edges.tolist()}
    edges = np.sort(np.stack([he.origin[k], he.dest[k]], axis=1), axis=1).tolist()
    folded = np.array([tuple(edge) not in cut for edge in edges]) & (angle > np.radians(0.01))
    drawn = sum(abs(bend.angle) for part in parts for bend in part.bends)
    assert drawn == pytest.approx(angle[folded].sum(), rel=1e-9)


@pytest.mark.parametrize("suffix", ["svg", "dxf", "pdf"])
def test_command(tmp_path, suffix):
    points, faces = hull(PLATONIC["cube"][0] * 50.0)
    gso.save((points, faces), tmp_path / "cube.obj")
    out = tmp_path / f"net.{suffix}"
    done = CliRunner().invoke(main, ["unfold", str(tmp_path / "cube.obj"), "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "parts: 1; folds: 5 mountain, 0 valley; length of the cuts: 700 mm" in done.output
    assert out.stat().st_size > 500
    if suffix == "dxf":
        import ezdxf

        space = ezdxf.readfile(out).modelspace()
        layers = [entity.dxf.layer for entity in space]
        assert sum("BEND" in layer for layer in layers) == 5
        (outline,) = [e for e in space if e.dxf.layer == "CUT"]
        polygon = shapely.Polygon([p[:2] for p in outline.get_points()])
        assert polygon.area == pytest.approx(6e4, rel=1e-9)


def test_command_names_wrong_options(tmp_path):
    points, faces = hull(PLATONIC["cube"][0])
    name = str(tmp_path / "cube.obj")
    gso.save((points, faces), name)
    run = CliRunner().invoke
    assert "such as 0-7" in run(main, ["unfold", name, "-o", "x.svg", "--cut", "a"]).output
    assert "no writer for '.dwg'" in run(main, ["unfold", name, "-o", "x.dwg"]).output


def test_polylines_of_the_file_are_cut(tmp_path):
    # A square tube of four sides, each of two quads, on top of each other.
    ring = [(0, 0), (60, 0), (60, 40), (0, 40)]
    points = [(*p, z) for z in (0, 30, 70) for p in ring]
    sides = [
        (4 * r + k + 1, 4 * r + (k + 1) % 4 + 1, 4 * r + (k + 1) % 4 + 5, 4 * r + k + 5)
        for r in (0, 1)
        for k in range(4)
    ]
    body = [f"v {x} {y} {z}" for x, y, z in points]
    body += [f"f {' '.join(map(str, side))}" for side in sides]
    path = tmp_path / "tube.obj"

    def cuts(*lines):
        path.write_text("\n".join([*body, *lines, ""]))
        net = gso.unfold(path)
        assert len(net) == 1
        points, seams = net.pattern.vertex, net.pattern.seams
        ends = np.asarray(net.mesh.vertices)[points[seams[:, 0]]]
        assert (ends[..., 2].min(axis=1) < ends[..., 2].max(axis=1)).all()
        return {tuple(end[0, :2]) for end in ends}, net.notes

    for k, at in enumerate(ring, start=1):
        # Along two edges at once, edge by edge, and by vertices of its own.
        assert cuts(f"l {k} {k + 8}")[0] == {at}
        assert cuts(f"l {k} {k + 4} {k + 8}")[0] == {at}
        x, y = at
        assert cuts(f"v {x} {y} 0", f"v {x} {y} 70", "l -1 -2")[0] == {at}
    places, notes = cuts("l 1 5 9", "l 1 6")
    assert places == {ring[0]}
    assert any(re.search(r"polyline 2 .* between \(0, 0, 0\) and \(60, 0, 30\)", n) for n in notes)
    # The same by gso fabricate: the seam is where the line is.
    job = gso.fabricate(path, tmp_path / "job", formats=("svg",), workers=0)
    assert job.usable and sum("polyline 2" in note for note in job.certificate["notes"]) == 1
    np.testing.assert_allclose(sorted(job.parts[0].size), [70.0, 200.0])
    (surface,) = (gso.load(p) for p in (tmp_path / "job" / "surfaces").glob("*.obj"))
    twice = [p for p in surface.vertices.tolist() if surface.vertices.tolist().count(p) == 2]
    assert {tuple(p[:2]) for p in twice} == {ring[0]}
    path.write_text("\n".join([*body, "l 1 99", ""]))
    with pytest.raises(gso.MeshError, match="refers to vertex 99"):
        gso.unfold(path)
