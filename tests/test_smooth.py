"""Smooth strips: torsal B-splines through the rulings of ruled surfaces, and their files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

import gso
from gso.ruled import Strips, Untrimmed
from gso.ruled.smooth.curves import Curves, hermite
from gso.ruled.smooth.smooth_fit import _places
from gso.spline import TrimmedSpline
from tests.conftest import cylinder

ROOT = Path(__file__).resolve().parents[1]


def fan(strips=2):
    """Strips with a fan: four rulings share their first end."""
    u = np.linspace(0.0, 1.0, 8)
    first = np.stack([u, 0.1 * np.sin(4 * u), 0 * u], axis=1)
    points = first[:, None] + np.linspace(0.0, 1.0, strips + 1)[:, None] * [0.1, 1.0, 0.3]
    layout, vertices = Strips.sequence(8, strips), points.reshape(-1, 3)
    ends = layout.index[0][3:7, 0]
    return layout.merged(vertices, np.stack([ends[:-1], ends[1:]], axis=1))


@pytest.fixture(scope="module")
def solved():
    panel = gso.load(ROOT / "examples" / "panel.obj")
    # Strips along lines have no smooth surfaces.
    design = gso.Mesh(panel.vertices, panel.triangles)
    options = gso.RuledOptions(strips=3, starts=("design",), lines=False)
    return gso.tno.optimize(design, options=options)


def test_hermite_weights_reproduce_cubics():
    a, h = 0.4, 0.7
    cubic = np.poly1d([2.0, -1.0, 0.5, 3.0])
    value, slope = hermite(np.array([0.0, 0.3, 1.0]), h)
    known = np.array([cubic(a), cubic.deriv()(a), cubic(a + h), cubic.deriv()(a + h)])
    at = a + h * np.array([0.0, 0.3, 1.0])
    np.testing.assert_allclose(value @ known, cubic(at), rtol=1e-13)
    np.testing.assert_allclose(slope @ known, cubic.deriv()(at), rtol=1e-12)


def test_halved_spans_are_the_same_curves():
    curves = Curves.of(*fan())
    chosen = np.arange(len(curves.spans.row)) % 3 == 0
    halved, parent = curves.split(chosen)
    rows = np.unique(curves.spans.row[chosen])
    assert len(halved.spans.row) == len(parent)
    assert len(halved.knots[0]) == len(curves.knots[0]) + len(rows)
    start = curves.knots[0][curves.spans.row]
    for s in (0.0, 0.3, 0.9):
        new = halved.both(s)
        u = halved.knots[0][halved.spans.row] + s * halved.spans.width
        for e, p in enumerate(parent):
            at = np.clip((u[e] - start[p]) / curves.spans.width[p], 0.0, 1.0)
            old = curves.both(at)
            for x, y in zip(new, old, strict=True):
                np.testing.assert_allclose(x[e], y[p], atol=1e-12)


def test_curves_have_continuous_derivatives_except_beside_fans(solved):
    curves = Curves.of(*fan(1))
    assert [(a, b) for _, a, b in curves.pieces()] == [(0, 3), (3, 6), (6, 7)]
    seen = 0
    for patch in gso.smooth_strips(solved.ruled, solved.design).patches:
        u = np.unique(patch.spline.knots_u)
        seen += len(u) - 2
        for v in (0.0, 1.0):
            before, after = (patch.spline.evaluate(u[1:-1] + d, v, du=1) for d in (-1e-9, 1e-9))
            np.testing.assert_allclose(before, after, atol=1e-7 * np.abs(before).max(initial=1.0))
    assert seen > 10


def test_places_on_rulings_are_found():
    rng = np.random.default_rng(0)
    quads = np.tile([[0.0, 0, 0], [0, 1, 0], [1, 0.2, 0], [1.2, 1.5, 0]], (50, 1, 1))
    s, v = rng.random((2, 50, 1))
    p, q = ((1 - s) * quads[:, k] + s * quads[:, k + 2] for k in (0, 1))
    np.testing.assert_allclose(_places(quads, (1 - v) * p + v * q), v[:, 0], atol=1e-9)


def test_a_cylinder_is_reproduced():
    options = gso.RuledOptions(lines=False)
    result = gso.tno.optimize(cylinder(33, turn=0.4), options=options)
    strips = gso.smooth_strips(result.ruled, result.design)
    size = result.design.diagonal
    assert strips.is_torsal
    assert strips.turning < 0.01
    assert strips.distances[0] < 3e-4 * size
    (patch,) = [p for p in strips.patches if p.spline.net.shape[0] > 10]
    assert patch.spline.degrees == (3, 1)
    # The axis is perpendicular to all normals.
    u = np.linspace(patch.spline.knots_u[0], patch.spline.knots_u[-1], 50)
    normals = patch.spline.normals(u, 0.5)
    assert np.linalg.svd(normals, compute_uv=False)[2] < 0.01 * np.sqrt(len(u))


def test_strips_are_torsal_and_close(solved):
    strips = gso.smooth_strips(solved.ruled, solved.design)
    assert strips.is_torsal
    assert strips.distances[0] < 5e-3 * solved.design.diagonal
    # Normals along rulings inside the outline, by differences of points.
    count = 0
    for patch in strips.patches:
        for loop, *_ in patch.faces:
            outline = shapely.Polygon(np.concatenate(loop))
            low, high = np.concatenate(loop).min(axis=0), np.concatenate(loop).max(axis=0)
            for u in np.linspace(low[0], high[0], 12)[1:-1]:
                v = np.linspace(low[1], high[1], 50)
                v = v[shapely.contains_xy(outline, u, v)]
                along = patch.spline.evaluate(u + 1e-6, v) - patch.spline.evaluate(u - 1e-6, v)
                ends = patch.spline.evaluate(u, [0.0, 1.0])
                normal = np.cross(along, ends[1] - ends[0])
                normal /= np.linalg.norm(normal, axis=1, keepdims=True)
                if len(normal):
                    assert np.linalg.norm(normal - normal[0], axis=1).max() < np.radians(0.12)
                    count += 1
    assert count > 20


def test_step_files_have_one_sound_shell(solved, tmp_path):
    pytest.importorskip("OCP")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SHELL
    from OCP.TopExp import TopExp_Explorer

    result = replace(solved)
    path = tmp_path / "a.step"
    result.save(path, unit="mm")
    assert "smooth strips" in result.notes[-1]
    text = path.read_text(encoding="utf-8")
    strips = gso.smooth_strips(result.ruled, result.design)
    assert text.count("ADVANCED_FACE") == sum(len(p.faces) for p in strips.patches)
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    assert BRepCheck_Analyzer(shape).IsValid()
    shells = TopExp_Explorer(shape, TopAbs_SHELL)
    count = 0
    while shells.More():
        count += 1
        shells.Next()
    assert count == 1
    measured = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, measured)
    area = sum(_area(p.spline, loop) for p in strips.patches for loop, *_ in p.faces)
    assert measured.Mass() == pytest.approx(area, rel=0.01)


def _area(spline, loop, count=100):
    """Integrate the area of a spline inside a loop by the midpoint rule."""
    outline = shapely.Polygon(np.concatenate(loop))
    low, high = (np.array(x) for x in (outline.bounds[:2], outline.bounds[2:]))
    u, v = ((np.arange(count) + 0.5)[:, None] / count * (high - low) + low).T
    u, v = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    inside = shapely.contains_xy(outline, u, v)
    u, v = u[inside], v[inside]
    normal = np.cross(spline.evaluate(u, v, du=1), spline.evaluate(u, v, dv=1))
    return np.linalg.norm(normal, axis=1).sum() * np.prod(high - low) / count**2


def test_rhino_files_have_surfaces_and_outlines(solved, tmp_path):
    rhino = pytest.importorskip("rhino3dm")
    strips = gso.smooth_strips(solved.ruled, solved.design)
    gso.io.save_patches(strips.patches, tmp_path / "a.3dm", unit="cm")
    model = rhino.File3dm.Read(str(tmp_path / "a.3dm"))
    assert [layer.Name for layer in model.Layers] == ["surfaces", "outlines"]
    on = [model.Objects[k].Attributes.LayerIndex for k in range(len(model.Objects))]
    assert on.count(0) == len(strips.patches)
    assert on.count(1) == sum(len(p.outlines()) for p in strips.patches)


def test_surfaces_that_bend_sharply_are_written_as_planar_faces(solved, tmp_path, monkeypatch):
    pytest.importorskip("OCP")
    result = replace(solved)
    monkeypatch.setattr("gso.ruled.smooth.smooth_surface.SmoothSurface.is_torsal", False)
    result.save(tmp_path / "a.step")
    assert "planar faces" in result.notes[-1]
    text = (tmp_path / "a.step").read_text(encoding="utf-8")
    assert text.count("ADVANCED_FACE") == len(result.mesh.faces)


def test_files_keep_the_strips(solved, tmp_path):
    solved.save(tmp_path / "a.npz")
    again = gso.Result.load(tmp_path / "a.npz")
    one, two = (gso.smooth_strips(r.ruled, r.design) for r in (solved, again))
    assert one.turning == two.turning
    assert one.distances == two.distances
    old = replace(solved.ruled, untrimmed=None)
    with pytest.raises(gso.MeshError, match="earlier version"):
        gso.smooth_strips(old)


@pytest.mark.parametrize("name", ["rulings", "lengths", "flats", "ends", "owner"])
def test_damaged_strips_are_refused(solved, name):
    arrays = solved.ruled.untrimmed.arrays()
    whole = Untrimmed.from_arrays(arrays)
    assert len(whole.vertices) == len(solved.ruled.untrimmed.vertices)
    wrong = np.full_like(arrays[name], -1) if name != "flats" else np.zeros((1, 4))
    wrong = wrong[:, :2] if name == "ends" else wrong
    with pytest.raises(ValueError, match="do not fit"):
        Untrimmed.from_arrays({**arrays, name: wrong})


def test_trees_have_flat_patches():
    points = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 33)] * 2, indexing="ij"), axis=-1)
    x, y = points[..., 0], points[..., 1]
    design = np.dstack([x, y, 0.1 * (x**3 - 3.0 * x * y**2)])
    result = gso.tno.optimize(design, options=gso.RuledOptions(flats=True, starts=("design",)))
    strips = gso.smooth_strips(result.ruled, result.design)
    assert strips.turning < 0.1
    assert any(p.spline.degrees == (1, 1) for p in strips.patches)


@pytest.mark.parametrize("size", [0.35, 0.2, 0.08, 0.04])
def test_holes_and_slots_are_cut_out(size):
    u, v = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41), indexing="ij")
    whole = gso.Mesh.from_grid(np.stack([u, v, 0.2 * u * u - 0.05 * v], axis=-1))
    middle = whole.vertices[whole.faces].mean(axis=1)
    hole = np.abs(middle[:, :2] - [0.2, 0.1]).max(axis=1) < size
    slot = (np.abs(middle[:, 1] + 0.5) < 0.1) & (middle[:, 0] > 0.3)
    mesh = gso.Mesh(whole.vertices, whole.faces[~hole & ~slot])
    result = gso.tno.optimize(mesh, options=gso.RuledOptions(starts=("design",), strips=1))
    # Rulings cross the slot: the strip does not turn around its end.
    assert result.usable
    assert result.metrics["distance_max"] < 0.5
    strips = gso.smooth_strips(result.ruled, result.design)
    assert strips.is_torsal
    assert strips.distances[1] < 0.02 * mesh.diagonal
    area = sum(_area(p.spline, loop) for p in strips.patches for loop, *_ in p.faces)
    area -= sum(_area(p.spline, h) for p in strips.patches for _, *holes in p.faces for h in holes)
    assert area == pytest.approx(gso.metrics.area(result.mesh), rel=0.01)


def test_what_cannot_be_written_is_refused(tmp_path):
    pytest.importorskip("OCP")
    with pytest.raises(gso.MeshError, match=r"a\.step: there are no surfaces"):
        gso.io.save_patches([], tmp_path / "a.step")
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    spline = gso.BSplineSurface(net, [0, 0, 1, 1], [0, 0, 1, 1])
    crossing = np.array([[0.1, 0.1], [0.9, 0.9], [0.9, 0.1], [0.1, 0.9], [0.1, 0.1]])
    patch = TrimmedSpline(spline, ((tuple(crossing[k : k + 2] for k in range(4)),),))
    with pytest.raises(gso.MeshError, match=r"a\.step: .*crosses itself"):
        gso.io.save_patches([patch], tmp_path / "a.step")


def test_a_loft_becomes_one_patch():
    t = np.linspace(0.0, 1.0, 40)
    circle = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    strips = gso.smooth_strips(gso.loft(circle, 2.0 * circle + [0.0, 0.0, 1.0]))
    (patch,) = strips.patches
    u = np.linspace(patch.spline.knots_u[0], patch.spline.knots_u[-1], 30)
    for v, radius in ((0.0, 1.0), (1.0, 2.0)):
        ends = patch.spline.evaluate(u, v)
        np.testing.assert_allclose(np.hypot(ends[:, 0], ends[:, 1]), radius, atol=1e-3)
