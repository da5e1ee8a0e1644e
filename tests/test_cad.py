"""CAD files: read as triangles; solids of sheet metal become blanks of their thickness."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.special import ellipe

import gso
from gso import Mesh, io, recognition
from gso.cli import main
from gso.mesh import Labels
from gso.workshop import Finish, Thickness

pytest.importorskip("OCP", exc_type=ImportError)

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepGProp import BRepGProp
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeHalfSpace,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Pln, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Reader, STEPControl_StepModelType, STEPControl_Writer

#: Flanges, width, inner radius and thickness of the bracket.
FLANGES, WIDTH, INNER, THICK = (40.0, 30.0), 25.0, 3.0, 2.0
BARE = {"notches": None, "labels": None}


def saved(shape, path, unit="MM"):
    """Write a shape to a STEP file."""
    # The first writer of a process defines the setting.
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path


def box(*corners):
    low, high = corners
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def rod(x, y, radius):
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, -1), gp_Dir(0, 0, 1)), radius, 10.0).Shape()


def cut(shape, *tools):
    for tool in tools:
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return shape


def fused(shape, *others):
    for other in others:
        shape = BRepAlgoAPI_Fuse(shape, other).Shape()
    return shape


def bracket(angle=np.pi / 2):
    """Two flanges and a bend, from its section in the plane y = 0."""
    one, two = FLANGES
    centre = np.array([one, INNER + THICK])
    turns = (0.0, angle / 2, angle)
    outer, inner = (
        [centre + r * np.array([np.sin(t), -np.cos(t)]) for t in turns]
        for r in (INNER + THICK, INNER)
    )
    end = two * np.array([np.cos(angle), np.sin(angle)])
    wire = BRepBuilderAPI_MakeWire()

    def point(p):
        return gp_Pnt(float(p[0]), 0.0, float(p[1]))

    def add(*points):
        if len(points) == 3:
            curve = GC_MakeArcOfCircle(*map(point, points)).Value()
            wire.Add(BRepBuilderAPI_MakeEdge(curve).Edge())
        else:
            wire.Add(BRepBuilderAPI_MakeEdge(*map(point, points)).Edge())

    add((0, 0), outer[0])
    add(*outer)
    add(outer[2], outer[2] + end)
    add(outer[2] + end, inner[2] + end)
    add(inner[2] + end, inner[2])
    add(*inner[::-1])
    add(inner[0], (0, THICK))
    add((0, THICK), (0, 0))
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, WIDTH, 0)).Shape()


def plate():
    """A plate of 120 x 80 x 3 with a round hole and a slot."""
    slot = fused(rod(70, 30, 5.0), rod(100, 30, 5.0), box((70, 25, -1), (100, 35, 9)))
    return cut(box((0, 0, 0), (120, 80, 3)), rod(30, 40, 8.0), slot)


def area(mesh):
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def made(path, *, step=False, **finish):
    return gso.fabricate(
        path,
        path.with_suffix(""),
        finish=Finish(**BARE, **finish),
        workers=0,
        formats=("svg",),
        step=step,
    )


def mass(path):
    """Return the volume of the solids in a STEP file, by OpenCASCADE."""
    reader, found = STEPControl_Reader(), GProp_GProps()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    BRepGProp.VolumeProperties_s(reader.OneShape(), found)
    return found.Mass()


def volume(mesh):
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return np.einsum("td,td->", a, np.cross(b, c)) / 6


class TestReading:
    def test_a_box_is_closed_and_has_its_corners(self, tmp_path):
        mesh = gso.load(saved(box((0, 0, 0), (100, 60, 40)), tmp_path / "a.step"))
        assert len(mesh.vertices) == 8 and not mesh.boundary_loops
        assert area(mesh) == pytest.approx(2 * (6000 + 4000 + 2400), rel=1e-12)

    def test_lengths_are_in_millimetres(self, tmp_path):
        path = saved(box((0, 0, 0), (10, 6, 4)), tmp_path / "a.step", "INCH")
        assert "'INCH'" in path.read_text()
        np.testing.assert_allclose(np.ptp(gso.load(path).vertices, axis=0), [10, 6, 4], rtol=1e-9)

    @pytest.mark.parametrize("suffix", [".step", ".iges", ".3dm"])
    def test_faces_come_back_in_every_unit(self, tmp_path, suffix):
        if suffix == ".3dm":
            pytest.importorskip("rhino3dm")
        corners = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]
        for unit, size in (("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)):
            io.save_faces(gso.Mesh(corners, [[0, 1, 2, 3]]), tmp_path / f"a{suffix}", unit=unit)
            mesh = gso.load(tmp_path / f"a{suffix}")
            assert area(mesh) == pytest.approx((10 * size) ** 2, rel=1e-9)

    @pytest.mark.parametrize("chord", [0.5, 0.005])
    def test_triangles_are_within_the_chord_and_have_no_cracks(self, tmp_path, chord):
        path = saved(BRepPrimAPI_MakeSphere(50.0).Shape(), tmp_path / "a.step")
        mesh = gso.load(path, chord=chord)
        assert not mesh.boundary_loops
        middles = mesh.vertices[mesh.triangles].mean(axis=1)
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 50.0, rtol=1e-9)
        assert (50.0 - np.linalg.norm(middles, axis=1)).max() <= 2 * chord

    def test_a_hole_is_kept(self, tmp_path):
        mesh = gso.load(saved(plate(), tmp_path / "a.step"))
        # Two holes: the Euler characteristic of a solid with two handles is -2.
        assert len(mesh.vertices) - len(mesh.edges) + len(mesh.triangles) == -2

    def test_a_cylinder_and_a_cone_have_their_radius_and_angle(self, tmp_path):
        cylinder = BRepPrimAPI_MakeCylinder(20.0, 60.0).Shape()
        cone = BRepPrimAPI_MakeCone(40.0, 20.0, 60.0).Shape()
        for name, shape, kind, value in (
            ("cylinder", cylinder, "cylinder", 20.0),
            ("cone", cone, "cone", np.arctan(20 / 60)),
        ):
            found = recognition.recognise(gso.load(saved(shape, tmp_path / f"{name}.step")))
            (face,) = (f for f in found.faces if f.kind == kind)
            got = face.radius if kind == "cylinder" else face.half_angle
            assert got == pytest.approx(value, rel=1e-6)

    def test_a_damaged_file_is_named(self, tmp_path, capfd):
        for suffix in (".step", ".iges"):
            path = tmp_path / f"a{suffix}"
            path.write_text("nothing of the kind")
            with pytest.raises(gso.MeshError, match=f"a{suffix}"):
                gso.load(path)
        assert capfd.readouterr() == ("", "")

    def test_a_chord_needs_a_cad_file(self, tmp_path):
        with pytest.raises(gso.OptionError, match="no CAD file"):
            gso.load(tmp_path / "a.obj", chord=0.1)


def half_ellipse(height, *ends):
    """An extrusion of half an ellipse with the axes 50 and 20, between plates that touch it."""
    wire = BRepBuilderAPI_MakeWire()
    axes = gp_Elips(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 50.0, 20.0)
    wire.Add(BRepBuilderAPI_MakeEdge(axes, 0.0, np.pi).Edge())
    for x in ends:
        wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(x, 0, 0), gp_Pnt(x, -40, 0)).Edge())
    return BRepPrimAPI_MakePrism(wire.Wire(), gp_Vec(0, 0, height)).Shape()


def elliptic_cone(base, top, height):
    """A loft between ellipses of 50 x 20, at two scales: its apex is on the axis."""
    loft = BRepOffsetAPI_ThruSections(False, True)
    for z, scale in ((0.0, base), (height, top)):
        place = gp_Ax2(gp_Pnt(0, 0, z), gp_Dir(0, 0, 1))
        edge = BRepBuilderAPI_MakeEdge(gp_Elips(place, 50.0 * scale, 20.0 * scale)).Edge()
        loft.AddWire(BRepBuilderAPI_MakeWire(edge).Wire())
    return loft.Shape()


class TestEquations:
    """Faces are unrolled from the surfaces of the file, not from triangles."""

    @pytest.mark.parametrize("chord", [2.0, 0.01])
    def test_an_extrusion_is_as_long_as_its_section(self, tmp_path, chord):
        path = saved(half_ellipse(30.0), tmp_path / "a.step")
        (face,) = recognition.recognise(gso.load(path, chord=chord)).faces
        section = 100.0 * ellipe(1 - 0.16)
        size = np.sort(np.ptp(face.flat.reshape(-1, 2), axis=0))
        np.testing.assert_allclose(size, [30.0, section], rtol=1e-9)
        assert face.kind == "torsal" and face.bend_angle == pytest.approx(np.pi, abs=1e-9)
        # b^2 / a and a^2 / b at the vertices of the ellipse.
        radii = [line.radius_start for line in face.bend_lines]
        assert radii[0] == pytest.approx(8.0) and max(radii) == pytest.approx(125.0, rel=0.01)

    @pytest.mark.parametrize("kind", ["surface", "face"])
    def test_faces_of_a_3dm_file_are_unrolled_from_their_equations(self, tmp_path, kind):
        rhino3dm = pytest.importorskip("rhino3dm")
        surface = rhino3dm.NurbsSurface.Create(3, True, 3, 2, 5, 2)
        arc = zip([1, 1, 0, -1, -1], [0, 1, 1, 1, 0], [1, 0.5**0.5] * 3, strict=False)
        for i, (x, y, w) in enumerate(arc):
            for j in range(2):
                surface.Points[i, j] = rhino3dm.Point4d(5 * w * x, 2 * w * y, 3 * w * j, w)
        for row, knots in ((surface.KnotsU, [0, 0, 1, 1, 2, 2]), (surface.KnotsV, [0, 1])):
            for k, knot in enumerate(knots):
                row[k] = knot
        model = rhino3dm.File3dm()
        model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Centimeters
        if kind == "surface":
            model.Objects.AddSurface(surface)
        else:
            model.Objects.AddBrep(rhino3dm.Brep.CreateFromSurface(surface))
        assert model.Write(str(tmp_path / "a.3dm"), 7)
        (face,) = recognition.recognise(gso.load(tmp_path / "a.3dm", chord=1.0)).faces
        size = np.sort(np.ptp(face.flat.reshape(-1, 2), axis=0))
        np.testing.assert_allclose(size, [30.0, 100.0 * ellipe(1 - 0.16)], rtol=1e-7)
        assert face.kind == "torsal" and face.bend_angle == pytest.approx(np.pi, abs=1e-9)

    def test_tangent_neighbours_are_one_part_without_a_fold(self, tmp_path):
        (part,) = made(saved(half_ellipse(30.0, -50.0, 50.0), tmp_path / "a.step")).parts
        np.testing.assert_allclose(part.size, [80 + 100.0 * ellipe(1 - 0.16), 30.0], rtol=1e-9)
        assert sum(abs(bend.angle) for bend in part.bends) == pytest.approx(np.pi, abs=1e-9)

    def test_a_loft_has_the_area_of_its_cone(self, tmp_path):
        path = saved(elliptic_cone(1.0, 0.5, 40.0), tmp_path / "a.step")
        (face,) = recognition.recognise(gso.load(path, chord=0.02)).faces
        flat = face.flat - face.flat[:, :1]
        area = 0.5 * np.abs(np.linalg.det(flat[:, 1:])).sum()
        t = 2 * np.pi * (np.arange(4000) + 0.5) / 4000
        p = np.stack([50 * np.cos(t), 20 * np.sin(t), np.full_like(t, -80.0)], axis=1)
        d = np.stack([-50 * np.sin(t), 20 * np.cos(t), np.zeros_like(t)], axis=1)
        whole = 0.75 * np.linalg.norm(np.cross(p, d), axis=1).mean() * np.pi
        # The outlines are within the chord tolerance.
        assert whole * (1 - 5e-4) < area < whole
        assert len(face.seam) == 1

    def test_an_elbow_of_cylinders_is_cut_at_its_mitre(self, tmp_path):
        radius, reach = 20.0, 60.0
        rod = BRepPrimAPI_MakeCylinder(radius, reach + 2 * radius).Shape()
        mitre = gp_Ax2(gp_Pnt(0, 0, reach), gp_Dir(1, 0, 1))
        plane = BRepBuilderAPI_MakeFace(gp_Pln(mitre.Location(), mitre.Direction())).Face()
        half = cut(rod, BRepPrimAPI_MakeHalfSpace(plane, gp_Pnt(100, 0, 160)).Solid())
        mirror = gp_Trsf()
        mirror.SetMirror(mitre)
        elbow = fused(half, BRepBuilderAPI_Transform(half, mirror, True).Shape())
        done = made(saved(elbow, tmp_path / "a.step"))
        pipes = [part for part in done.parts if part.bends]
        assert sum(part.count for part in done.parts) == 4 and sum(p.count for p in pipes) == 2
        for part in pipes:
            np.testing.assert_allclose(part.size, [2 * np.pi * radius, reach + radius], rtol=1e-5)
            assert part.area == pytest.approx(2 * np.pi * radius * reach, rel=1e-6)
            turned = sum(abs(bend.angle) for bend in part.bends)
            assert turned == pytest.approx(2 * np.pi, rel=1e-9)

    def test_a_sphere_on_a_solid_is_named_and_meshed(self, tmp_path):
        ball = BRepPrimAPI_MakeSphere(gp_Pnt(50, 30, 40), 15.0).Shape()
        shape = fused(box((0, 0, 0), (100, 60, 40)), ball)
        mesh = gso.load(saved(shape, tmp_path / "a.step"), chord=0.5)
        (note,) = mesh.notes
        assert "within 0.5 mm" in note and re.search(r"not developable: face \d \(sphere\)", note)
        kinds = [face.kind for face in recognition.recognise(mesh).faces]
        assert sorted(kinds) == ["free", *["plane"] * 6]

    def test_moved_vertices_are_fitted_again(self, tmp_path):
        mesh = gso.load(saved(BRepPrimAPI_MakeCylinder(20.0, 60.0).Shape(), tmp_path / "a.step"))
        found = recognition.recognise(mesh.replaced(2.0 * mesh.vertices))
        (face,) = (face for face in found.faces if face.kind == "cylinder")
        assert face.radius == pytest.approx(40.0, rel=1e-6)


class TestSheetMetal:
    @pytest.mark.parametrize("k", [0.33, 0.44, 0.5])
    @pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 2])
    def test_the_flat_length_is_that_of_the_formula(self, tmp_path, k, angle):
        done = made(saved(bracket(angle), tmp_path / "a.step"), k_factor=k)
        assert done.usable
        (part,) = done.parts
        flat = sum(FLANGES) + angle * (INNER + k * THICK)
        np.testing.assert_allclose(part.size, [flat, WIDTH], atol=1e-6)
        (bend,) = part.bends
        assert abs(bend.angle) == pytest.approx(angle, abs=1e-9)
        assert bend.radius == pytest.approx(INNER, abs=1e-6)
        assert done.certificate["designs"][0]["thickness"] == pytest.approx(THICK)
        faces = done.certificate["designs"][0]["parts"][0]["faces"]
        kinds = [re.fullmatch(r"face \d+ \((\w+)\)", name)[1] for name in faces]
        assert sorted(kinds) == ["cylinder", "plane", "plane"]
        page = (tmp_path / "a" / "index.html").read_text()
        assert f"made of {', '.join(faces)}" in page

    def test_a_bend_table_gives_the_deduction(self, tmp_path):
        done = made(saved(bracket(), tmp_path / "a.step"), bend_table=[[np.pi / 2, 4.1]])
        flat = sum(FLANGES) + 2 * (INNER + THICK) - 4.1
        np.testing.assert_allclose(done.parts[0].size, [flat, WIDTH], atol=1e-6)

    def test_a_plate_keeps_its_holes(self, tmp_path):
        (part,) = made(saved(plate(), tmp_path / "a.step")).parts
        np.testing.assert_allclose(part.size, [120, 80], atol=1e-9)
        assert len(part.holes) == 2 and not part.bends
        whole = 120 * 80 - np.pi * 64 - (300 + np.pi * 25)
        assert part.area == pytest.approx(whole, rel=1e-3)

    def test_a_tube_is_as_long_as_its_neutral_circle(self, tmp_path):
        tube = cut(
            BRepPrimAPI_MakeCylinder(20.0, 100.0).Shape(),
            BRepPrimAPI_MakeCylinder(18.0, 100.0).Shape(),
        )
        (part,) = made(saved(tube, tmp_path / "a.step"), k_factor=0.5).parts
        np.testing.assert_allclose(part.size, [2 * np.pi * 19, 100], atol=1e-3)

    def test_parts_name_the_faces_that_they_are_made_of(self, tmp_path):
        mesh = gso.load(saved(box((0, 0, 0), (100, 60, 40)), tmp_path / "a.step"))
        said = mesh.attributes
        first = np.unique(said.surfaces.of_face, return_index=True)[1]
        names = ("lid", "", "", "front", "", "")
        labels = {"g": Labels(names, said.surfaces.of_face)}
        named = Mesh(mesh.vertices, mesh.faces, attributes=replace(said, labels=labels))
        edge = mesh.edges[np.ptp(mesh.vertices[mesh.edges], axis=1).astype(bool).sum(axis=1) == 1]
        done = gso.fabricate(named, tmp_path / "b", cut=edge, workers=0, formats=("dxf",))
        assert len(done.parts) == len(first) == 6
        found = sorted(part.faces for part in done.parts)
        assert found == sorted((name or f"face {k} (plane)",) for k, name in enumerate(names))
        for part in done.parts:
            drawn = ezdxf.readfile(tmp_path / "b" / "parts" / f"{part.name}.dxf").modelspace()
            assert part.faces[0] in [text.dxf.text for text in drawn.query("TEXT")]

    def test_a_box_that_is_no_sheet_becomes_a_net(self, tmp_path):
        done = made(saved(box((0, 0, 0), (100, 60, 40)), tmp_path / "a.step"))
        (part,) = done.parts
        assert len(part.bends) == 5
        assert part.area == pytest.approx(24800, rel=1e-9)

    @pytest.mark.parametrize("shape", [bracket, lambda: box((0, 0, 0), (100, 60, 40))])
    def test_unfold_says_that_a_sheet_has_two_sides(self, shape, tmp_path):
        file, out = saved(shape(), tmp_path / "a.step"), tmp_path / "a.svg"
        done = CliRunner().invoke(main, ["unfold", str(file), "-o", str(out), "--json"])
        notes = " ".join(json.loads(done.stdout)["notes"])
        assert ("gso fabricate" in notes) == (shape is bracket)

    @pytest.mark.parametrize(
        ("high", "join"), [((50.0, 50.0, 9.0), cut), ((50.0, 23.0, 12.0), fused)]
    )
    def test_pockets_and_ribs_are_refused_with_their_place(self, tmp_path, high, join):
        shape = join(box((0, 0, 0), (120, 80, 3)), box((20, 20, 2), high))
        with pytest.raises(gso.MeshError, match="not 3 thick") as error:
            made(saved(shape, tmp_path / "a.step"))
        place = re.search(r"near \((.*)\)", str(error.value)).group(1).split(", ")
        assert all(a <= float(x) <= b for a, x, b in zip((20, 20, 2), place, high, strict=True))

    def test_a_sphere_is_named(self, tmp_path):
        sheet = box((0, 0, 0), (120, 80, 3))
        ball = BRepPrimAPI_MakeSphere(gp_Pnt(60, 40, -10), 25.0).Shape()
        inner = BRepPrimAPI_MakeSphere(gp_Pnt(60, 40, -10), 22.0).Shape()
        shape = cut(fused(sheet, ball), inner, box((-50, -50, -60), (200, 200, 0)))
        with pytest.raises(gso.MeshError, match=r"near \(60.*\(sphere\).*curved in two directions"):
            made(saved(shape, tmp_path / "a.step"))

    def test_another_thickness_or_unit_is_refused(self, tmp_path):
        path = saved(bracket(), tmp_path / "a.step")
        with pytest.raises(gso.OptionError, match="2 mm thick, not 3 mm"):
            made(path, thickness=Thickness(3.0))
        with pytest.raises(gso.OptionError, match="unit of their own"):
            gso.fabricate(path, tmp_path / "out", unit="m", workers=0)

    def test_a_loft_between_two_circles_is_a_cone(self, tmp_path):
        loft = BRepOffsetAPI_ThruSections(False, True)
        for height, radius in ((0.0, 40.0), (60.0, 20.0)):
            circle = gp_Circ(gp_Ax2(gp_Pnt(0, 0, height), gp_Dir(0, 0, 1)), radius)
            loft.AddWire(BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle).Edge()).Wire())
        (part,) = made(saved(loft.Shape(), tmp_path / "a.step")).parts
        side = np.hypot(60, 20)
        assert part.area == pytest.approx(np.pi * (40 + 20) * side, rel=2e-3)

    @pytest.mark.parametrize("mode", [0, 1])
    def test_an_iges_file_has_the_same_solid(self, tmp_path, mode):
        # Faces, or a shell.
        writer = IGESControl_Writer("MM", mode)
        writer.AddShape(bracket())
        writer.Write(str(tmp_path / "a.igs"))
        (part,) = made(tmp_path / "a.igs", k_factor=0.44).parts
        flat = sum(FLANGES) + np.pi / 2 * (INNER + 0.44 * THICK)
        np.testing.assert_allclose(part.size, [flat, WIDTH], atol=1e-5)

    def test_a_mesh_in_a_3dm_file_has_its_name_and_unit(self, tmp_path):
        rhino3dm = pytest.importorskip("rhino3dm")
        mesh = gso.load(saved(bracket(), tmp_path / "a.step"))
        given = rhino3dm.Mesh()
        for point in (0.1 * mesh.vertices).tolist():
            given.Vertices.Add(*point)
        for face in mesh.triangles.tolist():
            given.Faces.AddFace(*face)
        model, said = rhino3dm.File3dm(), rhino3dm.ObjectAttributes()
        model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Centimeters
        said.Name = "bracket"
        model.Objects.AddMesh(given, said)
        assert model.Write(str(tmp_path / "a.3dm"), 7)
        again = gso.load(tmp_path / "a.3dm")
        assert again.attributes.labels["o"].names == ("bracket",) and not again.boundary_loops
        assert volume(again) == pytest.approx(volume(mesh), rel=1e-5)

    def test_a_trimmed_face_without_triangles_is_named(self, tmp_path):
        rhino3dm = pytest.importorskip("rhino3dm")
        model = rhino3dm.File3dm()
        rod = rhino3dm.Cylinder(rhino3dm.Circle(10.0), 30.0)
        model.Objects.AddBrep(rhino3dm.Brep.CreateFromCylinder(rod, True, True))
        assert model.Write(str(tmp_path / "a.3dm"), 7)
        with pytest.raises(gso.MeshError, match="face 0 of object 0 is trimmed"):
            gso.load(tmp_path / "a.3dm")


class TestFoldedSolids:
    def test_the_folded_part_is_the_solid_that_it_was_made_of(self, tmp_path):
        done = made(saved(bracket(), tmp_path / "part.step"), step=True, k_factor=0.4)
        assert "folded.step" in done.files
        again = gso.load(done.folder / "folded.step")
        assert again.attributes.labels["o"].names == ("part",) and not again.boundary_loops
        section = THICK * sum(FLANGES) + np.pi / 4 * ((INNER + THICK) ** 2 - INNER**2)
        # Triangles of the round faces are inside of the outer circle.
        assert volume(again) == pytest.approx(WIDTH * section, rel=1e-3)
        assert mass(done.folder / "folded.step") == pytest.approx(WIDTH * section, rel=1e-9)
        kinds = [face.kind for face in again.attributes.surfaces.surfaces]
        assert sorted(kinds) == ["cylinder"] * 2 + ["plane"] * 8
        # A later run without it leaves none.
        assert "folded.step" not in made(tmp_path / "part.step", k_factor=0.4).files
        assert not (done.folder / "folded.step").exists()
        np.testing.assert_allclose(
            np.ptp(again.vertices, axis=0),
            [FLANGES[0] + INNER + THICK, WIDTH, FLANGES[1] + INNER + THICK],
            atol=1e-9,
        )

    def test_a_box_of_sheets_has_the_thickness_asked_for(self, tmp_path):
        path = saved(box((0, 0, 0), (100, 60, 40)), tmp_path / "a.step")
        done = made(path, step=True, thickness=Thickness(1.0, face="inside"))
        found = mass(done.folder / "folded.step")
        # Walls outside of the box, mitres of 1 x 1 along the five folds, and something of them
        # along the seams, whose ends are mitred.
        walls = 2 * (100 * 60 + 100 * 40 + 60 * 40)
        folds, edges = 2 * 100 + 2 * 60 + 40, 4 * (100 + 60 + 40)
        assert walls + folds < found < walls + edges
        # Walls that meet at seams touch each other: they stay apart when the file is read.
        again = gso.load(done.folder / "folded.step")
        assert volume(again) == pytest.approx(found, rel=1e-9)

    @pytest.mark.parametrize("slope", [0.0, 0.3])
    def test_tubes_and_cones_are_round(self, tmp_path, slope):
        t, z = np.meshgrid(np.linspace(0, 2 * np.pi, 37), [0.0, 30.0, 60.0])
        r = 20 + slope * z
        grid = np.stack([r * np.cos(t), r * np.sin(t), z], axis=-1)
        done = gso.fabricate(
            grid,
            tmp_path / "out",
            finish=Finish(**BARE, thickness=Thickness(2.0)),
            workers=0,
            formats=("svg",),
            step=True,
        )
        # By Pappus: a strip of 2 on both sides of the ruling, whose middle is at its mean radius.
        side = 60.0 * np.hypot(1.0, slope)
        volume = 2 * np.pi * (20 + 30 * slope) * 2.0 * side
        assert mass(done.folder / "folded.step") == pytest.approx(volume, rel=1e-9)

    @pytest.mark.parametrize("mitre", [0.0, 0.4])
    def test_facets_of_round_faces_are_named(self, tmp_path, mitre):
        t, z = np.meshgrid(np.linspace(0, np.pi, 19), [0.0, 30.0, 60.0])
        x = 20 * np.cos(t)
        grid = np.stack([x, 20 * np.sin(t), z * (1 + mitre * x / 60)], axis=-1)
        finish = Finish(**BARE, thickness=Thickness(1.0))
        done = gso.fabricate(grid, tmp_path, finish=finish, workers=0, formats=("svg",), step=True)
        said = [note for note in done.certificate["notes"] if "facets" in note]
        assert len(said) == (mitre > 0) and all("part design has" in note for note in said)
        # The round face is as large as the solid says, or the facets are within 1 % of it.
        assert mass(tmp_path / "folded.step") == pytest.approx(20 * np.pi * 60, rel=1e-2)

    def test_a_design_without_thickness_is_refused(self, tmp_path):
        path = saved(box((0, 0, 0), (100, 60, 40)), tmp_path / "a.step")
        with pytest.raises(gso.OptionError, match="give the thickness"):
            made(path, step=True)

    def test_several_solids_of_a_file_keep_their_names(self, tmp_path):
        one = gso.load(saved(bracket(), tmp_path / "a.step"))
        two = one.replaced(one.vertices + np.array([0.0, 100.0, 0.0]))
        other = gso.load(saved(plate(), tmp_path / "b.step"))
        other = other.replaced(other.vertices - np.array([0.0, 0.0, 50.0]))
        solids = [("left", one), ("right", two), ("cover", other)]
        io.save_solids(solids, tmp_path / "all.step")
        done = made(tmp_path / "all.step", k_factor=0.44)
        assert done.usable
        sheets = {x["name"]: x["thickness"] for x in done.certificate["designs"]}
        assert {name: round(t, 6) for name, t in sheets.items()} == {
            "left": 2.0,
            "right": 2.0,
            "cover": 3.0,
        }
        flat = sum(FLANGES) + np.pi / 2 * (INNER + 0.44 * THICK)
        long = {part.name: part.size[0] for part in done.parts}
        assert long["cover"] == pytest.approx(120)
        assert max(v for k, v in long.items() if k != "cover") == pytest.approx(flat, abs=1e-3)

    def test_plates_of_different_thickness_are_different_parts(self, tmp_path):
        solids = []
        for name, z, thick in (("thin", 0.0, 2.0), ("thick", 50.0, 3.0)):
            shape = box((0, 0, z), (120, 80, z + thick))
            solids.append((name, gso.load(saved(shape, tmp_path / f"{name}.step"))))
        io.save_solids(solids, tmp_path / "all.step")
        done = made(tmp_path / "all.step")
        assert sorted((part.name, part.count) for part in done.parts) == [("thick", 1), ("thin", 1)]
