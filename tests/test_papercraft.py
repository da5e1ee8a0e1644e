"""Paper models: scale, pages, tabs and numbers of nets."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely
from click.testing import CliRunner

import gso
from gso import Mesh, OptionError
from gso.cli import main
from gso.verdict import Code
from gso.workshop import Finish

pypdf = pytest.importorskip("pypdf")
pytest.importorskip("reportlab")

ROOT = np.sqrt(2.0)


def house(x=6.0, y=4.0, z=3.0, roof=2.0) -> Mesh:
    """A box with a gable roof, whose height is along z."""
    base = np.array([[0, 0], [x, 0], [x, y], [0, y]])
    points = np.r_[np.pad(base, ((0, 0), (0, 1))), np.c_[base, np.full(4, z)]]
    points = np.r_[points, [[0, y / 2, z + roof], [x, y / 2, z + roof]]]
    walls = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    roof = [[4, 5, 9, 8], [6, 7, 8, 9], [5, 6, 9, -1], [7, 4, 8, -1]]
    return Mesh(points, [[3, 2, 1, 0], *walls, *roof])


def crossing_strip() -> Mesh:
    """A folded strip whose last wall passes through the first one."""
    line = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [15.0, -20.0]])
    points = np.array([[x, y, z] for z in (0.0, 60.0) for x, y in line])
    return Mesh(points, [[k, k + 1, 5 + k, 4 + k] for k in range(3)])


def area_of(mesh: Mesh) -> float:
    p = mesh.vertices[mesh.triangles]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    return 0.5 * float(np.linalg.norm(normal, axis=1).sum())


def write(mesh: Mesh, path) -> str:
    gso.save(mesh, path)
    return str(path)


@pytest.mark.parametrize(
    ("options", "factor"),
    [
        (["--scale", "10"], 10.0),
        (["--height", "100mm"], 20.0),
        (["--height", "8cm", "--up", "y"], 20.0),
    ],
)
def test_scale_and_height(tmp_path, options, factor):
    name = write(house(), tmp_path / "house.obj")
    words = ["unfold", name, "-o", str(tmp_path / "a.svg"), *options]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    area = sum(float(row.split()[1]) for row in done.output.splitlines()[1:] if row[0].isdigit())
    assert area == pytest.approx(factor**2 * area_of(house()), rel=1e-5)
    words = ["fabricate", name, "-o", str(tmp_path / "out"), "--format", "svg", "--workers", "0"]
    done = CliRunner().invoke(main, [*words, *options])
    assert done.exit_code == 0, done.output
    said = json.loads((tmp_path / "out" / "certificate.json").read_text())
    (design,) = said["designs"]
    assert said["asked"]["scale"] == pytest.approx(factor)
    assert design["area"] == pytest.approx(factor**2 * area_of(house()), rel=1e-9)


def test_the_scale_keeps_the_unit_straight(tmp_path):
    # 5 cm of 10 times the size, and a limit of the distance that is about the scaled design.
    job = gso.fabricate(
        house(), tmp_path, unit="cm", scale=2.0, max_deviation="1mm", formats=("svg",), workers=0
    )
    assert sum(part.area for part in job.parts) == pytest.approx(400 * area_of(house()), rel=1e-9)
    (record,) = job.certificate["designs"]
    assert record["allowed"] == pytest.approx(1.0)


def test_scale_and_height_exclude_each_other(tmp_path):
    name = write(house(), tmp_path / "house.obj")
    words = ["unfold", name, "-o", str(tmp_path / "a.svg")]
    for more, said in (
        (["--scale", "2", "--height", "9"], "exclude each other"),
        (["--scale", "-2"], "scale is -2"),
        (["--paper", "A4"], "whose name ends in .pdf"),
    ):
        done = CliRunner().invoke(main, [*words, *more])
        assert done.exit_code != 0 and said in done.output
    flat = write(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), tmp_path / "flat.obj")
    done = CliRunner().invoke(main, ["unfold", flat, *words[2:], "--height", "9"])
    assert done.exit_code != 0 and "no height along z" in done.output


@pytest.mark.parametrize("factor", [25.0, 30.0])
def test_each_part_has_a_page(tmp_path, factor):
    finish = Finish(tabs=5.0, notches=None)
    job = gso.fabricate(
        house(), tmp_path / "a", scale=factor, formats=(), paper="A4", finish=finish, workers=0
    )
    book = pypdf.PdfReader(tmp_path / "a" / "parts.pdf")
    assert job.usable and len(job.parts) > 1
    # Six steps of joining have a page together.
    assert len(book.pages) == len(job.parts) + -(-len(job.parts) // 6)
    for part in job.parts:
        long, wide = sorted(part.size, reverse=True)
        assert long <= 277 and wide <= 190
        assert any(part.name in page.extract_text() for page in book.pages)
    # A face that is larger than a page: the parts are divided into windows.
    job = gso.fabricate(
        house(), tmp_path / "b", scale=99.0, formats=(), paper="A4", finish=finish, workers=0
    )
    assert job.usable
    assert len(pypdf.PdfReader(tmp_path / "b" / "parts.pdf").pages) > len(job.parts)


def test_faces_larger_than_a_page_are_parts_of_their_own(tmp_path):
    # The base of the pyramid is larger, its sides are not.
    points = [[0, 0, 0], [250, 0, 0], [250, 250, 0], [0, 250, 0], [120, 130, 60]]
    faces = [[2, 1, 0], [3, 2, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    finish = Finish(tabs=5.0, notches=None)
    job = gso.fabricate(
        Mesh(points, faces), tmp_path, formats=(), paper="A4", finish=finish, workers=0
    )
    base = max(job.parts, key=lambda part: part.area)
    assert job.usable and 3 <= len(job.parts) <= 5 and not len(base.bends)
    assert any(f"part {base.name} is larger than a page" in x for x in job.certificate["notes"])
    text = [page.extract_text() for page in pypdf.PdfReader(tmp_path / "parts.pdf").pages]
    assert all(any(part.name in page for page in text) for part in job.parts)


def test_many_pages_are_said(tmp_path):
    finish = Finish(tabs=5.0, notches=None)

    def said(folder, paper):
        job = gso.fabricate(
            house(), folder, scale=150.0, formats=(), paper=paper, finish=finish, workers=0
        )
        count = len(pypdf.PdfReader(folder / "parts.pdf").pages)
        return count, [x for x in job.certificate["notes"] if x.startswith("the PDF has")]

    count, (note,) = said(tmp_path / "a", "A4")
    assert count >= 50 and note.startswith(f"the PDF has {count} pages of A4: ")
    assert "larger paper" in note
    count, none = said(tmp_path / "b", "A1")
    assert count < 50 and not none
    name = write(house().replaced(150.0 * house().vertices), tmp_path / "house.obj")
    words = ["unfold", name, "-o", str(tmp_path / "house.pdf"), "--paper", "A4"]
    done = CliRunner().invoke(main, words)
    count = len(pypdf.PdfReader(tmp_path / "house.pdf").pages)
    assert count >= 50 and f"note: the PDF has {count} pages of A4: " in done.output


@pytest.mark.parametrize("place", ["inside", "outside"])
def test_numbers_stand_inside_or_outside(tmp_path, place):
    for tabs in (None, 5.0):
        finish = Finish(tabs=tabs, notches=None, numbers=place, labels=4.0)
        job = gso.fabricate(
            house(), tmp_path, scale=20.0, formats=("svg",), finish=finish, workers=0
        )
        (part,) = job.parts
        plain = gso.fabricate(house(), tmp_path, scale=20.0, formats=("svg",), workers=0).parts[0]
        labels = [label for label in part.labels if label.text.isdigit()]
        count = np.bincount([int(label.text) for label in labels])[1:]
        # Each seam has its number on both of its sides.
        assert len(count) > 3 and (count == 2).all()
        reach = shapely.Polygon(part.outline)
        inner = [reach.contains(shapely.Point(label.at)) for label in labels]
        if tabs is None:
            assert set(inner) == {place == "inside"}
            assert part.area == pytest.approx(plain.area)
        else:
            assert all(inner) if place == "inside" else sum(inner) == len(count)
    with pytest.raises(OptionError, match="no numbers 'above'"):
        Finish(numbers="above")


def test_a_paper_model_may_pass_through_itself(tmp_path):
    plain = gso.fabricate(crossing_strip(), tmp_path / "a", formats=("svg",), workers=0)
    assert [reason.code for reason in plain.reasons] == [Code.CROSSES_ITSELF]
    finish = Finish(tabs=5.0, notches=None)
    paper = gso.fabricate(
        crossing_strip(), tmp_path / "b", formats=("svg",), finish=finish, workers=0
    )
    assert paper.usable and len(paper.parts) == 1
    assert any("passes through itself at faces" in note for note in paper.certificate["notes"])


def cubes(*corners) -> tuple[np.ndarray, list[list[int]]]:
    """Unit cubes at integer corners, with common vertices; a common face is there once."""
    places: dict[tuple[int, ...], int] = {}
    faces: dict[tuple[int, ...], list[int]] = {}
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    for corner in corners:
        own = [
            places.setdefault((corner[0] + x, corner[1] + y, corner[2] + z), len(places))
            for x in (0, 1)
            for y in (0, 1)
            for z in (0, 1)
        ]
        for side in sides:
            face = [own[k] for k in side]
            faces.setdefault(tuple(sorted(face)), face)
    return np.array(list(places), float), list(faces.values())


@pytest.mark.parametrize("other", [(1, 1, 1), (1, 1, 0)])
def test_bodies_that_touch_stay_closed(tmp_path, other):
    points, faces = cubes((0, 0, 0), other)
    net = gso.unfold((points, faces))
    # Two cubes with all of their folds.
    assert len(net) == 2 and len(net.angles) == 10
    job = gso.fabricate((points, faces), tmp_path, formats=("svg",), workers=0)
    assert job.usable and sum(part.count for part in job.parts) == 2
    assert sum(len(part.bends) * part.count for part in job.parts) == 10
    said = job.certificate["notes"]
    assert any("divided" in note for note in said) and not any("weld" in note for note in said)


def test_faces_inside_bodies_are_named(tmp_path):
    points, faces = cubes((0, 0, 0), (1, 0, 0), (1, 1, 0))
    middle = np.array([points[face].mean(axis=0) for face in faces])
    inner = [[1.0, 0.5, 0.5], [1.5, 1.0, 0.5]]
    with pytest.raises(
        gso.MeshError, match=r"face \d+ at \(1, .*inside a body.*2 such faces"
    ) as it:
        gso.unfold((points, faces))
    assert middle[int(str(it.value).split()[1])].tolist() in inner
    with pytest.raises(gso.MeshError, match="inside a body"):
        gso.fabricate((points, faces), tmp_path)
    # A wall between two of the sides of a body that is open at the top is no such face.
    above = [f for f in faces if not (points[f, 2] == 1).all()]
    assert gso.unfold((points, above)).areas.sum() == pytest.approx(len(above))
    points, faces = cubes((0, 0, 0))
    with pytest.raises(gso.MeshError, match="face 6 has the corners of face 2"):
        gso.unfold((points, [*faces, faces[2]]))


def test_seams_are_named_by_edges(tmp_path):
    job = gso.fabricate(
        house(), tmp_path, formats=("svg",), cut=[[0, 4], [1, 5]], keep=[[2, 6], [8, 9]], workers=0
    )
    lengths = sorted(
        round(float(np.linalg.norm(bend.line[1] - bend.line[0])), 6) for bend in job.parts[0].bends
    )
    # The upright edge and the ridge are folds; of the other upright ones at most one is.
    assert len(job.parts) == 1 and 6.0 in lengths and 1 <= lengths.count(3.0) <= 2
    name = write(house(), tmp_path / "house.obj")
    words = ["fabricate", name, "-o", str(tmp_path / "a"), "--format", "svg", "--workers", "0"]
    done = CliRunner().invoke(main, [*words, "--cut", "0-4", "--keep", "8-9"])
    assert done.exit_code == 0, done.output
    for more, said in ((["--cut", "0-9"], "0-9 is no edge"), (["--keep", "x"], "'x' is no edge")):
        done = CliRunner().invoke(main, [*words, *more])
        assert done.exit_code != 0 and said in done.output
    job = gso.fabricate(house(), tmp_path / "b", cut=[[0, 4]], keep=[[4, 0]], workers=0)
    assert "is in keep and in cut" in str(job.reasons[0])
