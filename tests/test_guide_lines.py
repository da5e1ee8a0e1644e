"""Guide lines of curved parts without bends, and the pictures of parts in their places."""

import re

import numpy as np
import pytest

import gso
from gso.geometry import in_front, nearest_triangles
from gso.workshop import (
    Drawing,
    GuideLine,
    Panel,
    Part,
    Places,
    guide_lines,
    of_surface,
    united,
    writers,
)


def sheet(points, flat):
    """A panel of grids (h, w, 3) and (h, w, 2)."""
    return Panel("a", gso.as_mesh(points), flat.reshape(-1, 2))


def cylinder(radius=2.0):
    y, turn = np.mgrid[:9, :17] / 16
    points = np.stack([radius * np.sin(turn), y, radius * np.cos(turn)], axis=-1)
    return points, np.stack([radius * turn, y], axis=-1)


def test_a_cylinder_is_guided_along_its_axis():
    guides = guide_lines(sheet(*cylinder()))
    assert len(guides) >= 5
    for guide in guides:
        assert len(guide.line) == 2
        assert np.degrees(guide.angle) < 0.1
        assert abs(guide.line[1, 0] - guide.line[0, 0]) < 1e-3
        assert np.ptp(guide.line[:, 1]) == pytest.approx(0.5, abs=1e-6)


def test_a_cone_is_guided_to_its_apex():
    s, turn = np.mgrid[1:2:9j, 0:1:17j]
    slope = np.radians(30.0)
    points = np.stack([s * np.cos(turn), s * np.sin(turn), s / np.tan(slope)], axis=-1)
    long, angle = s / np.sin(slope), turn * np.sin(slope)
    flat = np.stack([long * np.cos(angle), long * np.sin(angle)], axis=-1)
    for guide in guide_lines(sheet(points, flat)):
        assert np.degrees(guide.angle) < 0.5
        (a, b), way = guide.line[[0, -1]], guide.line[-1] - guide.line[0]
        off = abs(a[0] * way[1] - a[1] * way[0]) / np.hypot(*way)
        assert off < 0.02 * np.hypot(*b)


def test_flat_and_bent_panels_have_none():
    points, flat = cylinder()
    plane = np.concatenate([flat, 0.0 * flat[..., :1]], axis=-1)
    assert guide_lines(sheet(plane, flat)) == ()
    bent = Panel(
        "a",
        gso.as_mesh(points),
        flat.reshape(-1, 2),
        np.array([[8, 25]]),
        np.array([0.1]),
        np.array([1.0]),
    )
    assert guide_lines(bent) == ()


def test_a_doubly_curved_panel_is_not_straight():
    y, x = np.mgrid[-1:1:17j, -1:1:17j]
    points = np.stack([x, y, 0.1 * x * x + 0.05 * x * x * y], axis=-1)
    straight = max(g.angle for g in guide_lines(sheet(*cylinder())))
    guides = guide_lines(sheet(points, points[..., :2]))
    assert max(g.angle for g in guides) > 20 * straight


def test_guide_lines_are_drawn_and_told(tmp_path):
    y, x = np.mgrid[-1:1:17j, -1:1:17j]
    design = gso.as_mesh(100.0 * np.stack([x, y, 0.2 * x * x - 0.1 * y * y], axis=-1))
    done = gso.fabricate(design, tmp_path, formulation="curvature", max_deviation="3%")
    (part,) = done.parts
    assert part.guides
    assert not part.bends
    assert "degrees from straight" in part.guides[0].in_words()
    (record,) = done.certificate["designs"][0]["parts"]
    assert record["guide_lines"] == len(part.guides)
    assert record["guide_angle_max"] == pytest.approx(
        np.degrees(max(guide.angle for guide in part.guides))
    )
    assert any("guide lines" in note for note in done.certificate["notes"])
    writers.write(Drawing((part,)), tmp_path / "part.dxf")
    assert "GUIDE" in (tmp_path / "part.dxf").read_text()
    turned = part.turned(np.pi / 2)
    before, after = (p.guides[0].line[0] for p in (part, turned))
    assert np.allclose(after, [-before[1], before[0]])


def test_the_page_shows_parts_in_their_places(tmp_path):
    y, x = np.mgrid[-1:1:25j, -1:1:25j]
    design = gso.as_mesh(100.0 * np.stack([x, y, 0.3 * x * x + 0.2 * y * y], axis=-1))
    done = gso.fabricate(design, tmp_path, max_deviation="0.5%")
    assert len(done.parts) > 1
    page = (tmp_path / "index.html").read_text()
    # From both sides, and a picture of each step of joining.
    assert page.count("data:image/png;base64,") == 2 + len(done.parts)
    links = set(re.findall(r'<a [^>]*href="#([^"]+)"', page))
    places = set(re.findall(r'<figure id="([^"]+)"', page))
    assert links == places
    assert len(places) == len(done.parts)
    assert "parts per m²" in page


def test_hidden_lines_are_not_drawn():
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.concatenate([np.c_[square, np.zeros(4)], np.c_[0.3 * square, -np.full(4, 0.1)]])
    # The smaller square is seen from below only.
    mesh = gso.Mesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]])
    flat = points[:, :2].copy()
    flat[4:] += [5.0, 0.0]
    made = of_surface("two", mesh, gso.Pattern(flat, mesh.faces, np.arange(8)), {})
    pictures = [picture.svg(lambda name: f"#{name}") for picture in Places(made).pictures]
    assert [len(re.findall("<title", picture)) for picture in pictures] == [1, 2]
    rims = [re.search('<path class="rim" d="([^"]*)"', picture)[1] for picture in pictures]
    # Eight edges are seen from below, and four from above: two numbers each after the first point.
    steps = [re.findall(r"l([^M]*)", rim) for rim in rims]
    edges = [sum(len(re.findall(r"-?[\d.]+", step)) // 2 for step in own) for own in steps]
    assert edges == [4, 8]


def test_a_depth_buffer_is_right():
    rng = np.random.default_rng(3)
    corners = rng.uniform([0, 0, 0], [12, 9, 5], (20, 3, 3))
    triangle, depth = nearest_triangles(corners, (9, 12))
    for i in range(9):
        for j in range(12):
            best = (-np.inf, -1)
            for number, (a, b, c) in enumerate(corners):
                system = np.stack([b - a, c - a])[:, :2].T
                s, t = np.linalg.solve(system, np.array([j + 0.5, i + 0.5]) - a[:2])
                if min(s, t, 1 - s - t) >= 0:
                    z = a[2] + s * (b - a)[2] + t * (c - a)[2]
                    best = max(best, (z, number))
            assert triangle[i, j] == best[1]
            assert depth[i, j] == pytest.approx(best[0])


def test_points_in_front_are_seen():
    plane = np.array([[[0.0, 0, 1], [9, 0, 1], [9, 9, 1]], [[0, 0, 1], [9, 9, 1], [0, 9, 1]]])
    _, depth = nearest_triangles(plane, (9, 9))
    points = np.array([[4.0, 4, 2], [4, 4, 1], [4, 4, 0.5], [4, 4, 0]])
    assert in_front(points, depth, 0.6).tolist() == [True, True, True, False]


def test_parts_with_other_guide_lines_are_not_the_same():
    square = np.array([[0.0, 0], [50, 0], [50, 50], [0, 50]])
    across, along = (
        (GuideLine(line, 0.0),)
        for line in (np.array([[25.0, 0], [25, 50]]), np.array([[0.0, 20], [50, 20]]))
    )
    parts = [Part("flat", square)]
    parts += [Part(f"p{k}", square, guides=g) for k, g in enumerate((across, along, across))]
    kept, same = united(parts)
    assert [part.count for part in kept] == [1, 2, 1]
    assert same == {"p2": "p0"}


def test_a_narrow_strip_has_guide_lines_and_those_of_a_cap_are_nearly_straight():
    turn, y = np.mgrid[0:2:41j, 0:0.02:3j]
    points = np.stack([np.sin(turn), y, np.cos(turn)], axis=-1)
    assert guide_lines(sheet(points, np.stack([turn, y], axis=-1)))
    y, x = np.mgrid[-1:1:17j, -1:1:17j]
    cap = np.stack([x, y, np.sqrt(9.0 - x * x - y * y)], axis=-1)
    guides = guide_lines(sheet(cap, cap[..., :2]))
    assert all(np.degrees(guide.angle) <= 45.0 for guide in guides)


def test_notes_tell_of_strips_and_not_of_kept_parts(tmp_path):
    y, x = np.mgrid[-1:1:17j, -1:1:17j]
    bump = np.stack([x, y, 0.25 * x * x - 0.4 * y * y], axis=-1)
    design = gso.as_mesh(100.0 * bump)
    done = gso.fabricate(design, tmp_path / "a", max_deviation="3%", scale=1.0)
    (record,) = done.certificate["designs"]
    assert record["crease_angle_max"] >= 0.0
    # A polygon that is meant as one.
    turn = 2 * np.pi * np.arange(20) / 20
    polygon = gso.Mesh(
        np.c_[100.0 * np.cos(turn), 100.0 * np.sin(turn), 0.0 * turn],
        [[0, k, k + 1] for k in range(1, 19)],
    )
    done = gso.fabricate(polygon, tmp_path / "b")
    assert done.usable
    assert not any("polygons" in note for note in done.certificate["notes"])


def test_the_table_of_designs_has_a_heading_for_each_column(tmp_path):
    flat = gso.as_mesh(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))]))
    assert gso.fabricate(flat, tmp_path).usable
    table = (tmp_path / "index.html").read_text().split("<table>")[1].split("</table>")[0]
    assert table.count("<th>") == table.count("<td>")
