"""Faces of shapes made by formula: kinds, equations, flat images, bend lines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from gso import MeshError, OptionError, recognition
from gso.mesh import Mesh

WAYS = ["grid", "random", "turned", "rounded", "coarse"]


def joined(parts):
    """One mesh of several (points, faces) that share vertices; also the first number of each."""
    points = np.concatenate([p for p, _ in parts])
    start = np.cumsum([0] + [len(p) for p, _ in parts[:-1]])
    faces = [tuple(int(v) + s for v in f) for (_, fs), s in zip(parts, start) for f in fs]
    _, first, number = np.unique(
        np.round(points / np.ptp(points), 8) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    number = number.ravel()
    rows = [[number[v] for v in f] + [-1] * (4 - len(f)) for f in faces]
    return points[first], np.array(rows), number


def domain(way, width, height, columns, rows, *, closed=False, seed=0, low=0.0):
    """Points in a rectangle and faces: quads along the sides, sheared, or random triangles."""
    if way == "coarse":
        columns, rows = 9, 2
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    rng = np.random.default_rng(seed)
    if way == "random" and not closed:
        # Points on the outline are even, and inside anywhere.
        edge = (u == 0) | (u == 1) | (v == 0) | (v == 1)
        inside = rng.uniform(0.02, 0.98, (int((~edge).sum()), 2))
        points = np.concatenate([np.stack([u[edge], v[edge]], axis=1), inside])
        cells = points * [columns, rows]
        triangles = Delaunay(cells).simplices
        p, q, r = cells[triangles].transpose(1, 0, 2)
        e, f = q - p, r - p
        area = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
        triangles = np.where((area < 0)[:, None], triangles[:, ::-1], triangles)
        return points * [width, height] + [0, low], triangles[np.abs(area) > 1e-9].tolist()
    if way == "random":
        # Points on the sides stay there.
        move = rng.uniform(-0.2, 0.2, (2, *u.shape))
        move[0][:, [0, -1]] = 0
        move[1][[0, -1]] = 0
        move[:, :, -1] = move[:, :, 0]
        u, v = u + move[0] / columns, v + move[1] / rows
    u, v = u * width, v * height
    if way == "turned":
        u = u + np.tan(np.radians(30)) * (v - height / 2)
    number = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (
        number[i : i + rows, j : j + columns].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))
    )
    if way != "random":
        faces = np.stack([a, b, c, d], axis=1).tolist()
    else:
        first = rng.random(a.size) < 0.5
        faces = [
            t
            for p, q, r, s, one in zip(a, b, c, d, first)
            for t in (((p, q, r), (p, r, s)) if one else ((p, q, s), (q, r, s)))
        ]
    return np.stack([u.ravel(), v.ravel() + low], axis=1), faces


def bent(zones):
    """Isometric map of the plane to a sheet bent along x by (length, curvature) zones."""

    def lift(uv):
        s, at, turn = uv[:, 0].copy(), np.zeros(2), 0.0
        out = np.full((len(uv), 2), np.nan)
        begin = 0.0
        for k, (length, curvature) in enumerate(zones):
            here = (s >= begin - 1e-9) | (k == 0)

            def move(t, at=at, turn=turn, curvature=curvature):
                if curvature == 0:
                    return at + np.stack([np.cos(turn) * t, np.sin(turn) * t], axis=-1)
                end = turn + curvature * t
                return at + np.stack(
                    [(np.sin(end) - np.sin(turn)) / curvature,
                     (np.cos(turn) - np.cos(end)) / curvature], axis=-1
                )  # fmt: skip

            out[here] = move(s[here] - begin)
            at, turn, begin = move(np.array(length)), turn + curvature * length, begin + length
        return np.stack([out[:, 0], uv[:, 1], out[:, 1]], axis=1)

    return lift


def rolled_cone(half_angle):
    """Isometric map of the plane, in polar coordinates (angle, distance), to a cone."""
    sine, cosine = np.sin(half_angle), np.cos(half_angle)

    def lift(polar):
        turn, r = polar[:, 0] / sine, polar[:, 1]
        return np.stack([r * sine * np.cos(turn), r * sine * np.sin(turn), -r * cosine], axis=1)

    return lift


def prepared(points, faces, way):
    return Mesh(np.round(points, 3) if way == "rounded" else points, faces)


def turned_in_space(points, seed=1):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return points @ (q * np.sign(np.linalg.det(q))).T + [12.0, -7.0, 3.0]


def flat_edges(corners):
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)


def flat_area(corners):
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return (e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]) / 2


def angle_between(a, b):
    return np.degrees(np.arccos(min(abs(float(a @ b)), 1.0)))


def tolerance(way):
    """Relative tolerances of lengths and of radii."""
    return (1e-4, 5e-3) if way == "rounded" else (1e-6, 1e-6)


def check_flat(shape, face, plane, way, scale=1.0):
    """The flat image has the lengths and orientation of the plane (n, 2) it was made from."""
    flat = shape.faces[face].flat
    triangles = shape.triangles[shape.faces[face].triangles]
    expected = flat_edges(plane[triangles])
    assert np.abs(flat_edges(flat) - expected).max() < tolerance(way)[0] * expected.max() * scale
    assert (flat_area(flat) > 0).all()


@pytest.mark.parametrize("way", WAYS)
def test_half_cylinder(way):
    radius, length = 1500.0, 5000.0
    plane, faces = domain(way, np.pi * radius, length, 40, 20)
    points = bent([(np.pi * radius, 1 / radius)])(plane)
    if way == "turned":
        # Parts beyond the half circle go on around the axis.
        turn = plane[:, 0] / radius
        points = np.stack([radius * np.sin(turn), plane[:, 1], radius * (1 - np.cos(turn))], axis=1)
    shape = recognition.recognise(prepared(points, faces, way))
    (face,) = shape.faces
    assert face.kind == "cylinder"
    assert face.radius == pytest.approx(radius, rel=tolerance(way)[1])
    assert angle_between(face.axis, np.array([0.0, 1.0, 0.0])) < 0.1
    check_flat(shape, 0, plane, way)
    assert flat_area(face.flat).sum() == pytest.approx(
        np.pi * radius * length, rel=tolerance(way)[0]
    )
    assert face.seam.size == 0
    # The concave side is above, so that the sheet bends up.
    assert all(line.up for line in face.bend_lines)
    if way != "turned":
        assert sum(line.limit for line in face.bend_lines) == 2
        assert sum(line.angle for line in face.bend_lines) == pytest.approx(np.pi, rel=1e-5)
        lengths = [np.linalg.norm(line.end - line.start) for line in face.bend_lines]
        assert lengths == pytest.approx([length] * len(lengths), rel=1e-5)


@pytest.mark.parametrize("way", WAYS)
def test_frustum(way):
    low, high, rise = 60.0, 150.0, 180.0
    half_angle = np.arctan((high - low) / rise)
    sine = np.sin(half_angle)
    sector = 2 * np.pi * sine
    assert np.degrees(sector) == pytest.approx(160.997, abs=1e-3)
    plane, faces = domain(way, sector, (high - low) / sine, 64, 12, closed=True, low=low / sine)
    if way == "turned":
        plane, _ = domain("grid", sector, (high - low) / sine, 64, 12, low=low / sine)
        plane[:, 0] += 0.003 * (plane[:, 1] - low / sine)
    if way == "coarse":
        plane, faces = domain("grid", sector, (high - low) / sine, 12, 2, low=low / sine)
    points, faces, _ = joined([(rolled_cone(half_angle)(plane), faces)])
    shape = recognition.recognise(prepared(turned_in_space(points), faces, way))
    (face,) = shape.faces
    assert face.kind == "cone"
    assert np.degrees(face.half_angle) == pytest.approx(np.degrees(half_angle), abs=0.05)
    tip = turned_in_space(np.zeros((1, 3)))[0]
    assert np.linalg.norm(face.apex - tip) < (0.1 if way == "rounded" else 1e-5)
    area = np.pi * (low + high) * np.hypot(high - low, rise)
    # Edges that are not along circles are straight in the plane.
    slack = 1e-4 if way == "rounded" else 1e-6
    flat = face.flat
    radii = np.linalg.norm(flat, axis=2)
    assert radii.min() == pytest.approx(low / sine, rel=slack)
    assert radii.max() == pytest.approx(high / sine, rel=slack)
    assert (flat_area(flat) > 0).all()
    # Straight edges cut segments off the two arcs.
    sides = 12 if way == "coarse" else 64
    if way in ("grid", "rounded", "coarse"):
        part = sector / sides
        expected = area - sides * (part - np.sin(part)) / 2 * (high**2 - low**2) / sine**2
        assert flat_area(flat).sum() == pytest.approx(expected, rel=slack)
        turned = sum(line.angle for line in face.bend_lines)
        assert turned == pytest.approx(2 * np.pi * np.cos(half_angle), rel=1e-4)
        along = shape.vertices[face.seam[:, 1]] - shape.vertices[face.seam[:, 0]]
        assert np.linalg.norm(along, axis=1).sum() == pytest.approx(
            np.hypot(high - low, rise), rel=1e-5
        )
    for line in face.bend_lines:
        for point, radius in ((line.start, line.radius_start), (line.end, line.radius_end)):
            # The distance from the axis along the normal.
            expected = np.linalg.norm(point) * np.tan(half_angle)
            assert radius == pytest.approx(expected, rel=5e-3)
        # The normals point to the axis.
        assert line.up


def zone_meshes(zones, width, way, counts, rows):
    """A bent sheet; rows of vertices are where its zones meet."""
    parts, begin = [], 0.0
    for (length, _), count in zip(zones, counts, strict=True):
        where = way if way in ("random",) else "grid"
        plane, faces = domain(where, length, width, count, rows, seed=0)
        plane[:, 0] += begin
        parts.append((plane, faces))
        begin += length
    flat = [(np.column_stack([p, np.zeros(len(p))]), f) for p, f in parts]
    plane, faces, _ = joined(flat)
    return plane[:, :2], faces


@pytest.mark.parametrize("way", ["grid", "random", "rounded", "coarse"])
def test_bracket(way):
    radius = 5.0
    zones = [(60.0, 0.0), (radius * np.pi / 2, 1 / radius), (40.0, 0.0)]
    counts = [1, 4, 1] if way == "coarse" else [6, 8, 4]
    plane, faces = zone_meshes(zones, 40.0, way, counts, 2 if way == "coarse" else 8)
    shape = recognition.recognise(prepared(turned_in_space(bent(zones)(plane)), faces, way))
    kinds = [face.kind for face in shape.faces]
    assert sorted(kinds) == ["cylinder", "plane", "plane"]
    bend = shape.faces[kinds.index("cylinder")]
    assert bend.radius == pytest.approx(radius, rel=tolerance(way)[1])
    for k in range(3):
        check_flat(shape, k, plane, way, scale=4.0)
    assert sum(line.angle for line in bend.bend_lines) == pytest.approx(np.pi / 2, rel=1e-3)
    assert sum(line.limit for line in bend.bend_lines) == 2
    areas = sorted(flat_area(face.flat).sum() for face in shape.faces)
    expected = sorted(length * 40.0 for length, _ in zones)
    assert areas == pytest.approx(expected, rel=1e-3 if way == "rounded" else 1e-6)
    for face in shape.faces:
        assert (face.kind == "plane") == (not face.bend_lines)


@pytest.mark.parametrize("way", ["grid", "random", "rounded", "coarse"])
def test_two_tangent_cylinders(way):
    zones = [(300.0, 1 / 200.0), (250.0, -1 / 120.0)]
    counts = [10, 12] if way == "coarse" else [24, 24]
    plane, faces = zone_meshes(zones, 150.0, way, counts, 6)
    shape = recognition.recognise(prepared(turned_in_space(bent(zones)(plane)), faces, way))
    assert [face.kind for face in shape.faces] == ["cylinder", "cylinder"]
    assert sorted(face.radius for face in shape.faces) == pytest.approx(
        [120.0, 200.0], rel=tolerance(way)[1]
    )
    for k in range(2):
        check_flat(shape, k, plane, way)
    ups = {round(face.radius): {line.up for line in face.bend_lines} for face in shape.faces}
    assert ups == {200: {True}, 120: {False}}


def test_tube_is_opened_where_no_hole_is():
    radius, height, around = 50.0, 150.0, 96
    plane, faces = domain("grid", 2 * np.pi * radius, height, around, 48)
    middle = plane[np.array(faces)].mean(axis=1)
    away = np.full(len(faces), np.inf)
    for k in range(6):
        at = (k * 2 * np.pi * radius / 6, height / 2)
        off = np.abs(middle[:, 0] - at[0])
        off = np.minimum(off, 2 * np.pi * radius - off)
        away = np.minimum(away, np.hypot(off, middle[:, 1] - at[1]))
    kept = [f for f, far in zip(faces, away) if far > 12.0]
    lift = np.stack(
        [radius * np.cos(plane[:, 0] / radius), radius * np.sin(plane[:, 0] / radius), plane[:, 1]],
        axis=1,
    )
    points, table, _ = joined([(lift, kept)])
    used = np.unique(table[table >= 0])
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    shape = recognition.recognise(Mesh(points[used], np.where(table < 0, -1, new[table])))
    (face,) = shape.faces
    assert face.kind == "cylinder"
    assert len(face.seam) == 48
    assert np.ptp(face.flat.reshape(-1, 2), axis=0) == pytest.approx(
        [2 * np.pi * radius, height], rel=1e-6
    )
    cell = (2 * np.pi * radius / around) * (height / 48)
    assert flat_area(face.flat).sum() == pytest.approx(len(kept) * cell, rel=1e-6)


@pytest.mark.parametrize("low", [50.0, 90.0])
def test_random_triangulation_is_opened_along_a_ruling(low):
    """New vertices are on the ruling, so that the seam is straight."""
    height = 150.0
    slope = (low - 50.0) / height
    plane, faces = domain("random", 2 * np.pi, height, 40, 16, closed=True)
    turn, z = plane.T
    radius = low - slope * z
    lift = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    # The points where the rectangle closes would be a straight seam.
    keep = np.abs(np.sin(turn / 2)) > 1e-9
    shift = np.where(keep, 0.0, 0.04 * np.sin(z))
    lift[~keep, :2] = (radius * [np.cos(shift), np.sin(shift)]).T[~keep]
    points, faces, _ = joined([(lift, faces)])
    shape = recognition.recognise((turned_in_space(points), faces))
    (face,) = shape.faces
    added = len(shape.vertices) - len(points)
    assert added > 16
    assert len(face.seam) == added - 1
    a, b = shape.vertices[face.seam].transpose(1, 0, 2)
    length = np.linalg.norm(b - a, axis=1)
    assert length.sum() == pytest.approx(np.hypot(height, low - 50.0), rel=1e-9)
    along = (b - a) / length[:, None]
    assert np.abs(np.abs(along @ along[0]) - 1).max() < 1e-9
    assert np.bincount(shape.source, minlength=len(faces)).min() == 1
    assert (flat_area(face.flat) > 0).all()
    # Outlines are as long as the circles.
    heights = shape.vertices @ face.axis
    lengths, end = shape.edge_lengths(), np.roll(shape.triangles, -1, axis=1)
    sizes = []
    for level in (heights.min(), heights.max()):
        here = np.isclose(heights, level, atol=1e-6)
        sizes.append(lengths[here[shape.triangles] & here[end]].sum() / (2 * np.pi))
    assert sorted(sizes) == pytest.approx([50.0, low], rel=1e-9)
    if low == 50:
        assert flat_area(face.flat).sum() == pytest.approx(2 * np.pi * 50 * height, rel=1e-9)


def extruded(outline, height):
    """A polygon as an open prism, one quad for each side."""
    outline = np.asarray(outline, float)
    n = len(outline)
    low = np.column_stack([outline, np.zeros(n)])
    points = np.concatenate([low, low + np.array([0, 0, height])])
    return points, n


@pytest.mark.parametrize("sides", [3, 4, 6, 8, 10])
def test_prism_stays_folded(sides):
    turn = 2 * np.pi * np.arange(sides) / sides
    points, n = extruded(np.stack([50 * np.cos(turn), 50 * np.sin(turn)], axis=1), 80.0)
    faces = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
    shape = recognition.recognise((points, faces))
    assert [face.kind for face in shape.faces] == ["plane"] * sides


def test_capped_tube_of_24_sides():
    turn = 2 * np.pi * np.arange(24) / 24
    points, n = extruded(np.stack([50 * np.cos(turn), 50 * np.sin(turn)], axis=1), 80.0)
    points = np.concatenate([points, [[0, 0, 0], [0, 0, 80]]])
    faces = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
    faces += [[(k + 1) % n, k, 48, -1] for k in range(n)]
    faces += [[k + n, (k + 1) % n + n, 49, -1] for k in range(n)]
    shape = recognition.recognise((points, faces))
    assert sorted(face.kind for face in shape.faces) == ["cylinder", "plane", "plane"]


@pytest.mark.parametrize("low", [50.0, 80.0])
def test_neighbours_agree_in_the_length_of_an_edge(low):
    """A cap, and a frustum or tube: the arcs of their circles are equally long on both sides."""
    turn = 2 * np.pi * np.arange(24) / 24
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros(24)], axis=1)
    points = np.concatenate([low * circle, 50 * circle + [0, 0, 70], [[0, 0, 70]]])
    n = 24
    faces = [[k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)]
    faces += [[k + n, (k + 1) % n + n, 48, -1] for k in range(n)]
    shape = recognition.recognise((turned_in_space(points), faces))
    assert sorted(face.kind for face in shape.faces)[1] == "plane"
    lengths, start = shape.edge_lengths(), shape.triangles
    end = np.roll(start, -1, axis=1)
    kinds = np.array([face.kind for face in shape.faces])[shape.face]
    top = (start >= n) & (start < 2 * n) & (end >= n) & (end < 2 * n)
    arc = 50 * 2 * np.pi / 24
    for kind in np.unique(kinds):
        found = lengths[(kinds == kind)[:, None] & top]
        assert len(found) == 24
        assert found == pytest.approx([arc] * 24, rel=1e-9)
    cap = shape.arcs[kinds == "plane"]
    assert np.sort(cap.ravel())[-24:] == pytest.approx([2 * np.pi / 24] * 24)
    if low == 80:
        bottom = lengths[(start < n) & (end < n)]
        assert bottom == pytest.approx([80 * 2 * np.pi / 24] * 24, rel=1e-9)


def prism_tube(outline, height, rows=1):
    n = len(outline)
    level = np.linspace(0, height, rows + 1)
    points = np.concatenate([np.column_stack([outline, np.full(n, z)]) for z in level])
    faces = [
        [j * n + k, j * n + (k + 1) % n, (j + 1) * n + (k + 1) % n, (j + 1) * n + k]
        for j in range(rows)
        for k in range(n)
    ]
    return points, faces


@pytest.mark.parametrize("count", [3, 4, 8])
def test_tube_with_rounded_corners(count):
    corners = [
        (40 * x + 10 * np.cos(a), 20 * y + 10 * np.sin(a))
        for x, y, begin in ((1, 1, 0), (-1, 1, 90), (-1, -1, 180), (1, -1, 270))
        for a in np.radians(begin + np.linspace(0, 90, count + 1))
    ]
    shape = recognition.recognise(prism_tube(corners, 80.0))
    assert sorted(face.kind for face in shape.faces) == ["cylinder"] * 4 + ["plane"] * 4
    for face in shape.faces:
        if face.kind == "cylinder":
            assert face.radius == pytest.approx(10, rel=1e-9)
            assert face.bend_angle == pytest.approx(np.pi / 2, rel=1e-9)
            assert not any(line.up for line in face.bend_lines)


def test_shaft_with_a_flat():
    turn = np.radians(np.linspace(0, 330, 67))
    outline = 50 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    shape = recognition.recognise(prism_tube(outline, 80.0, rows=3))
    assert sorted(face.kind for face in shape.faces) == ["cylinder", "plane"]
    cylinder = next(face for face in shape.faces if face.kind == "cylinder")
    assert cylinder.seam.size == 0
    assert np.ptp(cylinder.flat[..., 0]) == pytest.approx(50 * np.radians(330), rel=1e-9)


@pytest.mark.parametrize("bend", [10.0, 45.0, 90.0])
def test_elbow_of_two_pipes(bend):
    turn = 2 * np.pi * np.arange(48) / 48
    low = 30 * np.stack([np.cos(turn), np.sin(turn), np.zeros(48)], axis=1)
    mitre = np.radians(bend / 2)
    cut = low + np.outer(100 + low[:, 0] * np.tan(mitre), [0, 0, 1])
    normal = np.array([-np.sin(mitre), 0, np.cos(mitre)])
    high = low - 2 * np.outer((low - [0, 0, 100]) @ normal, normal)
    faces = [
        [j * 48 + k, j * 48 + (k + 1) % 48, (j + 1) * 48 + (k + 1) % 48, (j + 1) * 48 + k]
        for j in range(2)
        for k in range(48)
    ]
    shape = recognition.recognise((np.concatenate([low, cut, high]), faces))
    assert [face.kind for face in shape.faces] == ["cylinder", "cylinder"]
    one, two = shape.faces
    assert np.degrees(np.arccos(abs(one.axis @ two.axis))) == pytest.approx(bend, abs=1e-6)
    for face in shape.faces:
        # The mitre is a sine curve in the plane.
        assert np.ptp(face.flat[..., 0]) == pytest.approx(2 * np.pi * 30, rel=1e-9)
        assert np.ptp(face.flat[..., 1]) == pytest.approx(100 + 30 * np.tan(mitre), rel=1e-9)
        assert len(face.seam) == 1


def test_strip_around_a_cylinder_is_not_opened():
    turn = np.linspace(0, 5 * np.pi, 120)
    grid = np.stack(
        [np.stack([40 * np.cos(turn), 40 * np.sin(turn), 8 * turn + w], axis=1) for w in (0, 9, 20)]
    )
    (face,) = recognition.recognise(grid).faces
    assert face.kind == "cylinder"
    assert face.seam.size == 0
    assert np.ptp(face.flat[..., 0]) == pytest.approx(40 * 5 * np.pi, rel=1e-9)


def test_closed_extrusion_is_opened_along_a_ruling():
    turn = 2 * np.pi * np.arange(40) / 40
    outline = np.stack([60 * np.cos(turn), 40 * np.sin(turn)], axis=1)
    shape = recognition.recognise(prism_tube(outline, 80.0, rows=4))
    (face,) = shape.faces
    assert face.kind == "torsal"
    assert len(face.seam) == 4
    around = np.linalg.norm(outline - np.roll(outline, -1, axis=0), axis=1).sum()
    assert flat_area(face.flat).sum() == pytest.approx(80 * around, rel=1e-9)


def test_torus_is_free():
    u, v = np.meshgrid(2 * np.pi * np.arange(24) / 24, 2 * np.pi * np.arange(16) / 16)
    ring = 50 + 20 * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), 20 * np.sin(v)], axis=-1)
    number = np.arange(u.size).reshape(u.shape)
    right, up = np.roll(number, -1, axis=1), np.roll(number, -1, axis=0)
    both = np.roll(right, -1, axis=0)
    faces = np.stack([number, right, both, up], axis=-1).reshape(-1, 4)
    shape = recognition.recognise((points.reshape(-1, 3), faces))
    assert {face.kind for face in shape.faces} == {"free"}


def test_box_and_channel():
    corners = np.array([[x, y, z] for x in (0, 4) for y in (0, 3) for z in (0, 2)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    assert [f.kind for f in recognition.recognise((corners, quads)).faces] == ["plane"] * 6
    halves = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    shape = recognition.recognise((corners, halves))
    assert sorted(flat_area(f.flat).sum() for f in shape.faces) == pytest.approx(
        [6, 6, 8, 8, 12, 12]
    )
    outline = np.array([[0, 40], [0, 0], [80, 0], [80, 40], [60, 40]], float)
    grid = np.stack([np.column_stack([outline, np.full(5, z)]) for z in np.linspace(0, 200, 5)])
    shape = recognition.recognise(grid)
    assert [face.kind for face in shape.faces] == ["plane"] * 4
    assert not any(face.bend_lines for face in shape.faces)


def square_to_round(side=120.0, radius=60.0, rise=150.0, count=16):
    """A sheet-metal transition: corners of a square, and arcs above them."""
    corner = side / 2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
    turn = 2 * np.pi * np.arange(4 * count) / (4 * count)
    top = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(len(turn), rise)])
    points = np.concatenate([top, np.column_stack([corner, np.zeros(4)])])
    n = len(top)
    faces = []
    for k in range(4):
        for j in range(k * count, (k + 1) * count):
            faces.append([j, n + k, (j + 1) % n])
        # A triangle from the end of the arc to the next corner.
        faces.append([(k + 1) * count % n, n + k, n + (k + 1) % 4])
    return points, np.array(faces)


def test_square_to_round():
    points, faces = square_to_round()
    shape = recognition.recognise((points, faces))
    kinds = [face.kind for face in shape.faces]
    assert sorted(kinds) == ["cone"] * 4 + ["plane"] * 4
    corners = points[-4:]
    for face in shape.faces:
        edges = flat_edges(points[faces[face.triangles]])
        assert np.abs(flat_edges(face.flat) - edges).max() < 1e-9
        if face.kind == "cone":
            assert np.linalg.norm(corners - face.apex, axis=1).min() < 1e-6
            assert len(face.bend_lines) == 15


@pytest.mark.parametrize("sides", [12, 40])
def test_cone_with_its_apex(sides):
    turn = 2 * np.pi * np.arange(sides) / sides
    rows = np.array([0.4, 0.7, 1.0])
    ring = np.stack([100 * np.cos(turn), 100 * np.sin(turn), np.full(sides, 170.0)], axis=1)
    points = np.concatenate([[[0, 0, 0]], *(r * ring for r in rows)])
    faces = [[0, 1 + k, 1 + (k + 1) % sides, -1] for k in range(sides)]
    for j in range(2):
        low, high = 1 + j * sides, 1 + (j + 1) * sides
        faces += [
            [low + k, high + k, high + (k + 1) % sides, low + (k + 1) % sides] for k in range(sides)
        ]
    shape = recognition.recognise((turned_in_space(points), faces))
    (face,) = shape.faces
    assert face.kind == "cone"
    assert len(face.seam) == 3
    slant = np.hypot(100, 170)
    assert np.linalg.norm(face.flat, axis=2).max() == pytest.approx(slant, rel=1e-7)
    part = 2 * np.pi * (100 / slant) / sides
    assert flat_area(face.flat).sum() == pytest.approx(
        sides * slant**2 * np.sin(part) / 2, rel=1e-6
    )


def helix_tangents(domain_points):
    """Points at distances (second column) on tangents of a helix (parameters in the first)."""
    t, r = domain_points.T
    curve = np.stack([50 * np.cos(t), 50 * np.sin(t), 30 * t], axis=1)
    along = np.stack([-50 * np.sin(t), 50 * np.cos(t), np.full_like(t, 30)], axis=1)
    return curve + r[:, None] * along / np.hypot(50, 30)


def unrolled_helix(domain_points):
    """The same points in the plane: tangents of a circle of the helix' curvature."""
    t, r = domain_points.T
    radius = (50**2 + 30**2) / 50
    turn = t * np.hypot(50, 30) / radius
    circle = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return circle + r[:, None] * np.stack([-np.sin(turn), np.cos(turn)], axis=1)


@pytest.mark.parametrize("way", ["grid", "random", "turned", "rounded"])
def test_tangent_developable(way):
    plane, faces = domain("grid" if way == "turned" else way, 1.6, 60.0, 60, 12, low=20.0)
    if way == "turned":
        plane[:, 0] += 0.004 * (plane[:, 1] - 50.0)
    shape = recognition.recognise(prepared(helix_tangents(plane), faces, way))
    (face,) = shape.faces
    assert face.kind == "torsal"
    assert face.strain < 1e-4
    triangles = shape.triangles[face.triangles]
    expected = flat_edges(unrolled_helix(plane)[triangles])
    assert np.abs(flat_edges(face.flat) - expected).max() < 1e-3 * expected.max()
    assert flat_area(face.flat).sum() == pytest.approx(
        np.abs(flat_area(unrolled_helix(plane)[triangles])).sum(), rel=5e-4
    )
    assert (flat_area(face.flat) > 0).all()
    # Of constant slope, the surface turns by the torsion along the curve.
    turned = 1.6 * 30 / np.hypot(50, 30)
    assert sum(line.angle for line in face.bend_lines) == pytest.approx(turned, rel=0.15)
    if way == "grid":
        assert len(face.bend_lines) == 59
        lengths = [np.linalg.norm(line.end - line.start) for line in face.bend_lines]
        assert lengths == pytest.approx([60.0] * 59, rel=1e-6)


def loft(count, turned=False):
    """Two parallel ellipses' arcs with the same tangents at the ends of each ruling."""
    t = np.linspace(0.1, 1.9, count + 1)
    low = np.stack([80 * np.cos(t), 50 * np.sin(t), np.zeros_like(t)], axis=1)
    s = np.arctan2(50 * 70 * np.sin(t), 80 * 40 * np.cos(t) * 1.0) if turned else t
    high = np.stack([0.6 * 80 * np.cos(s), 0.6 * 50 * np.sin(s) + 10, np.full_like(t, 60)], axis=1)
    return np.stack([low, (low + high) / 2, high])


@pytest.mark.parametrize("count", [8, 30])
def test_loft(count):
    shape = recognition.recognise(loft(count))
    (face,) = shape.faces
    # Homothetic arcs: all rulings pass one point, of a cone that is not circular.
    assert face.kind == "cone"
    assert face.surface is None
    low, high = loft(count)[[0, 2]]
    scale = 1 / (1 - 0.6)
    assert face.apex == pytest.approx(low[0] + scale * (high[0] - low[0]), abs=1e-5)
    space = flat_edges(shape.vertices[shape.triangles[face.triangles]])
    assert np.abs(flat_edges(face.flat) - space).max() < 1e-7
    assert len(face.bend_lines) == count - 1


def test_extruded_parabola():
    x = np.linspace(-40, 60, 31)
    grid = np.stack(
        [np.stack([x, np.full_like(x, y), x**2 / 90], axis=1) for y in np.linspace(0, 90, 4)]
    )
    shape = recognition.recognise(grid)
    (face,) = shape.faces
    assert face.kind == "torsal"
    assert angle_between(face.axis, np.array([0.0, 1.0, 0.0])) < 1e-4
    inner = face.bend_lines
    at = x[1:-1]
    radii = sorted(45 * (1 + (at / 45) ** 2) ** 1.5)
    assert sorted(line.radius_start for line in inner) == pytest.approx(radii, rel=0.01)
    # The first direction of the grid is along the rulings: its normal points down.
    assert not any(line.up for line in inner)


def sphere_patch(rows=12, columns=16, top=1.2):
    v, u = np.meshgrid(np.linspace(0.3, top, rows + 1), np.linspace(0, 2.0, columns + 1))
    return np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1) * 70


@pytest.mark.parametrize("scale", [(1, 1, 1), (1.5, 1.0, 0.6)])
@pytest.mark.parametrize("way", ["grid", "random", "rounded", "full"])
def test_sphere_and_ellipsoid_are_free(scale, way):
    if way == "full":
        grid = sphere_patch(24, 24, 2.8) * scale
        assert {f.kind for f in recognition.recognise(grid).faces} == {"free"}
        return
    plane, faces = domain("random" if way == "random" else "grid", 2.0, 0.9, 16, 12, low=0.3)
    u, v = plane.T
    points = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=1)
    points = 70 * points * scale
    faces = [list(f) + [-1] * (4 - len(f)) for f in faces]
    shape = recognition.recognise(prepared(points, faces, way))
    assert {face.kind for face in shape.faces} == {"free"}
    assert not shape.developable.any()
    # Free triangles are in their true size.
    space = flat_edges(shape.vertices[shape.triangles])
    assert np.abs(flat_edges(shape.flat()) - space).max() < 1e-9


def test_rows_of_a_sphere_are_cones_where_that_is_known():
    grid = sphere_patch(24, 16, 2.8)
    mesh = Mesh(grid.reshape(-1, 3), Mesh.from_grid(grid).triangles)
    row = (mesh.triangles % grid.shape[1]).min(axis=1)
    shape = recognition.recognise(mesh, parts=row)
    assert len(shape.faces) == grid.shape[1] - 1
    assert {face.kind for face in shape.faces} <= {"cone", "cylinder"}
    # Chords of the largest circle span an eighth.
    away = 70 * (1 - np.cos(1 / 16))
    assert 0.97 * away < shape.chord < away
    assert {face.kind for face in recognition.recognise(mesh, parts=0 * row - 1).faces} == {"free"}


def test_cylinder_that_ends_in_a_sphere():
    turn = np.linspace(0, 2.5, 25)
    level = np.linspace(-1.0, 0.0, 5)
    lift = np.linspace(0, 1.2, 11)[1:]
    rows = [np.stack([np.cos(turn), np.sin(turn), np.full_like(turn, z)], axis=1) for z in level]
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    rows += [np.cos(v) * ring + np.array([0, 0, np.sin(v)]) for v in lift]
    shape = recognition.recognise(np.stack(rows) * 40)
    assert sorted(face.kind for face in shape.faces) == ["cylinder", "free"]
    cylinder = next(face for face in shape.faces if face.kind == "cylinder")
    assert cylinder.radius == pytest.approx(40)
    assert len(cylinder.triangles) == 2 * 24 * 4
    assert flat_area(cylinder.flat).sum() == pytest.approx(40 * 2.5 * 40, rel=1e-6)


@pytest.mark.parametrize("way", ["grid", "random", "turned"])
def test_noisy_cylinder(way):
    radius, length = 1500.0, 5000.0
    plane, faces = domain(way, np.pi * radius, length, 40, 20)
    turn = plane[:, 0] / radius
    points = np.stack([radius * np.sin(turn), plane[:, 1], radius * (1 - np.cos(turn))], axis=1)
    size = np.linalg.norm(np.ptp(points, axis=0))
    noise = np.random.default_rng(5).normal(size=points.shape)
    noise *= 0.0005 * size / np.linalg.norm(noise, axis=1).max()
    shape = recognition.recognise(Mesh(points + noise, faces), max_deviation="0.1%")
    (face,) = shape.faces
    assert face.kind == "cylinder"
    assert face.radius == pytest.approx(radius, rel=0.01)
    assert angle_between(face.axis, np.array([0.0, 1.0, 0.0])) < 0.1
    assert 0 < face.deviation < 0.001 * size
    assert np.abs(face.deviation - 0.0005 * size) < 0.0004 * size


@pytest.mark.parametrize("way", ["grid", "random"])
def test_noisy_sheet_with_two_plates(way):
    zones = [(200.0, 0.0), (300.0, 1 / 200.0), (250.0, 0.0)]
    plane, faces = zone_meshes(zones, 150.0, way, [8, 24, 8], 6)
    points = bent(zones)(plane)
    size = np.linalg.norm(np.ptp(points, axis=0))
    noise = np.random.default_rng(3).normal(size=points.shape)
    noise *= 5e-4 * size / np.linalg.norm(noise, axis=1).max()
    shape = recognition.recognise(Mesh(points + noise, faces), max_deviation="0.1%")
    assert sorted(face.kind for face in shape.faces) == ["cylinder", "plane", "plane"]
    bend = next(face for face in shape.faces if face.kind == "cylinder")
    assert bend.radius == pytest.approx(200.0, rel=0.01)
    # Where a plate is as close to the cylinder as is allowed, it may belong to it.
    apart = 0.001 * np.linalg.norm(np.ptp(points + noise, axis=0))
    assert bend.bend_angle == pytest.approx(1.5, abs=2 * np.sqrt(2 * apart / 200.0))


def test_fine_cylinder_is_quick_and_one_face():
    turn = np.linspace(0, 3.0, 301)
    grid = np.stack(
        [np.stack([np.cos(turn), np.sin(turn), np.full_like(turn, z)], axis=1)
         for z in np.linspace(0, 4, 168)]
    )  # fmt: skip
    (face,) = recognition.recognise(grid).faces
    assert face.kind == "cylinder"


def test_plate_is_a_plane():
    y, x = np.mgrid[:20, :30] / 10
    for z in (0 * x, 0.2 * x - 0.4 * y):
        (face,) = recognition.recognise(np.stack([x, y, z], axis=-1)).faces
        assert face.kind == "plane"
        assert face.bend_lines == ()


def test_bad_options_are_named():
    grid = sphere_patch()
    for option, value in (("max_deviation", -1), ("max_strain", "5mm"), ("bend_step", 0)):
        with pytest.raises(OptionError, match=option):
            recognition.recognise(grid, **{option: value})
    with pytest.raises(OptionError, match="parts has 3 numbers"):
        recognition.recognise(grid, parts=[0, 0, 0])
    with pytest.raises(MeshError):
        recognition.recognise(np.full((4, 4, 3), np.nan))
