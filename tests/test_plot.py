"""Pictures: they are written, show the right numbers, and look at the right side."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gso
from gso.plot import (
    Panel,
    View,
    curvatures,
    distance,
    numbers,
    plot_result,
    plot_rulings,
    plot_surface,
    strain,
)

pytest.importorskip("matplotlib")


def bump(size=9, height=0.3):
    y, x = np.mgrid[:size, :size] / (size - 1)
    return gso.Mesh.from_grid(
        np.stack([x, y, height * np.sin(np.pi * x) * np.sin(np.pi * y)], axis=-1)
    )


def plane(size=5):
    y, x = np.mgrid[:size, :size] / (size - 1)
    return gso.Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))


def mixed():
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 1]]
    return gso.Mesh(vertices, [[0, 1, 2, 3], [1, 4, 2, -1]])


def triangles():
    mesh = bump()
    return gso.Mesh(mesh.vertices, mesh.triangles)


def sphere():
    """An octahedron, split twice and rounded: closed."""
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(2)
    return gso.Mesh(ball.vertices, ball.faces)


@pytest.mark.parametrize("task", ["developable", "flatten", "denoise"])
def test_results_are_drawn(tmp_path, task):
    result = gso.tno.optimize(bump(), task=task)
    figure = plot_result(result, tmp_path / "out.png")
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    titles = [ax.get_title() for ax in figure.axes if ax.get_title()]
    labels = {ax.get_xlabel() for ax in figure.axes if ax.get_xlabel()}
    if task == "flatten":
        assert titles[0] == "surface"
        assert f"largest {100 * result.metrics['strain_max']:.2g} %" in titles[1]
        assert labels == {"principal strain (%)"}
    else:
        assert len(titles) == 3 + (task == "developable")
        assert "distance (% of the diagonal)" in labels
    if task == "developable":
        assert titles[0] == f"input: mean |K| {result.metrics['mean_abs_K_before']:.2g}"
        assert titles[1] == f"result: mean |K| {result.metrics['mean_abs_K']:.2g}"
        assert len(labels) == 3 and titles[3].startswith("flat pattern")


@pytest.mark.parametrize("make", [bump, plane, mixed, triangles, sphere])
@pytest.mark.parametrize("values", ["none", "curvature"])
def test_every_kind_of_mesh_is_drawn(tmp_path, make, values):
    plot_surface(make(), values, path=tmp_path / "out.png")
    assert (tmp_path / "out.png").stat().st_size > 1000


@pytest.mark.parametrize("suffix", [".pdf", ".svg"])
def test_other_formats(tmp_path, suffix):
    plot_surface(bump(), path=tmp_path / f"out{suffix}")
    assert (tmp_path / f"out{suffix}").stat().st_size > 1000


def test_a_failed_picture_keeps_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "out.png"
    path.write_text("precious")
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda *a, **k: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        plot_surface(plane(), path=path)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


def test_before_is_drawn_in_the_same_scale():
    figure = plot_surface(bump(height=0.1), "curvature", before=bump(), title="flatter")
    assert [ax.get_title() for ax in figure.axes[:2]] == ["before", "flatter"]
    assert len(figure.axes) == 3


def test_numbers_of_ones_own():
    mesh = bump()
    for values in (np.arange(81.0), np.arange(64.0), np.full(81, 2.0)):
        figure = plot_surface(mesh, values, label="my number")
        assert figure.axes[1].get_xlabel() == "my number"
    with pytest.raises(gso.OptionError, match=r"\(81,\) or per face \(64,\)"):
        plot_surface(mesh, np.arange(5.0))


@pytest.mark.parametrize("make", [bump, plane, mixed, triangles, sphere])
def test_rulings_are_drawn(tmp_path, make):
    figure = plot_rulings(make(), count=4, path=tmp_path / "out.png")
    assert (tmp_path / "out.png").stat().st_size > 1000
    rulings, gauss = (ax.get_title() for ax in figure.axes)
    if make is plane:
        assert rulings == "no rulings: the surface is flat"
    else:
        assert rulings.startswith("rulings, off straight by ")
    thickness = gso.rulings.shape_operator(make()).thickness
    assert gauss == f"Gauss image, thickness {thickness:.2g}"


def test_gauss_image_before_is_drawn_first():
    figure = plot_rulings(bump(height=0.1), count=4, before=bump())
    titles = [ax.get_title() for ax in figure.axes]
    assert len(titles) == 3
    assert titles[0].startswith("Gauss image before, thickness ")
    assert titles[1].startswith("rulings")
    with pytest.raises(gso.OptionError, match="count=0"):
        plot_rulings(bump(), count=0)


def test_lines_are_painted_over_their_face_and_under_nearer_ones():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [1, 0, 2], [0, 1, 2.0]])
    panel = Panel(points, np.array([[3, 4, 5], [0, 1, 2]]), shaded=False)
    panel.lines = [np.array([[0.1, 0.1, 0.0], [0.3, 0.1, 0.0], [0.5, 0.1, 0.0]])]
    painted = gso.plot.draw([panel]).axes[0].collections[0]
    assert [len(path.vertices) > 3 for path in painted.get_paths()] == [True, False, False, True]
    assert np.allclose(painted.get_facecolor()[:, 3], [1.0, 0.0, 0.0, 1.0])


def test_mistakes():
    with pytest.raises(gso.OptionError, match="no colour 'heat'"):
        plot_surface(bump(), "heat")
    for name in ("distance", "strain"):
        with pytest.raises(gso.OptionError, match="before"):
            plot_surface(bump(), name)
    with pytest.raises(gso.OptionError, match="25 vertices and the surface 81"):
        plot_surface(plane(), "strain", before=bump())
    with pytest.raises(gso.MeshError, match="jpg"):
        plot_surface(bump(), path="out.jpg")


def test_without_matplotlib(monkeypatch):
    monkeypatch.setattr(sys.modules["gso.plot.draw"], "find_spec", lambda name: None)
    with pytest.raises(gso.GSOError, match=r'pip install "\.\[plot\]"'):
        plot_surface(bump())
    with pytest.raises(gso.GSOError, match=r'pip install "\.\[plot\]"'):
        plot_result(None)
    with pytest.raises(gso.GSOError, match=r'pip install "\.\[plot\]"'):
        plot_rulings(bump())


def test_no_window_system_is_touched(tmp_path):
    code = (
        "import sys, numpy as np, gso\n"
        "y, x = np.mgrid[:5., :5.]\n"
        "gso.plot.plot_surface(np.stack([x, y, x * y / 9], axis=-1),"
        f" 'curvature', path={str(tmp_path / 'a.png')!r})\n"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    assert Path(tmp_path / "a.png").exists()


@pytest.mark.parametrize("make", [bump, plane, mixed, triangles, sphere])
def test_views_are_frames(make):
    axes = View.of(make()).axes
    assert np.allclose(axes.T @ axes, np.eye(3))
    assert np.isclose(np.linalg.det(axes), 1.0)


def test_flat_surfaces_are_seen_from_above():
    assert np.allclose(View.of(plane()).axes, np.eye(3))
    down = plane()
    down = gso.Mesh(down.vertices, down.faces[:, ::-1])
    assert np.allclose(View.of(down).axes, np.eye(3))


def test_surfaces_show_their_face():
    mesh = bump()
    assert View.of(mesh).axes[2, 2] > 0.5
    wall = gso.Mesh(mesh.vertices[:, [2, 0, 1]], mesh.faces)
    right, up, eye = View.of(wall).axes.T
    normal = np.cross(
        *(wall.vertices[wall.faces[0, [2, 3]]] - wall.vertices[wall.faces[0, [0, 1]]])
    )
    assert normal @ eye > 0
    assert up[2] > 0.8
    assert abs(right[2]) < 1e-9


def test_views_do_not_depend_on_place_and_unit():
    mesh = bump()
    moved = mesh.replaced(1000.0 * mesh.vertices + np.array([1e6, -1e6, 1e6]))
    here, there = View.of(mesh), View.of(moved)
    assert np.allclose(here.project(mesh.vertices), there.project(moved.vertices), atol=1e-8)


def test_nearer_faces_are_painted_later():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [1, 0, 2], [0, 1, 2.0]])
    panel = Panel(points, np.array([[3, 4, 5], [0, 1, 2]]), shaded=False)
    panel.heat = numbers(gso.Mesh(points, panel.faces), np.array([0.0, 1.0]), "")
    painted = gso.plot.draw([panel]).axes[0].collections[0].get_facecolor()
    from matplotlib import colormaps

    far, near = colormaps[panel.heat.scale.colours]([1.0, 0.0])
    assert np.allclose(painted, [far, near])


def test_faces_without_a_number_are_grey():
    mesh = bump()
    heat = curvatures([mesh])[0]
    assert np.isfinite(heat.values).all()  # each face of a grid has an interior corner
    one = gso.Mesh(mesh.vertices[[0, 1, 10, 9]], [[0, 1, 2, 3]])
    assert np.isnan(curvatures([one])[0].values).all()
    painted = gso.plot.draw([Panel(mixed().vertices, mixed().faces, heat=curvatures([mixed()])[0])])
    colour = painted.axes[0].collections[0].get_facecolor()[:, :3]
    assert np.allclose(colour - colour[:, :1], 0.0)


def test_face_values_are_means_of_corners():
    mesh = mixed()
    values = numbers(mesh, np.array([0.0, 1.0, 2.0, np.nan, 6.0]), "").values
    assert np.allclose(values, [1.0, 3.0])


def test_distance_of_parallel_planes():
    mesh = plane()
    heat = distance(mesh, mesh.replaced(mesh.vertices + np.array([0, 0, 0.1])))
    assert np.allclose(heat.values, 10.0 / np.sqrt(2))
    assert heat.summary == "mean 7.1 %, largest 7.1 %, back 7.1 %"


def test_strain_of_magnified_patterns():
    mesh = plane()  # whose normals point down
    assert np.allclose(strain(mesh, 1.02 * mesh.vertices[:, 1::-1]).values, 2.0)
    # The triangle's far corner, turned into the plane of the quad about their common edge.
    mesh = mixed()
    flat = np.r_[mesh.vertices[:4, :2], [[1.0 + 2**0.5, 0.0]]]
    assert np.allclose(strain(mesh, 1.02 * flat).values, 2.0)
    assert np.allclose(strain(mesh, 0.97 * flat).values, 3.0)


def test_strain_is_that_of_the_metric():
    mesh = triangles()
    flat = gso.tno.optimize(mesh, task="flatten").flat
    assert np.allclose(
        strain(mesh, flat).values / 100.0, gso.metrics.principal_strains(mesh, flat).values
    )


def test_strain_of_faces_with_a_corner_without_area():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0.0]])
    mesh = gso.Mesh(vertices, [[0, 1, 2, 3]])
    assert np.allclose(strain(mesh, 1.1 * vertices[:, :2]).values, 10.0)
