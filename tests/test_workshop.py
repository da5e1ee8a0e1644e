"""Panels, parts and their finish: what a workshop gets of a surface."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
import trimesh

import gso
from gso import OptionError
from gso.mesh import Mesh, Nearest
from gso.workshop import (
    Bend,
    Design,
    FabricationSettings,
    Finish,
    Notch,
    Panel,
    Part,
    Thickness,
    fit_notes,
    fitted,
    made,
    origins,
    parts_from,
    thickened,
    united,
)
from tests.test_pieces import dome


def arch(n: int = 65, turn: float = np.pi / 2, radius: float = 1.0, long: float = 2.0) -> Mesh:
    """A sector of a cylinder, outside face up."""
    t = np.linspace(0, turn, n)
    y = np.linspace(0, long, 9)
    t, y = np.meshgrid(t, y, indexing="ij")
    return gso.as_mesh(np.stack([radius * np.sin(t), y, radius * np.cos(t)], axis=-1))


def cone(n: int = 65, turn: float = np.pi / 2) -> Mesh:
    """A sector of a cone between the slant lengths 1 and 2, half angle 30 degrees."""
    t, s = np.meshgrid(np.linspace(0, turn, n), np.linspace(1, 2, 9), indexing="ij")
    r = s * np.sin(np.pi / 6)
    return gso.as_mesh(np.stack([r * np.sin(t), -s * np.cos(np.pi / 6), r * np.cos(t)], axis=-1))


SQUARE = Part("square", np.array([[0.0, 0], [100, 0], [100, 50], [0, 50]]))


@cache
def domed(height: float, far: str = "1%"):
    """A dome that was made within a distance, shared by tests that read it."""
    design = Design("dome", dome(17, height=height))
    return made(design, FabricationSettings(max_deviation=far))


def parts_of(whole, scale, finish, marks=(), holes=()):
    """The parts of a design, whose holes can all be cut."""
    own = fitted(whole, scale, finish, marks, holes)
    if own.reasons:
        raise OptionError("; ".join(map(str, own.reasons)))
    return parts_from(own, finish)[0]


def to_surface(panel, points):
    """Points (k, 2) of a panel's pattern, carried to its surface, (k, 3)."""
    triangles = panel.surface.triangles
    flat, given = (np.pad(x, ((0, 0), (0, 1))) for x in (panel.flat, points))
    place, shares, _ = Nearest.of(flat, triangles).locate(given)
    return np.einsum("kc,kcd->kd", shares, panel.surface.vertices[triangles[place]])


def bent(angles, width=1.0, radius=np.inf):
    """A panel of plates of the same width, folded along parallel lines."""
    count = len(angles) + 1
    x = width * np.arange(count + 1)
    flat = np.stack([np.repeat(x, 2), np.tile([0.0, 1.0], count + 1)], axis=1)
    k = 2 * np.arange(count)
    faces = np.stack([k, k + 2, k + 3, k + 1], axis=1)
    bends = np.stack([k[1:], k[1:] + 1], axis=1)
    radii = np.full(len(angles), radius)
    return Panel(
        "p", Mesh(np.c_[flat, 0 * flat[:, 0]], faces), flat, bends, np.array(angles), radii
    )


def arcs(part, seam):
    """Arc lengths along the outline between the notches of a seam, in order."""
    ring = shapely.LinearRing(part.outline)
    at = np.array(
        [ring.project(shapely.Point(n.at)) for n in part.notches if n.text == str(seam.number)]
    )
    # The seam may run over the first point of the outline.
    gap = np.diff(np.r_[np.sort(at), np.sort(at)[:1] + ring.length])
    return np.diff(at) % ring.length if len(at) > 1 else gap[:0]


def _centre(points):
    """The centre of the circle through points (k, 2), by least squares."""
    matrix = np.c_[2 * points, np.ones(len(points))]
    return np.linalg.lstsq(matrix, (points**2).sum(axis=1), rcond=None)[0][:2]


def area_of_hole(ring):
    """The area of a ring, which has to be clockwise as holes are."""
    assert not shapely.LinearRing(ring).is_ccw
    return shapely.Polygon(ring).area


def outline_length(part):
    return np.linalg.norm(np.roll(part.outline, -1, axis=0) - part.outline, axis=1).sum()


class TestThickness:
    @pytest.mark.parametrize("face, radius", [("middle", 1.0), ("outside", 0.98), ("inside", 1.02)])
    def test_a_rolled_cylinder_has_the_length_of_its_neutral_surface(self, face, radius):
        # The design is a cylinder of radius 1; the sheet is 0.04 thick.
        n = 1000
        angle = np.pi / 2 / n
        panel = bent([angle] * (n - 1), width=2 * np.sin(angle / 2))
        sheet = Thickness(0.04, k=0.5, face=face)
        long = np.ptp(thickened(panel, sheet).flat[:, 0])
        # Of n bends only n - 1 are inside; the others are halves at both ends.
        want = radius * np.pi / 2 - (radius - 1.0) * angle
        assert long == pytest.approx(want, rel=1e-6)

    @pytest.mark.parametrize("face, offset", [("outside", -0.02), ("inside", 0.02)])
    def test_a_rolled_cone_has_the_pattern_of_its_neutral_surface(self, face, offset):
        # A sector of half angle 30 degrees between the slant lengths 1 and 2, in n flat plates.
        n, half, turn = 1000, np.pi / 6, np.pi / 2
        theta = turn * np.arange(n + 1) / n
        # The plates are isosceles: two slants and a chord of the circle of the cone's rim.
        plate = 2 * np.arcsin(np.sin(half) * np.sin(turn / n / 2))
        around = plate * np.arange(n + 1)
        flat = np.concatenate([[[r * np.cos(a), r * np.sin(a)] for a in around] for r in (1, 2)])
        r = np.repeat([1.0, 2.0], n + 1) * np.sin(half)
        high = -np.repeat([1.0, 2.0], n + 1) * np.cos(half)
        points = np.stack([r * np.cos(np.tile(theta, 2)), r * np.sin(np.tile(theta, 2)), high], 1)
        k = np.arange(n)
        faces = np.stack([k, n + 1 + k, n + 2 + k, k + 1], axis=1)
        mesh = Mesh(points, faces)
        normals = np.cross(
            points[faces[:, 2]] - points[faces[:, 0]], points[faces[:, 3]] - points[k]
        )
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        fold = np.arccos(np.clip((normals[1:] * normals[:-1]).sum(axis=1), -1, 1))
        bends = np.stack([k[1:], n + 1 + k[1:]], axis=1)
        panel = Panel("cone", mesh, flat, bends, fold, np.full(n - 1, np.inf))
        after = thickened(panel, Thickness(0.04, k=0.5, face=face)).flat
        # The offset surface is the same cone, moved along its axis: the pattern is the same
        # sector, moved outwards by the offset over the tangent of the half angle.
        middle = slice(1, n)
        want = np.array([1.0, 2.0])[:, None] + offset / np.tan(half)
        apex = _centre(after[: n + 1][middle])
        radius = np.stack(
            [np.linalg.norm(after[i : i + n + 1][middle] - apex, axis=1) for i in (0, n + 1)]
        )
        np.testing.assert_allclose(radius, np.broadcast_to(want, radius.shape), rtol=1e-6)

    def test_a_valley_is_changed_the_other_way(self):
        sheet = Thickness(0.1, k=0.4, face="outside")
        up, down = sheet.change(0.3), sheet.change(-0.3)
        assert up == pytest.approx(0.3 * (0.04 - 0.1))
        assert down == pytest.approx(0.3 * 0.04)

    def test_a_folded_bend_takes_the_length_of_the_standard_formula(self):
        thick, inner, k = 2.0, 3.0, 0.42
        sheet = Thickness(thick, k=k, face="outside", radius=inner)
        allowance = np.pi / 2 * (inner + k * thick)
        # Two flanges of 50 outside, up to the apex.
        assert 100 + sheet.change(np.pi / 2) == pytest.approx(100 + allowance - 2 * (inner + thick))

    def test_a_bend_table_is_interpolated(self):
        table = [[0.0, 0.0], [np.pi / 2, 4.0]]
        sheet = Thickness(2.0, face="outside", table=table)
        assert sheet.change(np.pi / 4) == pytest.approx(-2.0)
        with pytest.raises(OptionError, match="increasing"):
            Thickness(2.0, table=[[1.0, 1.0], [0.5, 2.0]])

    def test_plates_keep_their_shape(self):
        panel = bent([0.4, -0.3, 0.2])
        after = thickened(panel, Thickness(0.1, k=0.3)).flat
        wide = np.diff(after[::2, 0])
        change = Thickness(0.1, k=0.3).change([0.4, -0.3, 0.2])
        # A vertex on a bend lies in the middle of what is inserted.
        want = 1.0 + 0.5 * np.r_[change[0], change[:-1] + change[1:], change[-1]]
        np.testing.assert_allclose(wide, want, atol=1e-9)

    @pytest.mark.parametrize("bad", [{"sheet": 0}, {"sheet": 1, "k": 2}, {"sheet": 1, "face": "x"}])
    def test_wrong_values_are_refused(self, bad):
        with pytest.raises(OptionError):
            Thickness(**bad)


class TestCongruent:
    def test_parts_that_are_the_same_are_counted(self):
        outline = np.array([[0.0, 0], [90, 0], [100, 50], [0, 50]])
        bend = Bend(np.array([[20.0, 0], [20, 50]]), 0.3, 5.0)
        one = Part("one", outline, bends=(bend,), count=2)
        turned = replace(one.turned(np.pi), name="turned", count=1)
        other = replace(one, name="valley", bends=(bend._replace(angle=-0.3),))
        shape = replace(one, name="mirrored", outline=(outline * [-1, 1])[::-1], bends=())
        parts, same = united([one, turned, other, shape, replace(shape, name="last")])
        assert same == {"turned": "one", "last": "mirrored"}
        assert [(p.name, p.count) for p in parts] == [("one", 3), ("valley", 2), ("mirrored", 4)]

    def test_seams_with_other_numbers_make_other_parts(self):
        notch = Notch(np.array([50.0, 0]), np.array([0.0, 1]), "1")
        one = replace(SQUARE, notches=(notch,))
        two = replace(SQUARE, name="two", notches=(replace(notch, text="2"),))
        assert not united([one, two])[1]
        # Half a turn brings the notch to the other side.
        assert united([one, replace(one.turned(np.pi), name="two")])[1]


class TestDecimation:
    def test_a_decimated_surface_is_near_and_not_folded(self, monkeypatch):
        from gso import faults, metrics
        from gso.ruled.paneling import LightDesign

        x, y = np.meshgrid(*2 * [np.linspace(-1, 1, 65)], indexing="ij")
        rng = np.random.default_rng(0)
        waves = sum(
            rng.normal() / k * np.sin(k * (x * np.cos(a) + y * np.sin(a)) + b)
            for k, a, b in zip(range(1, 12), rng.uniform(0, 6, 11), rng.uniform(0, 6, 11))
        )
        design = Mesh.from_grid(np.dstack([x, y, 0.1 * waves]))
        monkeypatch.setattr("gso.ruled.paneling.light_design._LIGHT", 500)
        allowed = 0.03 * design.diagonal
        found = LightDesign.of(design, allowed)
        light, away = found.mesh, allowed - found.allowed
        assert len(light.faces) <= 4000 and 0 < away <= 0.35 * allowed
        assert not len(faults.folded(light))
        found = metrics.surface_distance(design, light)
        assert max(found.there_max, found.back_max) == pytest.approx(away)
        same = LightDesign.of(design, 1e-9)
        assert same.mesh is design and same.allowed == 1e-9


class TestOffsets:
    def test_kerf_and_allowance_move_the_outline_outwards(self):
        x, y = np.meshgrid(np.linspace(0, 100, 11), np.linspace(0, 50, 6), indexing="ij")
        flat = gso.as_mesh(np.dstack([x, y, 0 * x]))
        whole = made(Design("square", flat), FabricationSettings())
        hole = np.array([[40.0, 20, 0], [60, 20, 0], [60, 30, 0], [40, 30, 0], [40, 20, 0]])
        plain = {"notches": None, "labels": None}
        (wide,) = parts_of(whole, 1.0, Finish(kerf=2.0, **plain), [], [hole])
        assert wide.size == pytest.approx((102, 52), rel=1e-4)
        assert area_of_hole(wide.holes[0]) == pytest.approx(18 * 8, rel=1e-3)
        (sewn,) = parts_of(whole, 1.0, Finish(allowance=10.0, **plain), [], [hole])
        assert sewn.size == pytest.approx((120, 70), rel=1e-4)
        np.testing.assert_allclose(np.ptp(sewn.seams[0], axis=0), (100, 50), rtol=1e-4)
        np.testing.assert_allclose(sewn.seams[0].min(axis=0) - sewn.low, 10.0, atol=0.01)

    def test_turning_over_mirrors_and_swaps_folds(self):
        whole = made(Design("arch", arch()), FabricationSettings())
        part, back = (parts_of(whole, 100.0, Finish(face=f))[0] for f in ("outside", "inside"))
        assert back.area == pytest.approx(part.area)
        assert [b.angle for b in back.bends] == [-b.angle for b in part.bends]


class TestParts:
    def test_a_cylinder_is_a_rectangle_with_mountain_folds(self):
        part = parts_of(
            made(Design("arch", arch()), FabricationSettings()), 1000.0, Finish(notches=None)
        )[0]
        # The arc is a polygon of 64 chords; the strip is fitted within a tenth of a per mille.
        assert part.size == pytest.approx((2000.0, 500 * np.pi), rel=3e-4)
        assert part.area == pytest.approx(part.size[0] * part.size[1], rel=1e-3)
        assert len(part.bends) > 8
        # Rulings that run into corners may bend a little the other way.
        assert all(bend.angle > 0 for bend in part.bends if abs(bend.angle) > np.radians(2))
        assert sum(bend.angle for bend in part.bends) == pytest.approx(np.pi / 2, rel=0.1)
        # Long side along x, lower left corner at the origin.
        np.testing.assert_allclose(part.low, 0, atol=1e-9)

    def test_the_inside_of_a_cylinder_has_valley_folds(self):
        mesh = arch()
        inside = Mesh(mesh.vertices, mesh.faces[:, ::-1])
        part = parts_of(made(Design("arch", inside), FabricationSettings()), 1000.0, Finish())[0]
        assert all(bend.angle < 0 for bend in part.bends if abs(bend.angle) > np.radians(2))

    def test_notches_of_strips_are_at_the_same_places_of_both_sides(self):
        whole = domed(0.6, "3%")
        assert len(whole.panels) > 1
        parts = parts_of(whole, 100.0, Finish(notches=20.0))
        strips = [s for s in whole.matings if s.mismatch(whole.panels) < 1e-9]
        assert strips
        for seam in strips:
            both = []
            for side in (seam.one, seam.two):
                own = [n for n in parts[side.panel].notches if n.text == str(seam.number)]
                both.append(np.array([n.at for n in own]))
            one, two = both
            step = [np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (one, two[::-1])]
            assert len(one) % 2 == 1
            # Straight distances are equal as the pieces of outline between are congruent only
            # where the seam is straight; arc lengths are equal anyway.
            assert seam.mismatch(whole.panels) < 1e-6 * dome(17, height=0.6).diagonal
            assert len(step[0]) == len(step[1])

    @pytest.mark.slow
    def test_notches_of_pieces_are_at_equal_arc_lengths(self):
        design = dome(9, height=1.0)
        whole = made(
            Design("dome", design), FabricationSettings(max_deviation=0.02 * design.diagonal)
        )
        assert any(whole.record["strips"]) and not all(seam.common for seam in whole.matings)
        parts = parts_of(whole, 1000.0, Finish(notches=100.0, labels=None))
        for seam in whole.matings:
            one, two = (arcs(parts[side.panel], seam) for side in (seam.one, seam.two))
            np.testing.assert_allclose(one, two[::-1], atol=1e-6 * 1000.0 * design.diagonal)

    @pytest.mark.slow
    def test_seams_of_strained_patterns_differ_by_no_more_than_the_strain(self):
        design = dome(17, height=0.6)
        whole = made(
            Design("dome", design), FabricationSettings(formulation="flatten", max_strain=0.02)
        )
        assert len(whole.panels) > 1 and not whole.reasons
        for seam in whole.matings:
            most = 2.0 * whole.record["strain_max"] * seam.length
            assert seam.mismatch(whole.panels) <= most

    def test_seams_end_where_cuts_meet_the_outline_of_the_design(self):
        ball = trimesh.creation.icosphere(subdivisions=1)
        above = ball.faces[ball.vertices[ball.faces][:, :, 2].mean(axis=1) > -0.1]
        whole = made(Design("dome", gso.as_mesh((ball.vertices, above))), FabricationSettings())
        assert len(whole.panels) == 1 and len(whole.matings) > 5
        assert max(seam.mismatch(whole.panels) for seam in whole.matings) < 1e-9

    @pytest.mark.slow
    def test_seams_between_pieces_end_where_one_of_them_is_cut_open(self):
        # A wall, cut open anywhere, and a roof of strips that are cut open elsewhere.
        t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
        rings = [(3.0, 0.0), (3.0, 1.5), (1.8, 2.3), (0.5, 3.1)]
        points = [np.stack([r * np.cos(t), r * np.sin(t), 0 * t + z], axis=1) for r, z in rings]
        k = np.arange(3)[:, None] * 48 + np.arange(48)
        after = np.roll(k, -1, axis=1)
        faces = np.stack([k, after, after + 48, k + 48], axis=-1).reshape(-1, 4)
        yurt = gso.as_mesh((np.concatenate(points), faces))
        whole = made(Design("yurt", yurt), FabricationSettings())
        between = [seam for seam in whole.matings if not seam.common]
        for seam in between:
            assert seam.mismatch(whole.panels) < 2e-3 * seam.length
        around = 48 * 2 * 3.0 * np.sin(np.pi / 48)
        assert sum(seam.length for seam in between) == pytest.approx(around, rel=5e-3)
        assert not fit_notes(fitted(whole, 1000.0, Finish()))
        wall = between[0].two.panel
        panels = [
            replace(panel, flat=1.02 * panel.flat) if k == wall else panel
            for k, panel in enumerate(whole.panels)
        ]
        wide = fitted(replace(whole, panels=tuple(panels)), 1000.0, Finish())
        (note,) = fit_notes(wide)
        assert all(str(seam.number) in note for seam in between) and "(2." in note

    def test_notches_point_into_the_part(self):
        whole = domed(0.6, "3%")
        for part in parts_of(whole, 100.0, Finish(notches=30.0, labels=None)):
            shape = shapely.Polygon(part.outline)
            assert part.notches
            for notch in part.notches:
                assert shape.exterior.distance(shapely.Point(notch.at)) < 1e-6
                assert shape.contains(shapely.Point(notch.at + 0.05 * notch.inward))

    def test_tabs_lie_outside_and_do_not_overlap(self):
        whole = domed(0.6, "3%")
        plain = parts_of(whole, 100.0, Finish(notches=None, labels=None))
        tabbed = parts_of(whole, 100.0, Finish(notches=None, labels=None, tabs=5.0))
        assert sum(len(part.creases) for part in tabbed) > 0
        for before, after in zip(plain, tabbed, strict=True):
            assert after.area >= before.area - 1e-6
            assert shapely.Polygon(after.outline).is_valid

    def test_registration_holes_are_inside(self):
        whole = domed(0.6, "3%")
        parts = parts_of(whole, 100.0, Finish(notches=30.0, registration=(1.0, 2.0)))
        assert any(part.holes for part in parts)
        for part in parts:
            shape = shapely.Polygon(part.outline)
            assert all(shape.contains(shapely.Polygon(hole)) for hole in part.holes)

    def test_areas_agree_with_the_surface(self):
        design = dome(17, height=0.4)
        whole = made(
            Design("dome", design), FabricationSettings(formulation="flatten", max_strain=0.01)
        )
        strain = whole.record["strain_max"]
        for panel, part in zip(
            whole.panels, parts_of(whole, 1.0, Finish(labels=None)), strict=True
        ):
            own = gso.metrics.area(panel.surface)
            assert abs(part.area - own) <= (2 * strain + strain**2) * own


class TestMaking:
    def test_a_strongly_curved_design_is_cut_into_pieces(self):
        # Triangles with two holes, over which there are no grids whose lines strips could follow,
        # and so curved that holes are not filled.
        grid = dome(11, height=1.5)
        kept = np.ones(len(grid.faces), bool)
        kept[[22, 77]] = False
        holed = Mesh(grid.vertices, grid.faces[kept])
        triangles = Mesh(holed.vertices, holed.triangles)
        whole = made(Design("dome", triangles), FabricationSettings())
        assert not whole.reasons
        assert whole.record["pieces"] > 1
        assert whole.record["deviation_max"] <= 1.000001 * whole.record["allowed"]
        assert whole.record["strain_max"] <= 1e-3
        for seam in whole.matings:
            assert seam.mismatch(whole.panels) <= 2.0 * whole.record["allowed"]

    def test_moved_copies_are_found_and_mirrored_ones_are_not(self):
        mesh = dome(9)
        u = mesh.vertices * [1.0, 1.5, 1.0] + 0.1 * mesh.vertices[:, :1] * [0, 1, 0]
        turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
        meshes = [Mesh(p, mesh.faces) for p in (u, u @ turn + 3.0, u * [-1, 1, 1])]
        assert origins(meshes) == [0, 0, 2]


class TestMarks:
    def test_marks_in_a_triangle_keep_their_part_and_length(self):
        whole = domed(0.6)
        rng = np.random.default_rng(0)
        lines = []
        for panel in whole.panels:
            triangles = panel.surface.triangles
            corners = panel.surface.vertices[triangles[rng.integers(len(triangles), size=20)]]
            lines.append(rng.dirichlet([2, 2, 2], size=(20, 2)) @ corners)
        parts = parts_of(whole, 1.0, Finish(notches=None, labels=None), np.concatenate(lines))
        for part, own in zip(parts, lines, strict=True):
            length, there = (
                [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in some]
                for some in (part.marks, own)
            )
            np.testing.assert_allclose(np.sort(length), np.sort(there), rtol=1e-6)

    def test_marks_and_holes_are_drawn_on_the_part_they_are_on(self):
        t = np.linspace(0.4, 1.0, 20)
        line = np.stack([np.sin(t), 0 * t + 0.5, np.cos(t)], axis=1)
        turn = np.linspace(0, 2 * np.pi, 30)
        angle, y = 0.8 + 0.1 * np.cos(turn), 1.2 + 0.1 * np.sin(turn)
        ring = np.stack([np.sin(angle), y, np.cos(angle)], axis=1)
        whole = made(Design("arch", arch()), FabricationSettings())
        (part,) = parts_of(whole, 100.0, Finish(), [line], [ring])
        assert len(part.marks) == 1
        size = np.linalg.norm(np.diff(part.marks[0], axis=0), axis=1).sum()
        assert size == pytest.approx(60.0, rel=2e-3)
        assert area_of_hole(part.holes[0]) == pytest.approx(np.pi * 100.0, rel=2e-2)
        with pytest.raises(OptionError, match=r"not inside their part: hole at .* \(arch\)"):
            parts_of(whole, 100.0, Finish(), [], [ring - [0, 1.2, 0]])
