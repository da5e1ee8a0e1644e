"""Overlaps and flanges along seams: lengths by formula, lines on them, what is refused."""

from __future__ import annotations

import ezdxf
import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import Mesh, OptionError
from gso.cli import main
from gso.workshop import Finish, Thickness


def duct(corners, length=100.0) -> Mesh:
    """A closed section (k, 2), extruded."""
    count = len(corners)
    points = np.array([[*xy, z] for z in (0.0, length) for xy in corners])
    k = np.arange(count)
    j = (k + 1) % count
    return Mesh(points, np.stack([k, j, j + count, k + count], axis=1))


def circle(radius, count=48):
    turn = 2 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def frustum(low, high, height, count=48) -> Mesh:
    points = np.concatenate([np.pad(circle(r, count), ((0, 0), (0, 1))) for r in (low, high)])
    points[count:, 2] = height
    return Mesh(points, duct(circle(low, count)).faces)


def box(x, y, z) -> Mesh:
    sides = duct([(0, 0), (x, 0), (x, y), (0, y)], z)
    return Mesh(sides.vertices, np.r_[sides.faces, [[3, 2, 1, 0], [4, 5, 6, 7]]])


def made(design, folder, **options):
    more = {name: options.pop(name) for name in ("cut", "formats") if name in options}
    more = {"formats": ("svg",)} | more
    return gso.fabricate(design, folder, workers=0, finish=Finish(notches=None, **options), **more)


@pytest.mark.parametrize("width", [5.0, 40.0])
def test_a_tube_is_wider_by_its_overlap(tmp_path, width):
    radius, length = 50.0, 150.0
    tube = duct(circle(radius), length)
    job = made(tube, tmp_path, seam_overlap=width, formats=("dxf",))
    assert job.usable
    (part,) = job.parts
    whole = 2 * np.pi * radius + width
    np.testing.assert_allclose(part.size, (whole, length), rtol=1e-9)
    assert part.area == pytest.approx(whole * length, rel=1e-9)
    over = part.mirrored()
    assert [zone.angle for zone in over.zones] == [-zone.angle for zone in part.zones]
    (seam,) = part.seams
    at = seam[0, 0]
    assert at == pytest.approx(seam[1, 0]) and min(at, whole - at) == pytest.approx(width)
    # The sheet stays a cylinder: lines to roll along go on in the overlap, at their distance.
    lines = np.sort([bend.line[0, 0] for bend in part.bends])
    on = lines[lines < width] if at < whole / 2 else whole - lines[lines > at]
    assert len(on) == int(width / np.ptp(lines[20:22])) and np.ptp(np.diff(lines)[9:-9]) < 1e-6
    drawn = ezdxf.readfile(tmp_path / "parts" / "design.dxf").modelspace()
    assert len(drawn.query('*[layer=="SEW"]')) == 1 and len(drawn.query('*[layer=="CUT"]')) == 1


def test_the_overlap_of_a_cone_is_on_the_cone(tmp_path):
    low, high, height, width = 120.0, 65.0, 110.0, 20.0
    bare, job = (
        made(frustum(low, high, height), tmp_path / str(w), seam_overlap=w) for w in (None, width)
    )
    assert job.usable
    slant = np.hypot(height, low - high)
    outer, inner = slant * low / (low - high), slant * high / (low - high)

    def beside(radius):
        """The area of the half disc up to a distance from its straight side, half of it."""
        return 0.5 * (width * np.sqrt(radius**2 - width**2) + radius**2 * np.arcsin(width / radius))

    added = job.parts[0].area - bare.parts[0].area
    assert added == pytest.approx(beside(outer) - beside(inner), rel=2e-3)


def test_bends_that_cross_a_seam_go_on(tmp_path):
    count, width = 24, 10.0
    rings = [circle(50.0, count)] * 3
    points = np.concatenate([np.c_[r, np.full(count, z)] for r, z in zip(rings, (0, 75.0, 150.0))])
    low = duct(circle(50.0, count)).faces
    cut = np.stack([count + np.arange(count), count + (np.arange(count) + 1) % count], axis=1)
    job = made(Mesh(points, np.r_[low, low + count]), tmp_path, seam_overlap=width, cut=cut)
    assert job.usable and len(job.parts) == 2
    heights = sorted(part.size[1] for part in job.parts)
    np.testing.assert_allclose(heights, [75.0, 75.0 + width])
    long = max(job.parts, key=lambda part: part.size[1])
    across = [np.ptp(bend.line[:, 1]) for bend in long.bends]
    assert np.median(across) == pytest.approx(75.0 + width)


def test_flanges_of_a_box_are_folded_and_mitred(tmp_path):
    x, y, z, width = 90.0, 60.0, 40.0, 8.0
    job = made(box(x, y, z), tmp_path, seam_flange=width)
    assert job.usable
    (part,) = job.parts
    folds = [np.linalg.norm(bend.line[1] - bend.line[0]) for bend in part.bends]
    # All twelve edges are folds now; every flange has 45 degrees at its ends.
    np.testing.assert_allclose(np.sort(folds), np.sort(4 * [x, y, z]))
    np.testing.assert_allclose(np.degrees([bend.angle for bend in part.bends]), 90.0)
    cuts = sum(folds) - sum(np.linalg.norm(b.line[1] - b.line[0]) for b in plain_bends(x, y, z))
    assert part.area == pytest.approx(2 * (x * y + y * z + z * x) + cuts * width - 7 * width**2)


def plain_bends(x, y, z):
    net = gso.unfold(box(x, y, z))
    return net.folds.lines(net.pattern.flat)


@pytest.mark.parametrize(("thick", "radius", "k"), [(1.0, 1.0, 0.5), (2.0, 3.0, 0.33)])
def test_the_length_of_a_flange_is_that_of_the_shop_formula(tmp_path, thick, radius, k):
    side, width = 60.0, 12.0
    square = duct([(0, 0), (side, 0), (side, side), (0, side)])
    sheet = Thickness(thick, k=k, radius=radius, face="outside")
    job = made(square, tmp_path, seam_flange=width, thickness=sheet)
    assert job.usable
    deduction = 2 * (radius + thick) - np.pi / 2 * (radius + k * thick)
    assert job.parts[0].size[0] == pytest.approx(4 * side + width - 4 * deduction)
    np.testing.assert_allclose([bend.radius for bend in job.parts[0].bends], radius)
    assert len(job.parts[0].bends) == 4 and not job.parts[0].seams


@pytest.mark.parametrize(
    ("design", "options"),
    [
        (duct(circle(50.0)), {"seam_overlap": 320.0}),
        (box(90.0, 60.0, 40.0), {"seam_flange": 45.0}),
    ],
    ids=["tube", "box"],
)
def test_strips_without_room_are_refused(tmp_path, design, options):
    job = made(design, tmp_path, **options)
    assert [reason.code.value for reason in job.reasons] == ["seam_strip"]


def test_seams_without_tabs_are_named(tmp_path):
    # The walls of a rod are narrower than a quarter of the tabs, along its only long seam.
    rod = box(200.0, 3.0, 3.0)
    job = made(rod, tmp_path / "a", tabs=40.0)
    assert job.usable
    said = "seam 1 has no tab"
    assert [said in note for note in job.certificate["notes"]].count(True) == 1
    gso.save(rod, tmp_path / "rod.obj")
    command = ["unfold", str(tmp_path / "rod.obj"), "-o", str(tmp_path / "rod.svg"), "--tabs"]
    runner = CliRunner()
    assert f"note: {said}" in runner.invoke(main, [*command, "40"]).output
    assert "no tab" not in runner.invoke(main, [*command, "2"]).output


def test_other_seams_and_options(tmp_path):
    square = duct([(0, 0), (60, 0), (60, 60), (0, 60)])
    job = made(square, tmp_path / "a", seam_overlap=5.0)
    assert job.usable and min(job.parts[0].size) == pytest.approx(100.0)
    assert any("no seam is smooth" in note for note in job.certificate["notes"])
    for other in ({"tabs": 5.0}, {"allowance": 5.0}):
        with pytest.raises(OptionError, match="exclude each other"):
            Finish(seam_flange=5.0, **other)
    gso.save(square, tmp_path / "duct.obj")
    command = ["fabricate", str(tmp_path / "duct.obj"), "-o", str(tmp_path / "b"), "--workers", "0"]
    done = CliRunner().invoke(main, [*command, "--seam-flange", "1cm", "--format", "svg"])
    assert done.exit_code == 0, done.output
    assert "BEND_DOWN" in (tmp_path / "b" / "parts" / "duct.svg").read_text()
