"""Designs that are flat or developable as they are: nothing moves, every fold has its line."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import ezdxf
import numpy as np
import pytest
import shapely
from scipy.spatial import ConvexHull

import gso
from gso import metrics
from gso.components import split
from gso.exact import folded_pattern
from gso.mesh import Mesh
from gso.seams import rectangle
from gso.workshop import Finish, Thickness


def box(x=1.0, y=1.0, z=1.0) -> Mesh:
    points = [[a, b, c] for c in (0, z) for a, b in ((0, 0), (x, 0), (x, y), (0, y))]
    sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    return Mesh(points, [[3, 2, 1, 0], [4, 5, 6, 7], *sides])


def prism(n=8, radius=40.0, height=120.0) -> Mesh:
    """Sides and both caps, in triangles."""
    turn = 2 * np.pi * np.arange(n) / n
    ring = radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    points = np.concatenate([ring, ring + np.array([0, 0, height])])
    k = np.arange(n)
    j = (k + 1) % n
    sides = [np.stack([k, j, j + n], axis=1), np.stack([k, j + n, k + n], axis=1)]
    caps = [np.stack([0 * k, j, k], axis=1)[1:-1], np.stack([0 * k, k, j], axis=1)[1:-1] + n]
    return Mesh(points, np.concatenate([*sides, *caps]))


def half_cylinder(radius=1500.0, length=5000.0, shape=(9, 41), turned=0.0) -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 1, shape[0]), np.linspace(0, 1, shape[1]), indexing="ij")
    along, angle = length * u, np.pi * v
    if turned:
        # A rotated grid on the unrolled sheet.
        plane = np.stack([length * (u - 0.5), radius * np.pi * (v - 0.5)], axis=-1)
        c, s = np.cos(turned), np.sin(turned)
        along, arc = np.moveaxis(0.5 * plane @ np.array([[c, s], [-s, c]]), -1, 0)
        angle = arc / radius
    grid = np.stack([radius * np.cos(angle), radius * np.sin(angle), along], axis=-1)
    return Mesh.from_grid(grid)


def frustum(low=120.0, high=65.0, height=110.0, count=48, rows=7) -> Mesh:
    turn = 2 * np.pi * np.arange(count) / count
    share = np.linspace(0, 1, rows)[:, None]
    radius = low + share * (high - low)
    points = np.stack(
        np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height * share), axis=-1
    )
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(count), indexing="ij")
    near, far = r * count + c, r * count + (c + 1) % count
    faces = np.stack([near, far, far + count, near + count], axis=-1).reshape(-1, 4)
    return Mesh(points.reshape(-1, 3), faces)


def bracket(long=60.0, radius=5.0, wide=40.0, facets=8) -> Mesh:
    """Two plates at a right angle with a rolled corner between them."""
    turn = np.linspace(0, np.pi / 2, facets + 1)
    corner = radius * np.stack([np.sin(turn), 1 - np.cos(turn)], axis=1)
    line = np.concatenate([[[-long, 0.0]], corner, [[radius, radius + long]]])
    points = np.array([[x, y, z] for z in (0.0, wide) for x, y in line])
    n = len(line)
    return Mesh(points, [[k, k + 1, n + k + 1, n + k] for k in range(n - 1)])


def channel(flange=20.0, web=100.0, lip=60.0, long=200.0) -> Mesh:
    line = np.array([[0, flange], [0, 0], [web, 0], [web, lip]])
    points = np.array([[x, y, z] for z in (0.0, long) for x, y in line])
    return Mesh(points, [[k, k + 1, 5 + k, 4 + k] for k in range(3)])


def transition(side=150.0, radius=50.0, height=120.0, arcs=16) -> Mesh:
    """A sheet-metal duct from a square to a circle: four triangles and four quarter cones."""
    corners = 0.5 * side * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    turn = np.pi / 4 + np.linspace(0, 2 * np.pi, 4 * arcs, endpoint=False) - np.pi / 4
    ring = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.concatenate([np.pad(corners, ((0, 0), (0, 1))), np.c_[ring, height + 0 * turn]])
    faces = []
    for q in range(4):
        top = [4 + (q * arcs + k) % (4 * arcs) for k in range(arcs + 1)]
        faces += [[q, b, a] for a, b in pairwise(top)]
        faces.append([q, (q + 1) % 4, top[-1]])
    return Mesh(points, np.array(faces)[:, ::-1])


def edge_lengths(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[faces] - points[np.roll(faces, -1, axis=1)], axis=-1)


def check(found, design: Mesh) -> None:
    """Nothing moved, nothing overlaps, planes keep their lengths, every triangle is upright."""
    n = len(design.vertices)
    np.testing.assert_array_equal(found.surface.vertices[:n], design.vertices)
    far = metrics.surface_distance(design, found.surface)
    assert max(far.there_max, far.back_max) < 1e-9 * design.diagonal
    flat, faces = found.pattern.flat, found.pattern.faces
    triangles = [shapely.Polygon(flat[f]) for f in faces]
    a, b, c = flat[faces].transpose(1, 0, 2)
    signed = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert signed.min() > 0
    union = shapely.union_all(
        [t.buffer(1e-9 * design.diagonal, join_style="mitre") for t in triangles]
    )
    assert union.area == pytest.approx(signed.sum(), rel=1e-6)
    assert found.misfit(design) < 1e-6 * design.diagonal


@pytest.mark.parametrize(
    ("design", "folds", "total"),
    [
        (box(100, 100, 100), 5, 450.0),
        (prism(), 9, 7 * 45.0 + 180.0),
        (channel(), 2, 180.0),
        (bracket(), 0, 90.0),
        (half_cylinder(), 0, 180.0),
    ],
    ids=["box", "prism", "channel", "bracket", "half cylinder"],
)
def test_total_fold_angle(design, folds, total):
    found = folded_pattern(design)
    check(found, design)
    assert found.parts == 1
    bends = found.folded.lines(found.pattern.flat)
    assert sum(bend.radius == 0 for bend in bends) == folds
    assert sum(abs(np.degrees(bend.angle)) for bend in bends) == pytest.approx(total, abs=1e-6)


def test_a_half_cylinder_is_a_rectangle_with_parallel_lines():
    found = folded_pattern(half_cylinder())
    size = np.sort(np.ptp(found.pattern.flat, axis=0))
    np.testing.assert_allclose(size, [1500 * np.pi, 5000.0], rtol=1e-9)
    bends = found.folded.lines(found.pattern.flat)
    way = np.array([bend.line[1] - bend.line[0] for bend in bends])
    assert np.abs(np.ptp(way, axis=1)).min() == pytest.approx(5000.0)
    np.testing.assert_allclose([bend.radius for bend in bends], 1500.0, rtol=1e-6)


@pytest.mark.parametrize("given", ["grid", "quads"])
def test_quads_under_the_hip_of_a_roof_are_folded_along_it(given):
    x, y = np.mgrid[:12.0:25j, :8.0:17j]
    rise = np.minimum(np.minimum(x, 12.0 - x), np.minimum(y, 8.0 - y))
    roof = Mesh.from_grid(np.dstack([x, y, 0.7 * rise]))
    if given == "quads":
        roof = Mesh(roof.vertices, roof.faces[::-1])
    found = folded_pattern(roof)
    assert found.parts == 1
    # Its area is that of four planes; along the other diagonals it would be smaller.
    assert metrics.area(found.surface) == pytest.approx(96.0 * np.hypot(1.0, 0.7), rel=1e-12)
    # Three of the five folds join four faces to one part, and each is a straight line.
    angles = np.abs(found.folded.angles)
    ridge, hip = 2.0 * np.arctan(0.7), np.arccos(1.0 / (1.0 + 0.7**2))
    assert np.minimum(abs(angles - ridge), abs(angles - hip)).max() < 1e-9
    ends = found.pattern.flat[found.folded.edges]
    way = np.diff(ends, axis=1)[:, 0]
    assert len(np.unique(np.round(np.degrees(np.arctan2(way[:, 1], way[:, 0])) % 180.0, 6))) == 3


def test_a_groin_vault_of_quads_is_four_rolled_faces():
    x, y = np.mgrid[-4.0:4.0:25j, -4.0:4.0:25j]
    height = np.maximum(np.sqrt(16.2 - x**2), np.sqrt(16.2 - y**2))
    vault = Mesh.from_grid(np.dstack([x, y, height]))
    found = folded_pattern(Mesh(vault.vertices, vault.faces))
    assert found.parts == 4
    assert found.strain < 1e-9


def test_lines_of_a_turned_grid_are_the_rulings():
    design = half_cylinder(shape=(30, 50), turned=np.radians(30))
    found = folded_pattern(design)
    check(found, design)
    bends = found.folded.lines(found.pattern.flat)
    assert len(bends) > 5
    way = np.array([bend.line[1] - bend.line[0] for bend in bends])
    angle = np.degrees(np.arctan2(way[:, 1], way[:, 0])) % 180
    assert np.ptp(angle) < 0.01
    np.testing.assert_allclose([bend.radius for bend in bends], 1500.0, rtol=1e-6)
    arc = np.ptp(np.arctan2(design.vertices[:, 1], design.vertices[:, 0]))
    total = np.degrees(sum(abs(bend.angle) for bend in bends))
    assert 0.5 * np.degrees(arc) < total


def test_a_frustum_is_a_sector():
    low, high, height = 120.0, 65.0, 110.0
    design = frustum(low, high, height)
    found = folded_pattern(design)
    check(found, design)
    slant = np.hypot(low - high, height)
    tip = np.arcsin((low - high) / slant)
    outer = low / np.sin(tip)
    sector = 2 * np.pi * np.sin(tip)
    a, b, c = found.pattern.flat[found.pattern.faces].transpose(1, 0, 2)
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
    ring = 0.5 * sector * (outer**2 - (outer - slant) ** 2)
    # The outline follows chords of the arcs.
    assert area == pytest.approx(ring, rel=2e-3)
    bends = found.folded.lines(found.pattern.flat)
    reach = np.array([np.linalg.norm(bend.line[1] - bend.line[0]) for bend in bends])
    np.testing.assert_allclose(reach, slant, rtol=1e-9)


def test_a_duct_from_square_to_round_is_one_part():
    design = transition()
    found = folded_pattern(design)
    check(found, design)
    assert found.parts == 1
    before = np.sort(edge_lengths(design.vertices, design.faces).ravel())
    after = np.sort(edge_lengths(found.pattern.flat, found.pattern.faces).ravel())
    np.testing.assert_allclose(after, before, rtol=1e-9)


def pipe(radius=50.0, height=150.0, count=48, rows=12, holes=6, slit=False) -> Mesh:
    """A tube with square holes around it, or a tube that is open along a ruling."""
    mesh = frustum(radius, radius, height, count, rows)
    row, column = np.divmod(np.arange(len(mesh.faces)), count)
    gone = (np.abs(row - 5) < 2) & (column % (count // holes) < 3)
    faces = mesh.faces[~gone]
    if slit:
        # The last column ends at copies of the first ruling's vertices.
        faces = mesh.faces.copy()
        last = column == count - 1
        faces[last, 1], faces[last, 2] = [len(mesh.vertices) + row[last] + k for k in (0, 1)]
        return Mesh(np.r_[mesh.vertices, mesh.vertices[::count]], faces)
    return Mesh(mesh.vertices, faces)


def blob(count=60) -> Mesh:
    """A lumpy ball of triangles."""
    k = np.arange(count) + 0.5
    z, a = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    p = np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], axis=1)
    made = ConvexHull(p)
    q = p[made.simplices]
    out = np.einsum("td,td->t", np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), q[:, 0])
    faces = np.where((out > 0)[:, None], made.simplices, made.simplices[:, ::-1])
    return Mesh(p * (1.0 + 0.2 * np.sin(3 * p[:, :1])), faces)


@pytest.mark.parametrize(
    "design", [pipe(), pipe(slit=True), blob(), prism(6, 30.0, 90.0), frustum(40.0, 0.5, 90.0)]
)
def test_patterns_fold_up_to_the_design(design):
    found = folded_pattern(design)
    check(found, design)
    # The way back does not know the design: bends of half the angle lead elsewhere.
    folded = found.folded._replace(angles=0.5 * found.folded.angles, radii=2 * found.folded.radii)
    assert replace(found, folded=folded).misfit(design) > 1e-3 * design.diagonal


def test_what_is_not_developable_has_no_such_pattern():
    u = np.linspace(-1, 1, 21)
    x, y = np.meshgrid(u, u)
    assert folded_pattern(Mesh.from_grid(np.dstack([x, y, np.sqrt(4 - x**2 - y**2)]))) is None


@pytest.mark.parametrize("design", [box(90, 60, 40), half_cylinder(), frustum(), channel()])
def test_fabricated_as_it_is(design, tmp_path):
    job = gso.fabricate(design, tmp_path, formats=("svg",), workers=0)
    assert job.usable and len(job.parts) == 1
    (record,) = job.certificate["designs"]
    assert record["deviation_max"] == 0.0
    assert record["strain_max"] < 1e-12
    assert len(job.parts[0].bends) >= 2


def turned(profile, count=48) -> Mesh:
    """A body of revolution in triangles, one row of facets between two points of its profile."""
    angle = 2 * np.pi * np.arange(count) / count
    radius, height = np.transpose(profile)[:, :, None]
    rows = np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height)
    place = np.arange(rows[0].size).reshape(rows[0].shape)
    corners = [place, np.roll(place, -1, axis=1)]
    a, b, c, d = corners[0][:-1], corners[1][:-1], corners[1][1:], corners[0][1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Mesh(np.stack(rows, axis=-1).reshape(-1, 3), faces)


REDUCER = [(60, -100), (60, 0), (250, 500), (250, 900)]


@pytest.mark.parametrize("way", [gso.strips, gso.pieces])
def test_a_reducer_of_one_row_each_is_kept(way):
    result = way(turned(REDUCER), max_deviation="1%")
    assert result.usable
    assert any("as it is" in note for note in result.notes)
    assert (result.ruled.strips if way is gso.strips else len(result)) == 3


def test_a_reducer_is_fabricated_as_cylinders_and_a_cone(tmp_path):
    gso.fabricate(turned(REDUCER), tmp_path, workers=0)
    (design,) = json.loads((tmp_path / "certificate.json").read_bytes())["designs"]
    assert design["deviation_max"] == 0
    areas = [2 * np.pi * 60 * 100, np.pi * 310 * np.hypot(190, 500), 2 * np.pi * 250 * 400]
    assert sorted(part["area"] for part in design["parts"]) == pytest.approx(areas, rel=1e-3)


def test_rows_of_a_lamp_globe_are_not_parts_of_their_own():
    up = np.radians(np.linspace(-60, 60, 9))
    globe = turned(150 * np.stack([np.cos(up), np.sin(up)], axis=-1), 40)
    assert folded_pattern(globe) is None
    assert folded_pattern(globe, rows=True).parts == 8
    assert gso.strips(globe, max_deviation="1%").ruled.strips < 8


def tray(x=80.0, y=50.0, z=15.0) -> Mesh:
    return Mesh(box(x, y, z).vertices, np.delete(box().faces, 1, axis=0))


def tube(radius=50.0, height=150.0) -> Mesh:
    ring = frustum(radius, radius, height)
    return Mesh(ring.vertices, ring.faces)


def total(bends) -> float:
    """The sum of the angles of bend lines, in degrees."""
    return sum(float(np.degrees(abs(bend.angle))) for bend in bends)


@pytest.mark.parametrize(
    ("design", "size"),
    [
        (tray(), (110.0, 80.0)),
        (box(100, 100, 100), None),
        (tube(), (100 * np.pi, 150.0)),
        (frustum(120.0, 20.0, 110.0), None),
        (frustum(), None),
    ],
    ids=["tray", "cube", "tube", "cone", "lampshade"],
)
def test_all_ways_keep_the_same_design(design, size, tmp_path):
    pieces = gso.pieces(design, max_deviation="1%", workers=0)
    strips = gso.strips(design, max_deviation="1%")
    ruled = gso.tno.optimize(design, formulation="ruled", max_deviation="1%")
    again = gso.strips(pieces, max_deviation="1%")
    job = gso.fabricate(design, tmp_path, formats=("svg",), workers=0)
    assert pieces.usable and job.usable and len(pieces) == len(job.parts) == 1
    assert pieces.metrics["deviation_max"] == 0.0 and pieces.metrics["strain_max"] < 1e-12
    n = len(design.vertices)
    np.testing.assert_array_equal(pieces.design.vertices[:n], design.vertices)
    sheet, (part,) = pieces.sheets[0], job.parts
    bends, seam = pieces.folded.lines(pieces.pattern.flat), pieces.lengths.sum()
    np.testing.assert_allclose(part.size, sheet.size, rtol=1e-9)
    if size is not None:
        np.testing.assert_allclose(part.size, size, rtol=1e-9)
    assert len(part.bends) == len(bends)
    assert total(part.bends) == pytest.approx(total(bends), abs=1e-6)
    for one in (strips, ruled, again):
        assert one.usable and one.status is gso.Status.ALREADY_GOOD and one.details["strips"] == 1
        assert one.metrics["strain_max"] < 1e-12 and one.metrics["distance_max"] == 0.0
        np.testing.assert_array_equal(one.on_design().vertices, design.vertices)
        (own,) = split(one.pattern.mesh)
        np.testing.assert_allclose(rectangle(one.pattern.flat[own.vertices])[1], sheet.size)
        lines = one.folded.lines(one.pattern.flat)
        assert len(lines) == len(bends) and total(lines) == pytest.approx(total(bends))
        ends = one.mesh.vertices[one.pattern.vertex[one.pattern.seams[:, 0]]]
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(seam)


def test_kept_designs_are_written_and_read(tmp_path):
    strips = gso.strips(frustum(), max_deviation="1%")
    strips.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    assert again.usable and again.metrics["strain_max"] < 1e-12
    gso.pieces(tray()).save(tmp_path / "cut")
    drawing = (tmp_path / "cut" / "patterns.svg").read_text()
    assert drawing.count("90 degrees") == 4


def test_nearly_developable_designs_are_kept_with_a_note(tmp_path):
    design = half_cylinder(shape=(41, 21))
    noise = np.random.default_rng(0).normal(size=design.vertices.shape)
    noise *= 1e-4 * design.size / np.linalg.norm(noise, axis=1).max()
    noisy = design.replaced(design.vertices + noise)
    found = gso.pieces(noisy)
    (note,) = [note for note in found.notes if "nothing was moved" in note]
    assert "nearly developable" in note and 1e-5 < found.metrics["strain_max"] < 1e-3
    done = gso.fabricate(noisy, tmp_path / "job")
    assert any(note.endswith("at most") for note in done.certificate["notes"])
    assert len(done.parts) == 1 and done.certificate["designs"][0]["deviation_max"] == 0.0
    (note,) = [note for note in gso.pieces(design).notes if "nothing was moved" in note]
    assert "is developable as it is" in note


def bulged_box(x=100.0, y=80.0, z=60.0, bulge=8.0, n=9) -> Mesh:
    """A box whose upper side is curved in both directions."""
    share = np.linspace(0.0, 1.0, n)
    a, b = np.meshgrid(share, share, indexing="ij")
    zero, one, high = 0 * a, 0 * a + 1, 1 + 16 * bulge / z * a * (1 - a) * b * (1 - b)
    sides = [(b, a, zero), (a, zero, b), (b, one, a), (zero, b, a), (one, a, b), (a, b, high)]
    size = np.array([x, y, z])
    points = np.concatenate([size * np.stack(s, axis=-1).reshape(-1, 3) for s in sides])
    cells = Mesh.from_grid(np.stack([a, b, zero], axis=-1)).faces
    faces = np.concatenate([cells + k * n * n for k in range(6)])
    _, first, same = np.unique(points.round(6), axis=0, return_index=True, return_inverse=True)
    return Mesh(points[first], same.ravel()[faces])


def domed(radius=50.0, height=80.0, cap=25.0, count=24) -> Mesh:
    """A cylinder with a spherical cap, which it meets at an edge."""
    whole = (radius**2 + cap**2) / (2 * cap)
    slope = np.linspace(np.arcsin(radius / whole), 0.0, 5)[1:]
    rings = [(radius, z) for z in (0.0, 0.5 * height, height)]
    rings += [(whole * np.sin(t), height + cap + whole * (np.cos(t) - 1)) for t in slope[:-1]]
    turn = 2 * np.pi * np.arange(count) / count
    points = [np.c_[r * np.cos(turn), r * np.sin(turn), z + 0 * turn] for r, z in rings]
    k = np.arange(count * (len(rings) - 1))
    ahead = k + 1 - count * (k % count == count - 1)
    top = count * len(rings)
    quads = np.stack([k, ahead, ahead + count, k + count], axis=1)
    last, to = k[-count:] + count, ahead[-count:] + count
    cone = np.stack([last, to, 0 * to + top, 0 * to - 1], axis=1)
    return Mesh(np.r_[np.concatenate(points), [[0, 0, height + cap]]], np.r_[quads, cone])


@pytest.mark.parametrize(
    ("design", "formulation", "size", "bends", "angle"),
    [
        # Five sides of the box as a cross, and the wall of the cylinder.
        (bulged_box(), "ruled", (220.0, 200.0), 4, 360.0),
        (bulged_box(bulge=-9.0), "flatten", (220.0, 200.0), 4, 360.0),
        (domed(), "flatten", (100 * np.pi, 80.0), 23, 360.0),
    ],
    ids=["bulged box", "hollow box", "cylinder with a cap"],
)
def test_developable_parts_between_sharp_edges_are_kept(
    design, formulation, size, bends, angle, tmp_path
):
    job = gso.fabricate(design, tmp_path, formats=("svg",), workers=0, formulation=formulation)
    assert job.usable
    (record,) = job.certificate["designs"]
    kept, *others = job.parts
    np.testing.assert_allclose(kept.size, size, rtol=1e-9)
    assert len(kept.bends) == bends and others
    assert total(kept.bends) == pytest.approx(angle, abs=1e-6)
    if formulation == "flatten":
        assert record["deviation_max"] < 1e-12 * design.diagonal and record["seam_gap"] == 0.0
    else:
        assert 0 < record["deviation_max"] <= record["allowed"] >= record["seam_gap"]
        assert all(part.bends for part in others)
    # The others have the rest of the area, which the curved sides add to.
    rest = metrics.area(design) - kept.area * kept.count
    assert sum(part.area * part.count for part in others) == pytest.approx(rest, rel=0.02)


@pytest.mark.parametrize(
    ("thick", "radius", "k"), [(1.0, 1.0, 0.5), (1.5, 1.5, 0.44), (3.0, 4.0, 0.33)]
)
def test_flat_lengths_of_folded_sections_are_the_shops(tmp_path, thick, radius, k):
    sheet = Thickness(thick, k=k, radius=radius)
    job = gso.fabricate(
        channel(), tmp_path, formats=("svg",), workers=0, finish=Finish(thickness=sheet)
    )
    (part,) = job.parts
    # The design is the middle of the sheet: outer and inner flanges differ from it by T / 2.
    setback = radius + thick / 2
    allowance = np.pi / 2 * (radius + k * thick)
    flat = 180.0 + 2 * (allowance - 2 * setback)
    assert min(part.size) == pytest.approx(flat, abs=1e-9)
    assert job.usable


def test_too_thick_for_its_folds(tmp_path):
    def reasons(thickness):
        finish = Finish(thickness=thickness)
        job = gso.fabricate(channel(), tmp_path, formats=("svg",), workers=0, finish=finish)
        return [reason["code"] for reason in job.certificate["reasons"]]

    assert reasons(Thickness(10.0, radius=1.0)) == ["tool_radius"]
    assert reasons(Thickness(1.5)) == ["too_thick"]
    assert reasons(Thickness(1.5, face="inside")) == ["too_thick"]


def test_rolled_bends_keep_their_radius_beside_folds(tmp_path):
    sheet = Thickness(1.5, k=0.5, radius=2.0)
    job = gso.fabricate(
        bracket(), tmp_path, formats=("svg",), workers=0, finish=Finish(thickness=sheet)
    )
    (part,) = job.parts
    assert max(part.size) == pytest.approx(120.0 + 5.0 * np.pi / 2, abs=1e-6)
    # Narrow enough for a press: one line in the middle has the whole angle.
    ((_, angle, inner, _),) = part.bends
    assert (abs(angle), inner) == pytest.approx((np.pi / 2, 5.0 - 0.75), rel=1e-6)
    (zone,) = job.certificate["designs"][0]["parts"][0]["zones"]
    assert (zone["kind"], zone["bent_by"]) == ("cylinder", "press")


def test_radii_of_cones_with_an_apex_are_not_negative(tmp_path):
    # From a square to a circle: its corners are the apexes of oblique cones.
    count = 48
    turn = (np.arange(count) + 0.5) * 2 * np.pi / count
    circle = np.c_[125 * np.cos(turn), 125 * np.sin(turn), np.full(count, 300.0)]
    corners = 200.0 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    a = np.arange(count)
    own = a * 4 // count
    after = (own + 1) % 4
    last = own != np.roll(own, -1)
    fans = np.c_[own, 4 + (a + 1) % count, 4 + a][~last]
    ends = np.c_[own, after, 4 + a][last], np.c_[after, 4 + (a + 1) % count, 4 + a][last]
    duct = Mesh(np.concatenate([corners, circle]), np.concatenate([fans, *ends]))
    finish = Finish(thickness=Thickness(1.0, radius=1.0))
    job = gso.fabricate(duct, tmp_path, formats=("svg",), workers=0, finish=finish)
    zones = [z for part in job.certificate["designs"][0]["parts"] for z in part["zones"]]
    assert zones and all(zone["radius_min"] == 1.0 for zone in zones)


def test_round_faces_are_zones_to_roll(tmp_path):
    wanted = {
        "half": (half_cylinder(), "roll R 1500, 180 deg"),
        "shade": (frustum(), "roll cone R"),
    }
    for name, (design, text) in wanted.items():
        folder = tmp_path / name
        job = gso.fabricate(
            design, folder, formats=("dxf", "svg"), workers=0, bend_step="20deg", bend_text=True
        )
        (zone,) = job.certificate["designs"][0]["parts"][0]["zones"]
        assert zone["text"].startswith(text)
        assert abs(zone["angle"]) == pytest.approx(np.degrees(total_angle(job.parts[0])), abs=1e-6)
        # Rows of the design's edges serve as lines where they are near enough.
        assert len(job.parts[0].bends) == pytest.approx(abs(zone["angle"]) / 20.0, abs=1.5)
        (file,) = (folder / "parts").glob("*.dxf")
        drawn = ezdxf.readfile(file).modelspace()
        lines = [entity for entity in drawn if entity.dxf.layer == "ROLL"]
        assert len(lines) == len(job.parts[0].bends)
        assert all(zone["text"] in [v for _, v in e.get_xdata("GSO")] for e in lines)
        assert zone["text"] in [entity.dxf.text for entity in drawn.query("TEXT")]


def total_angle(part):
    return abs(sum(bend.angle for bend in part.bends))
