"""Tables of offsets, and the panels of hulls between their lines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import MeshError, OptionError
from gso.cli import main
from gso.io import read_offsets
from gso.workshop import hull_panels, whole_hull

DINGHY = Path(__file__).resolve().parents[1] / "examples" / "dinghy.csv"
T = np.linspace(0.2, 1.2, 30)


def cone(height):
    """A circle of the cone of half-angle 45 degrees around x."""
    return height * np.stack([np.ones_like(T), np.cos(T), np.sin(T)], axis=1)


def test_both_forms_of_a_table_are_read(tmp_path):
    lines = read_offsets(DINGHY)
    assert list(lines) == ["keel", "chine", "sheer"]
    assert {line.shape for line in lines.values()} == {(9, 3)} and (lines["keel"][:, 1] == 0).all()
    rows = ["Line;X;Y;Z"]
    for name, line in lines.items():
        rows += [f"{name};" + ";".join(map(repr, point)) for point in line.tolist()]
    path = tmp_path / "points.csv"
    path.write_text("\n".join(["# by point", *rows, ""]))
    for name, line in read_offsets(path).items():
        np.testing.assert_array_equal(line, lines[name])


def test_lines_may_be_shorter_than_the_hull(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text("station, a y, a z, b y, b z\n0, 1, 2, ,\n1, 1, 2, 3, 4\n\n2, 1, 2, 3, 4\n")
    lines = read_offsets(path)
    assert len(lines["a"]) == 3 and lines["b"][:, 0].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty"),
        ("a, b, c\n1, 2, 3\n", "columns a, b, c"),
        ("x, keel y, sheer z\n", "columns"),
        ("x, keel y, keel z\n0, 1, 2\n1, two, 3\n", "row 3: 'two'"),
        ("line, x, y, z\nkeel, 0, 0, nan\n", "row 2: 'nan'"),
        ("line, x, y, z\nkeel, 0, 0\n", "row 2 has 3 cells"),
        ("x, keel y, keel z\n0, 1, 2, 3\n", "row 2 has 4 cells"),
    ],
)
def test_mistakes_in_tables_are_named(tmp_path, text, said):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(MeshError, match=said):
        read_offsets(path)


def test_the_panel_between_circles_of_a_cone_is_part_of_the_cone():
    (panel,) = hull_panels({"one": cone(1.0), "two": cone(2.0)}, mirrored=False, rulings=65)
    assert panel.surface.sound and panel.off < 1e-3
    # The area of the sector between two circles of a cone of half-angle 45 degrees.
    exact = 0.5 * np.sqrt(2) * (T[-1] - T[0]) * (2.0**2 - 1.0**2)
    assert gso.metrics.area(panel.surface.pattern.mesh) == pytest.approx(exact, rel=2e-3)


def test_panels_are_mirrored_in_pairs_with_their_outside_outside():
    panels = hull_panels(read_offsets(DINGHY))
    names = [panel.name for panel in panels]
    assert names == [n + e for n in ("keel-chine", "chine-sheer") for e in ("", "-mirrored")]
    for one, two in zip(panels[::2], panels[1::2], strict=True):
        a, b = (panel.surface.mesh for panel in (one, two))
        assert gso.metrics.area(a) == pytest.approx(gso.metrics.area(b), rel=1e-6)
        flipped = a.vertices * [1, -1, 1]
        assert gso.mesh.Nearest(b).distances(flipped).max() < 1e-6
    hull = whole_hull(panels)
    corner = hull.vertices[hull.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    # Outside is below, and away from the plane of symmetry.
    assert (normal[:, 2] < 1e-9).all()
    assert (normal[:, 1] * corner[:, :, 1].mean(axis=1) > -1e-9).all()


def test_lines_that_make_no_panel_are_named():
    with pytest.raises(OptionError, match="1 lines"):
        hull_panels({"keel": cone(1.0)})
    with pytest.raises(MeshError, match="`short`"):
        hull_panels({"keel": cone(1.0), "short": cone(2.0)[:2]})


@pytest.mark.parametrize("out", ["hull.svg", "hull.dxf", "hull.pdf"])
def test_drawings_have_a_part_for_each_panel(tmp_path, monkeypatch, out):
    pytest.importorskip({"hull.dxf": "ezdxf", "hull.pdf": "reportlab"}.get(out, "numpy"))
    monkeypatch.chdir(tmp_path)
    words = ["loft", str(DINGHY), "-o", out, "--unit", "m", "--json"]
    done = CliRunner().invoke(main, words, prog_name="gso")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["panels"]
    assert len(found) == 4 and all(one["usable"] for one in found)
    assert Path(out).stat().st_size > 1000


def test_the_hull_as_a_mesh_is_fabricated(tmp_path, monkeypatch):
    pytest.importorskip("ezdxf")
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    assert run(main, ["loft", str(DINGHY), "-o", "hull.obj", "--unit", "m"]).exit_code == 0
    mesh = gso.load("hull.obj")
    assert mesh.attributes is not None and "4 groups" in str(mesh.attributes)
    done = run(main, ["fabricate", "hull.obj", "-o", "job", "--unit", "m", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["parts"] == 4


def test_a_panel_off_its_lines_is_not_usable(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["loft", str(DINGHY), "-o", "hull.svg", "--unit", "m", "--max-deviation", "1e-6"]
    done = CliRunner().invoke(main, words, prog_name="gso")
    assert done.exit_code == 1 and "not usable: panel keel-chine" in done.output
