"""Names of faces, materials and texture coordinates of OBJ files survive what is done to them."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
import trimesh

import gso
from gso import Mesh
from gso.io import left_out
from gso.mesh import Attributes
from tests.conftest import saddle

HEAD = "mtllib ../a b.mtl\nmtllib second.mtl\no Gr\xf6\xdfe #2\n"


def text(n=5):
    """A grid in two groups and three materials, with texture coordinates on most faces."""
    mesh = Mesh.from_grid(saddle(n))
    lines = [HEAD]
    lines += ["v {} {} {}\n".format(*p) for p in mesh.vertices.tolist()]
    lines += [f"vt {k / 7} {k / 9}\n" for k in range(n * n)]
    lines.append("g left\nusemtl steel\ns 1\n")
    for k, face in enumerate((mesh.faces + 1).tolist()):
        if k == 6:
            lines.append("g right wing\nusemtl wood.001 # oak\n")
        if k == 9:
            lines.append("usemtl steel\n")
        words = " ".join(f"{v}" if k == 4 else f"{v}/{v}" for v in face)
        lines.append(f"f {words}\n")
    return "".join(lines)


def said(mesh):
    """Of each face: its names, and the texture coordinates of its corners in order."""
    a = mesh.attributes
    out = []
    for k, face in enumerate(mesh.faces):
        names = {
            key: labels.names[labels.of_face[k]] if labels.of_face[k] >= 0 else None
            for key, labels in a.labels.items()
        }
        rows = [] if a.texture_corners is None else a.texture_corners[k]
        corners = {
            tuple(mesh.vertices[v]): tuple(a.texture[t]) if t >= 0 else None
            for v, t in zip(face, rows, strict=False)
            if v >= 0
        }
        out.append((names, corners))
    return out


@pytest.fixture
def panel(tmp_path):
    path = tmp_path / "panel.obj"
    path.write_bytes(text().encode("latin-1"))
    return path


def test_round_trip(panel, tmp_path):
    mesh = gso.load(panel)
    assert mesh.notes == ()
    assert mesh.attributes.libraries == ("../a b.mtl", "second.mtl")
    assert {k: set(v.names) for k, v in mesh.attributes.labels.items() if k != "o"} == {
        "g": {"left", "right wing"},
        "s": {"1"},
        "usemtl": {"steel", "wood.001"},
    }
    gso.save(mesh, tmp_path / "b.obj")
    back = gso.load(tmp_path / "b.obj")
    assert said(back) == said(mesh)
    assert back.attributes.libraries == mesh.attributes.libraries
    assert np.array_equal(back.faces, mesh.faces)
    assert np.array_equal(back.vertices, mesh.vertices)
    written = (tmp_path / "b.obj").read_bytes()
    assert b"mtllib ../a b.mtl\n" in written
    assert "o Gr\xf6\xdfe".encode("latin-1") in written
    gso.save(back, tmp_path / "c.obj")
    assert (tmp_path / "c.obj").read_bytes() == written


def test_results_have_them(panel, tmp_path):
    for task in ("developable", "flatten", "denoise"):
        result = gso.tno.optimize(panel, task=task)
        result.save(tmp_path / "out.obj")
        names = [n for n, _ in said(gso.load(panel))]
        assert [n for n, _ in said(gso.load(tmp_path / "out.obj"))] == names
        result.save(tmp_path / "out.npz")
        loaded = gso.Result.load(tmp_path / "out.npz")
        assert said(loaded.mesh) == said(result.mesh)
        assert said(gso.load(tmp_path / "out.npz"))[3][0] == names[3]
        assert not any("left out" in note for note in result.notes)


@pytest.mark.parametrize("suffix", [".ply", ".off", ".stl", ".glb", ".npy"])
def test_other_formats_say_what_they_drop(suffix, panel, tmp_path):
    mesh = gso.load(panel)
    words = r"2 groups \(g\).*2 materials \(usemtl\).*\(mtllib\).*\(vt\): left out"
    with pytest.warns(UserWarning, match=words):
        gso.save(mesh, tmp_path / f"a{suffix}")
    result = gso.tno.optimize(mesh)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result.save(tmp_path / f"b{suffix}")
        result.save(tmp_path / f"b{suffix}")
    assert sum("left out" in note for note in result.notes) == 1
    assert left_out(Mesh.from_grid(saddle(3)), f"a{suffix}") == ()


def test_another_program_reads_what_is_written(panel, tmp_path):
    panel.write_text(text().replace("Gr\xf6\xdfe", "part"))
    mesh = gso.load(panel)
    gso.save(mesh, tmp_path / "b.obj")
    body = trimesh.load(tmp_path / "b.obj", force="mesh", process=False, skip_materials=True)
    assert len(body.faces) == 32


def test_reversed_faces_and_cut_polygons_keep_their_corners(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nv 4 .5 0\nv 3 1 0\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 2 0\nvt 2 1\nvt 3 0\nvt 4 .5\nvt 3 1\n"
        "f 1/1 2/2 3/3 4/4\nf -4/-4 -5/-5 2/2/1 3/3\nf 5/5 7/7 8/8 9/9 6/6\n"
    )
    mesh = gso.load(path)
    assert len(mesh.faces) == 5
    for _, corners in said(mesh):
        for place, texture in corners.items():
            assert place[:2] == texture


def test_welding_keeps_them(panel, tmp_path):
    mesh = gso.load(panel)
    apart = mesh.vertices[mesh.faces].reshape(-1, 3)
    heap = Mesh(apart, np.arange(len(apart)).reshape(-1, 4), attributes=mesh.attributes)
    gso.save(heap, tmp_path / "heap.obj")
    assert said(gso.load(tmp_path / "heap.obj", weld=1e-9)) == said(mesh)


def test_quads_that_become_triangles_keep_their_other_corners():
    mesh = Mesh.from_grid(saddle(3))
    points = mesh.vertices.copy()
    points[1] = points[0] + 1e-9
    texture = points[:, :2].copy()
    a = Attributes(texture=texture, texture_corners=mesh.faces)
    done = gso.as_mesh(Mesh(points, mesh.faces, attributes=a), weld=1e-6)
    assert (done.faces[:, 3:] < 0).sum() == 1
    for _, corners in said(done):
        for place, uv in corners.items():
            assert uv == pytest.approx(place[:2], abs=1e-8)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("vt 0.0 0.0", "vt x 0"), "the texture coordinates .vt. were left out: line"),
        (("vt 0.0 0.0", "vt"), "one to three numbers"),
        (("/25", "/99"), "refers to texture coordinates 99, but the file has 25"),
        (("s 1", "s 1\nvn 0 0 1\nl 1 2"), r"left out: 1 normals \(vn\)$"),
        (("s 1", "s 1\nl 1 2"), r"1 polylines \(l\): gso unfold and gso fabricate"),
    ],
)
def test_what_cannot_be_kept_is_said(change, words, tmp_path):
    (tmp_path / "a.obj").write_text(text().replace(*change))
    mesh = gso.load(tmp_path / "a.obj")
    assert mesh.grid_shape == (5, 5)
    assert any(re.search(words, note) for note in mesh.notes)


def test_negative_texture_numbers_count_from_the_line(tmp_path):
    (tmp_path / "a.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .1\nvt .2\nvt .3\nf -3/-3 -2/-2 -1/-1\nvt .4\n"
    )
    mesh = gso.load(tmp_path / "a.obj")
    assert mesh.attributes.texture.ravel().tolist() == [0.1, 0.2, 0.3, 0.4]
    assert mesh.attributes.texture_corners.tolist() == [[0, 1, 2]]
