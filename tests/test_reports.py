"""Faults of kinds that users of flattening tools report, on inputs made by formulas."""

from __future__ import annotations

import sys
import tempfile

import numpy as np
import pytest

import gso
from gso import metrics, recognition
from gso.exact import folded_pattern
from gso.mesh import Mesh
from gso.verdict import Code
from gso.workshop import Bend, Finish, Part, TabSeam, Thickness, with_tabs


def written(path, points, faces, lines=None):
    """Write an OBJ file; `lines` are put before the faces of these numbers."""
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    for k, face in enumerate(faces):
        rows += [(lines or {}).get(k, ""), "f " + " ".join(str(v + 1) for v in face)]
    path.write_text("\n".join(rows) + "\n")
    return path


def flat(design, folder, **given):
    """Fabricate a design whose shape stays."""
    given = {"formats": ("svg",), "workers": 0, "formulation": "flatten"} | given
    return gso.fabricate(design, folder, **given)


def shoelace(polygon):
    x, y = np.asarray(polygon, float).T
    return 0.5 * abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def half_tube(radius=50.0, length=40.0, count=24, rows=3):
    """Return the vertices and quads of half a cylinder, row by row."""
    t, z = np.meshgrid(np.linspace(0, np.pi, count + 1), np.linspace(0, length, rows))
    points = np.stack([radius * np.cos(t), radius * np.sin(t), z], axis=-1).reshape(-1, 3)
    k = np.arange(count * (rows - 1)).reshape(rows - 1, count) + np.arange(rows - 1)[:, None]
    k = k.ravel()
    return points, np.stack([k, k + 1, k + count + 2, k + count + 1], axis=1)


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (40, 0), (10, 10), (0, 40)],
        [(0, 0), (60, 0), (30, 5), (20, 50)],
        [(0, 0), (30, 0), (30, 30), (25, 6)],
    ],
)
def test_concave_faces_keep_their_area(tmp_path, outline, first):
    ring = np.roll(np.array([(*p, 0.0) for p in outline]), first, axis=0)
    path = written(tmp_path / "a.obj", ring, [range(4)])
    for darts in (False, True):
        job = flat(path, tmp_path / f"out{darts}", darts=darts)
        assert job.usable
        area = sum(part.area * part.count for part in job.parts)
        assert area == pytest.approx(shoelace(outline), rel=1e-6)


@pytest.mark.parametrize("kind", ["g", "o", "usemtl"])
def test_groups_objects_and_materials_are_kept(tmp_path, kind):
    points, faces = half_tube()
    half = len(faces) // 2
    lines = {0: f"{kind} lower", half: f"{kind} upper"}
    path = written(tmp_path / "tube.obj", points, faces, lines)
    whole = flat(path, tmp_path / "whole")
    job = flat(path, tmp_path / "out", keep_groups=True)
    assert len(whole.parts) == 1 and sum(part.count for part in job.parts) == 2
    # The length of the arc, and half of the width.
    size = [50 * np.pi, 20.0]
    np.testing.assert_allclose(job.parts[0].size, size, rtol=1e-6)


def test_one_group_gives_way_to_objects(tmp_path):
    points, faces = half_tube()
    lines = {0: "g all\no lower", len(faces) // 2: "o upper"}
    path = written(tmp_path / "tube.obj", points, faces, lines)
    job = flat(path, tmp_path / "out", keep_groups=True)
    assert sum(part.count for part in job.parts) == 2


def test_what_was_changed_in_the_file_is_said(tmp_path):
    # A bent sheet of two faces of different directions, and a wall of five corners.
    points = [(0, 0, 0), (40, 0, 0), (40, 40, 0), (0, 40, 0), (40, 40, 30), (20, 50, 40)]
    points += [(0, 40, 30)]
    faces = [[0, 1, 2, 3], [3, 6, 5, 4, 2]]
    path = written(tmp_path / "sheet.obj", points, faces)
    job = flat(path, tmp_path / "out")
    notes = " ".join(job.certificate["notes"])
    for note in gso.load(path).notes:
        assert f"sheet: {note}" in job.certificate["notes"]
    assert "cut into triangles" in notes and "reversed" in notes


def test_loose_faces_are_refused(tmp_path):
    # The sides of a prism, each face with vertices of its own.
    ring = np.array([(10 * np.cos(t), 10 * np.sin(t)) for t in 2 * np.pi * np.arange(5) / 5])
    points = [
        (*ring[k % 5], z) for i in range(5) for k, z in ((i, 0), (i + 1, 0), (i + 1, 9), (i, 9))
    ]
    path = written(tmp_path / "prism.obj", points, np.arange(20).reshape(5, 4))
    with pytest.raises(gso.MeshError, match=r"5 separate pieces that touch.*weld"):
        flat(path, tmp_path / "out")


def test_a_slit_of_the_design_stays_a_slit(tmp_path):
    # A cone cut open along a line: its first and its last column are apart in the file.
    t, s = np.meshgrid(np.linspace(0, 2 * np.pi, 33), np.linspace(40, 100, 7))
    cone = np.stack([s * np.cos(t), s * np.sin(t), 2 * s], axis=-1) / np.sqrt(5)
    points = cone.reshape(-1, 3)
    # Rounding makes the columns equal.
    points = np.round(points, 6)
    faces = Mesh.from_grid(np.dstack([*np.mgrid[:7.0, :33.0], np.zeros((7, 33))])).faces
    path = written(tmp_path / "cone.obj", points, faces)
    job = flat(path, tmp_path / "out")
    assert job.usable and len(job.parts) == 1 and job.parts[0].count == 1
    assert job.certificate["designs"][0]["seams"] == 0
    # A sector of 360 / sqrt(5) degrees from 40 to 100, whose arcs have 32 sides.
    turn = 2 * np.pi / np.sqrt(5)
    outline = job.parts[0].outline
    assert part_area(job) == pytest.approx(
        0.5 * (100**2 - 40**2) * 32 * np.sin(turn / 32), rel=1e-4
    )
    long = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
    assert len(outline) >= 2 * 33 and long.max() < 21


def part_area(job):
    return sum(part.area * part.count for part in job.parts)


def crossing(turn):
    """Return two plates of side 60, one turned about a line in the other."""
    y, x = np.mgrid[-30:30:7j, -30:30:8j]
    grid = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    a = np.radians(turn)
    other = np.stack([x * np.cos(a), y + 0.7, x * np.sin(a)], axis=-1).reshape(-1, 3)
    return Mesh(np.r_[grid.vertices, other], np.r_[grid.faces, grid.faces + 56])


@pytest.mark.parametrize("turn", [90, 40])
@pytest.mark.parametrize("formulation", ["flatten", "curvature", "ruled"])
def test_plates_that_cross_are_not_usable(tmp_path, turn, formulation):
    job = flat(crossing(turn), tmp_path / "out", formulation=formulation)
    assert Code.CROSSES_ITSELF in [reason.code for reason in job.reasons]
    assert not job.usable and sum(part.count for part in job.parts) == 2


def test_a_tall_duct_of_few_faces_is_made(tmp_path):
    # Its faces have no area seen from above.
    turn = 2 * np.pi * np.arange(12) / 12
    round_end = np.stack([60 * np.cos(turn), 60 * np.sin(turn), 0 * turn + 200], axis=1)
    points = np.r_[round_end - [0, 0, 200], round_end]
    faces = [[k, (k + 1) % 12, 12 + (k + 1) % 12, 12 + k] for k in range(12)]
    job = flat(written(tmp_path / "duct.obj", points, faces), tmp_path / "out", formulation="ruled")
    assert not any("no area" in str(reason) for reason in job.reasons)
    area = 12 * 2 * 60 * np.sin(np.pi / 12) * 200
    assert part_area(job) == pytest.approx(area, rel=0.02)


def triangle(base, angle, other):
    """Return a triangle on a base along x, by the angles in radians at its ends."""
    high = base / (1 / np.tan(angle) + 1 / np.tan(other))
    return np.array([(0.0, 0), (base, 0), (high / np.tan(angle), high)])


def turned(points, angle, by):
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + by


@pytest.mark.parametrize("angles", [(9.5, 85.0), (30.0, 40.0), (120.0, 20.0), (89.0, 89.0)])
def test_tabs_lie_within_the_face_that_they_are_glued_to(angles):
    # A square of 60, along whose upper side a triangle stands upside down in its own place.
    square = np.array([(0.0, 0), (60, 0), (60, 60), (0, 60)])
    a, b = np.radians(angles)
    face = triangle(60.0, a, b)
    glued = Part("b", turned(face, 1.1, [300.0, 40.0]))
    # From right to left along the square, which is to the left.
    line, there = square[[2, 3]], glued.outline[[1, 0]]
    seam = TabSeam(7, line, there, glued, True)
    ((part,), bare) = with_tabs([Part("a", square)], [[seam]], 5.0, numbers=3.0)
    tab = np.array([p for p in part.outline if p[1] > 60 + 1e-9]) - [0, 60]
    assert 1 <= len(tab) <= 2 and not bare and [label.text for label in part.labels] == ["7"]
    # At both ends the tab takes half of the angle of the face, and 45 degrees at most.
    for end, angle, way in ((0.0, a, 1.0), (60.0, b, -1.0)):
        first = tab[np.argmin(way * tab[:, 0])]
        own = np.arctan2(first[1], way * (first[0] - end))
        assert own == pytest.approx(min(angle / 2, np.pi / 4), rel=1e-6)
    # Nothing of it is beyond the other sides of the face.
    for p, q in ((face[1], face[2]), (face[2], face[0])):
        left = (q - p)[0] * (tab - p)[:, 1] - (q - p)[1] * (tab - p)[:, 0]
        assert (left > 0).all()
    assert not part.holes and part.area > 3600


def test_a_tab_ends_at_a_sharp_bend_of_the_other_part():
    # The other part is a flange of 3 and a wall behind a bend of 90 degrees.
    square = np.array([(0.0, 0), (60, 0), (60, 60), (0, 60)])
    wall = np.array([(0.0, 0), (60, 0), (60, 3), (60, 40), (0, 40), (0, 3)])
    high = {}
    for angle in (np.pi / 2, 0.05):
        glued = Part("b", wall, bends=(Bend(np.array([(0.0, 3), (60, 3)]), angle, 1.0),))
        seam = TabSeam(1, square[[2, 3]], wall[[1, 0]], glued, True)
        ((part,), _) = with_tabs([Part("a", square)], [[seam]], 5.0)
        high[angle] = part.outline[:, 1].max() - 60
    assert high[np.pi / 2] == pytest.approx(2.5) and high[0.05] == pytest.approx(5.0)


def pyramid(sides, radius, height):
    """Return a pyramid without its base."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    faces = [[k, (k + 1) % sides, sides] for k in range(sides)]
    return Mesh(np.r_[ring, [[0, 0, height]]], faces)


@pytest.mark.parametrize(("sides", "height"), [(4, 120.0), (6, 60.0), (3, 200.0)])
def test_tabs_of_pyramids_leave_no_slits_and_carry_numbers(tmp_path, sides, height):
    design = pyramid(sides, 14.0, height)
    finish = Finish(tabs=5.0, notches=None)
    job = flat(design, tmp_path / "out", finish=finish, max_strain="0.1%")
    side = np.hypot(14.0, height)
    apex = 2 * np.arcsin(14.0 * np.sin(np.pi / sides) / side)
    plain = sides * 0.5 * side**2 * np.sin(apex)
    assert part_area(job) > plain
    numbers = [label.text for part in job.parts for label in part.labels if label.text.isdigit()]
    assert numbers.count("1") == 2
    for part in job.parts:
        assert not part.holes
        steps = np.linalg.norm(part.outline - np.roll(part.outline, 1, axis=0), axis=1)
        assert steps.min() > 1e-3


@pytest.mark.parametrize("cut", [[(1, 1)], [(1, 1), (3, 2)], [(1, 1), (2, 2)]])
def test_plates_with_holes_never_end_in_an_error_of_the_library(tmp_path, cut):
    # Squares of 10 without some of them.
    rows, columns = 4, 6
    x, y = np.meshgrid(10.0 * np.arange(columns + 1), 10.0 * np.arange(rows + 1))
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    k = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    gone = [i + j * columns for i, j in cut]
    k = np.delete(k, gone)
    faces = np.stack([k, k + 1, k + columns + 2, k + columns + 1], axis=1)
    try:
        job = flat((points, faces), tmp_path / "out", darts=True)
    except gso.GSOError as error:
        # Two holes that share a corner are no surface there.
        assert cut[1:] == [(2, 2)] and "vertex" in str(error)
    else:
        assert part_area(job) == pytest.approx(100.0 * (rows * columns - len(cut)), rel=1e-6)


@pytest.mark.parametrize("slope", [0.0, 0.4])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_t_junction_is_named(slope, mirrored):
    # Two faces beside the long edge of a third.
    points = np.array([(0, 0), (20, 0), (20, 60), (0, 60), (20, 25), (50, 0), (50, 25), (50, 60)])
    points = np.c_[points, slope * points[:, 0]].astype(float)
    # Another row, so that faces on both sides of the edge meet at its ends only.
    faces = np.array([[0, 1, 2, 3], [1, 5, 6, 4], [4, 6, 7, 2]])
    if mirrored:
        points, faces = points * [-1, 1, 1], faces[:, ::-1]
    with pytest.raises(gso.MeshError, match=r"vertex 4 lies on the edge .*add it to that face"):
        Mesh(points, faces)


def test_holes_in_no_edge_are_no_t_junctions():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0), (2, 2, 0), (1, 2, 0), (0, 1, 0)]
    with pytest.raises(gso.MeshError, match="give each part its own copy"):
        Mesh(points, [[0, 1, 2, 6], [2, 3, 4, 5]])


def grid_without(x, y, z, gone):
    """Return the quads of a grid but those in some cells (i, j)."""
    rows, columns = x.shape
    k = np.arange((rows - 1) * (columns - 1))
    keep = ~np.isin(k, [i * (columns - 1) + j for i, j in gone])
    k = (k + k // (columns - 1))[keep]
    points = np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3)
    return points, np.stack([k, k + 1, k + columns + 1, k + columns], axis=1)


def plate(gone):
    y, x = np.mgrid[0.0:50:10, 0.0:70:10]
    return grid_without(x, y, 0 * x, gone)


def cap(width, height, radius, shape, gone):
    """Return triangles of a part of a sphere above a rectangle, without some cells."""
    x, y = (np.linspace(-a / 2, a / 2, n + 1) for a, n in zip((width, height), shape, strict=True))
    x, y = np.meshgrid(x, y)
    points, quads = grid_without(x, y, np.sqrt(radius**2 - x**2 - y**2), gone)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def rolled(radius, gone=(), flange=40.0, count=8, rows=7, width=60.0):
    """Return two plates with a bend of 90 degrees between them, without some cells."""
    turn = np.linspace(0, np.pi / 2, count + 1)
    low = np.linspace(-flange, 0.0, 5)[:-1]
    up = np.linspace(0.0, flange, 5)[1:] + radius
    x = np.r_[low, radius * np.sin(turn), np.full(4, radius)]
    z = np.r_[0 * low, radius * (1 - np.cos(turn)), up]
    y = np.linspace(0.0, width, rows)[:, None]
    return grid_without(x + 0 * y, y + 0 * x, z + 0 * y, gone)


def bent_across(radius, gone=(), flange=40.0, step=2.7, rows=21, width=60.0):
    """Return triangles of plates with a bend of 90 degrees, without edges where the bend begins.

    The second of every two rows is shifted; some cells are missing.
    """
    arc = radius * np.pi / 2
    count = int((2 * flange + arc) / step) - 1
    s = np.linspace(0, count * step, count + 1) + 1.3 * (np.arange(rows)[:, None] % 2)
    turn = np.clip((s - flange) / radius, 0, np.pi / 2)
    flat, up = np.minimum(s, flange), np.maximum(s - flange - arc, 0)
    x, z = flat + radius * np.sin(turn), radius * (1 - np.cos(turn)) + up
    y = np.linspace(0.0, width, rows)[:, None] + 0 * s
    points, quads = grid_without(x, y, z, gone)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def slotted(lines, slots):
    """Return triangles between lines (c, r, 3) across c - 1 flat strips, with slots cut in them.

    A slot (row, first, last) goes from the middle of one strip to the middle of another.
    """
    kinds = {(i, row): (i > a) - (i < b) for row, a, b in slots for i in range(a, b + 1)}
    a, b, c, d = (0, 0), (1, 0), (1, 1), (0, 1)
    p, q, r, s = (0.5, 0.3), (1, 0.2), (1, 0.8), (0.5, 0.7)
    first = [(a, b, q), (a, q, p), (a, p, s), (a, s, d), (d, s, r), (d, r, c)]
    low, high = (0, 0.2), (0, 0.8)
    table = {
        None: [(a, b, c), (a, c, d)],
        -1: first,
        0: [(a, b, q), (a, q, low), (high, r, c), (high, c, d)],
        1: [tuple((1 - x, y) for x, y in face[::-1]) for face in first],
    }
    corners = [
        (1 - x) * ((1 - y) * lines[i, j] + y * lines[i, j + 1])
        + x * ((1 - y) * lines[i + 1, j] + y * lines[i + 1, j + 1])
        for i in range(lines.shape[0] - 1)
        for j in range(lines.shape[1] - 1)
        for face in table[kinds.get((i, j))]
        for x, y in face
    ]
    points, faces = np.unique(np.round(corners, 9), axis=0, return_inverse=True)
    return points, faces.reshape(-1, 3)


def slotted_tube(slots, low=50.0, high=50.0, sides=24, rows=6):
    t, z = np.linspace(0, 2 * np.pi, sides + 1)[:, None], np.linspace(0, 120.0, rows + 1)
    r = low + (high - low) * z / 120
    return slotted(np.stack([r * np.cos(t), r * np.sin(t), z + 0 * t], axis=-1), slots)


def slotted_half_tube(slots, radius=15.0, flange=40.0, count=8, rows=7):
    """Return half a tube between two plates."""
    t, far = np.linspace(0, np.pi, count + 1), np.full(4, radius)
    out = np.linspace(-flange, 0, 5)[:-1]
    x = np.r_[far, radius * np.cos(t), -far][:, None]
    y = np.r_[out, radius * np.sin(t), out[::-1]][:, None]
    z = np.linspace(0, 80.0, rows + 1)
    return slotted(np.stack([x + 0 * z, y + 0 * z, z + 0 * x], axis=-1), slots)


def folded(lengths, angles, width=40.0):
    """Return plates side by side, each turned from the one before."""
    turn = np.radians(np.cumsum([0.0, *angles]))
    steps = np.array(lengths)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    line = np.r_[[[0.0, 0.0]], np.cumsum(steps, axis=0)]
    y = np.array([[0.0], [width]])
    return grid_without(line[:, 0] + 0 * y, y + 0 * line[:, 0], line[:, 1] + 0 * y, ())


def shop_length(lengths, angles, thick=1.5, radius=2.0, k=0.5):
    """Return the flat length of folded plates in the middle of a sheet."""
    turn = np.abs(np.radians(angles))
    setback = 2 * np.tan(turn / 2) * (radius + thick / 2)
    return sum(lengths) + float((turn * (radius + k * thick) - setback).sum())


def tray():
    """Return a box without its lid."""
    points = [(a, b, c) for c in (0, 15) for a, b in ((0, 0), (80, 0), (80, 50), (0, 50))]
    return points, [[3, 2, 1, 0], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


def turned_around(radius_low, radius_high, sides=24):
    """Return a closed ring of quads: a tube, a cone, or a duct of few sides."""
    t = 2 * np.pi * np.arange(sides) / sides
    points = [
        (r * np.cos(a), r * np.sin(a), z)
        for r, z in ((radius_low, 0), (radius_high, 90))
        for a in t
    ]
    return points, [[k, (k + 1) % sides, sides + (k + 1) % sides, sides + k] for k in range(sides)]


def links():
    """Return two rings of a chain, which do not touch."""
    points, faces = turned_around(40, 40)
    one = np.array(points) * [1, 1, 0.1]
    other = one[:, [0, 2, 1]] + [40, 4.5, -4.5]
    return np.r_[one, other], np.r_[faces, np.array(faces) + len(one)]


def parts_and_holes(job):
    return sum(p.count for p in job.parts), sum(len(p.holes) * p.count for p in job.parts)


def opened_in_few_parts(design):
    """Return what tells whether parts are at most four, and have the area of a design."""

    def measured(job):
        area = sum(part.area * part.count for part in job.parts)
        return parts_and_holes(job)[0] <= 4, abs(area / metrics.area(Mesh(*design)) - 1) < 0.012

    return measured


def longest(job):
    return round(max(job.parts[0].size), 4)


def radius_of(job):
    return round(min(bend.radius for part in job.parts for bend in part.bends), 4)


SHEET = {"finish": Finish(thickness=Thickness(1.5, k=0.5, radius=2.0))}
L, U, OPEN = ((50, 50), (90,)), ((40, 60, 40), (90, 90)), ((70, 30), (45,))
#: Cells of 15 openings in a plate, on its bend and beside it; slots of half a tube, and its length.
CELLS = [
    (i + a, j + b)
    for i in (3, 9, 15)
    for j in (4, 9, 14, 18, 22)
    for a, b in ((0, 0), (0, 1), (1, 0), (1, 1))
]
SLOTS, HALF = [(1, 7, 10), (4, 2, 6), (2, 12, 14)], round(80 + 15 * np.pi, 4)
#: Caps with an opening of 2 % of their area, which become strips side by side, none in two parts.
MIDDLE, RULED = np.array([(5, 5), (5, 6), (6, 5), (6, 6)]), {"formulation": "ruled"}
CAPS = cap(100, 90, 110, (14, 12), MIDDLE - 1), cap(100, 100, 120, (14, 14), MIDDLE + 1)
#: Kind of report, design, options, what is measured, the right value.
TABLE = [
    ("2 openings", plate([(1, 1)]), {}, parts_and_holes, (1, 1)),
    ("2 openings", plate([(1, 1), (2, 4)]), {"darts": True}, parts_and_holes, (1, 2)),
    ("2 openings", rolled(15.0, [(2, 8), (4, 8)]), {}, parts_and_holes, (1, 2)),
    ("2 across", bent_across(15.0, CELLS), {}, parts_and_holes, (1, 15)),
    ("2 across", bent_across(15.0, CELLS), {"darts": True}, radius_of, 15.0),
    ("2 in facets", slotted_tube([(1, 3, 4), (3, 8, 12)]), {}, parts_and_holes, (1, 2)),
    ("2 in facets", slotted_tube([(1, 3, 4)], 50, 90), {}, parts_and_holes, (1, 1)),
    ("2 in facets", slotted_half_tube(SLOTS), {}, parts_and_holes, (1, 3)),
    ("2 in facets", slotted_half_tube(SLOTS), {"darts": True}, longest, HALF),
    *(("2 strips", own, RULED, opened_in_few_parts(own), (True, True)) for own in CAPS),
    ("4 folds", folded(*L), SHEET, longest, round(shop_length(*L), 4)),
    ("4 folds", folded(*U), SHEET, longest, round(shop_length(*U), 4)),
    ("4 folds", folded(*OPEN), SHEET, longest, round(shop_length(*OPEN), 4)),
    ("4 lines", folded(*OPEN), {}, lambda job: len(job.parts[0].bends), 1),
    ("5 one seam", turned_around(40, 40), {}, parts_and_holes, (1, 0)),
    ("5 one seam", turned_around(60, 30), {}, parts_and_holes, (1, 0)),
    ("5 one seam", turned_around(40, 40, 4), {}, parts_and_holes, (1, 0)),
    ("5 tray", tray(), {}, parts_and_holes, (1, 0)),
    ("6 interlocked", links(), {}, lambda job: sum(p.count for p in job.parts), 2),
    ("10 radius", rolled(15.0), {}, radius_of, 15.0),
    ("10 radius", rolled(15.0, [(2, 8), (4, 8)]), {}, radius_of, 15.0),
    ("10 radius", rolled(8.0, [(3, 2)]), {}, radius_of, 8.0),
]


@pytest.mark.parametrize(
    ("design", "kinds"),
    [
        (bent_across(15.0, CELLS), ["cylinder", "plane", "plane"]),
        (slotted_tube([(1, 3, 4), (3, 8, 12)]), ["cylinder"]),
        (slotted_tube([(r, c, c + 1) for r in range(6) for c in range(0, 24, 2)]), ["cylinder"]),
        (slotted_tube([(1, 3, 4)], 50, 90), ["cone"]),
        (slotted_half_tube(SLOTS), ["cylinder", "plane", "plane"]),
        (slotted_tube([]), ["cylinder"]),
    ],
)
@pytest.mark.parametrize("rounded", [False, True])
def test_holes_do_not_divide_a_round_face(design, kinds, rounded):
    points, faces = design
    if rounded:
        turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
        points = np.round(points @ turn.T * np.sign(np.linalg.det(turn)), 3)
    mesh = Mesh(points, faces)
    shape = recognition.recognise(mesh)
    assert sorted(face.kind for face in shape.faces) == kinds
    np.testing.assert_array_equal(shape.vertices[: len(mesh.vertices)], mesh.vertices)
    # Chords of the widest strip are up to 3 % longer or shorter than their arcs, within a strip.
    change = shape.edge_lengths() / np.linalg.norm(
        np.diff(
            shape.vertices[shape.triangles], axis=1, append=shape.vertices[shape.triangles[:, :1]]
        ),
        axis=2,
    )
    assert np.abs(change - 1).max() < 0.03
    joined = folded_pattern(mesh)
    assert joined.parts == 1 and len(joined.bends.angles[joined.bends.radii == 0]) == 0


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=f"{row[0]} {k}", marks=[pytest.mark.slow] * (row[2] is RULED))
        for k, row in enumerate(TABLE)
    ],
)
def test_values_of_reports(row, tmp_path):
    _, design, options, measured, right = row
    job = flat(design, tmp_path, **options)
    assert job.usable and measured(job) == right
    if not options:
        pieces = gso.pieces(design, workers=0)
        assert pieces.usable and len(pieces) == sum(part.count for part in job.parts)


if __name__ == "__main__":
    for kind, design, options, measured, right in TABLE:
        with tempfile.TemporaryDirectory() as folder:
            now = measured(flat(design, folder, **options))
            sys.stdout.write(f"{kind:14}{right!s:>12}{now!s:>12}\n")
