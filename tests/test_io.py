"""Mesh files: what is written is read back, whole files replace whole files, drawings fit."""

from __future__ import annotations

import io
import stat
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest

import gso.io
from gso import Mesh, MeshError
from gso.mesh import topology

trimesh = pytest.importorskip("trimesh")
EXACT = (".obj", ".ply", ".off", ".npz")
SINGLE = (".stl", ".glb")


def grid_points(height=5, width=7):
    y, x = np.mgrid[:height, :width] / 3
    return np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1)


def shuffled():
    rng = np.random.default_rng(1)
    plain, names = Mesh.from_grid(grid_points()), rng.permutation(35)
    vertices = np.empty((35, 3))
    vertices[names] = plain.vertices
    faces = [np.roll(f, rng.integers(4)) for f in rng.permutation(names[plain.faces])]
    return Mesh(vertices, faces)


def irregular():
    """Three quads round the corner of a cube, and what touches them."""
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]]
    )
    more = np.array([[2, 0, 0], [2, 1, 0]])
    quads = [[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1], [1, 7, 8, 2]]
    return Mesh(np.r_[corners, more] / 7, quads)


def mixed():
    quads = topology.grid_faces(3, 4)
    return Mesh(
        grid_points(3, 4).reshape(-1, 3), [*quads[1:].tolist(), [0, 4, 5, -1], [0, 5, 1, -1]]
    )


def triangles():
    return Mesh(grid_points(3, 4).reshape(-1, 3), Mesh.from_grid(grid_points(3, 4)).triangles)


def parts():
    """Two components, and a vertex of no face at each end and between them."""
    one = Mesh.from_grid(grid_points(3, 3))
    gap = np.array([[5.0, 5, 5]])
    vertices = np.r_[gap, one.vertices, 2 * gap, one.vertices + np.array([0, 0, 3]), 3 * gap]
    return Mesh(vertices, np.r_[one.faces + 1, one.faces + 11])


SHAPES = {
    "grid": lambda: Mesh.from_grid(grid_points()),
    "shuffled": shuffled,
    "irregular": irregular,
    "mixed": mixed,
    "triangles": triangles,
    "parts": parts,
}


@pytest.fixture(params=SHAPES)
def mesh(request):
    return SHAPES[request.param]()


def corner_sets(mesh, kind):
    """Triangles by their corners' coordinates, whatever their numbering."""
    corners = mesh.vertices[mesh.triangles].astype(kind).tolist()
    turns = [min(c[k:] + c[:k] for k in range(3)) for c in corners]
    return sorted(turns)


@pytest.mark.parametrize("suffix", EXACT)
def test_round_trip_is_exact(mesh, suffix, tmp_path):
    gso.save(mesh, tmp_path / f"a{suffix}")
    back = gso.load(tmp_path / f"a{suffix}")
    assert np.array_equal(back.vertices, mesh.vertices)
    assert np.array_equal(back.faces, mesh.faces)
    assert back.grid_shape == mesh.grid_shape


@pytest.mark.parametrize("suffix", SINGLE)
def test_round_trip_in_single_precision(mesh, suffix, tmp_path):
    gso.save(mesh, tmp_path / f"a{suffix}")
    back = gso.load(tmp_path / f"a{suffix}")
    assert back.is_triangles
    assert corner_sets(back, np.float32) == corner_sets(mesh, np.float32)
    assert len(back.boundary_loops) == len(mesh.boundary_loops)


@pytest.mark.parametrize("name", ["grid", "shuffled"])
def test_grids_as_npy_are_written_row_by_row(name, tmp_path):
    mesh = SHAPES[name]()
    gso.save(mesh, tmp_path / "a.npy")
    assert np.array_equal(gso.load(tmp_path / "a.npy").grid, mesh.grid)
    assert np.array_equal(np.load(tmp_path / "a.npy", allow_pickle=False), mesh.grid)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off", ".stl", ".glb"])
def test_another_program_reads_what_is_written(suffix, tmp_path):
    mesh = irregular()
    gso.save(mesh, tmp_path / f"a{suffix}")
    body = trimesh.load(tmp_path / f"a{suffix}", force="mesh")
    assert len(body.faces) == 8 and len(body.vertices) == 9
    assert np.allclose(body.bounds, [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])


def test_extreme_numbers_round_trip(tmp_path):
    points = grid_points(3, 3) * 1e-9 + [1e5, -1 / 3, np.nextafter(0.1, 1)]
    for suffix in EXACT:
        gso.save(points, tmp_path / f"a{suffix}")
        assert np.array_equal(gso.load(tmp_path / f"a{suffix}").grid, points)


def test_only_grids_fit_npy(tmp_path):
    with pytest.raises(MeshError, match=r"a\.npy: the mesh is no grid"):
        gso.save(irregular(), tmp_path / "a.npy")
    assert list(tmp_path.iterdir()) == []


def test_obj_as_other_programs_write_it(tmp_path):
    path = tmp_path / "a.OBJ"
    path.write_bytes(
        b"\xef\xbb\xbf# Gr\xf6\xdfe\r\nmtllib x.mtl\r\no part\r\ng a b\r\n"
        b"v 0 0 0 0.5 0.5 0.5\r\nv 1 0 0 1 0 0\r\nv  1\t1 0\r\nv 0 2 0 2 # weight\r\n"
        b"vt 0 0\r\nvn 0 0 1\r\nusemtl m\r\ns off\r\nf 1/1/1 2//1 3/1 \\\r\n -1\r\n"
        b"v 2e0 0 .0\r\nv +2 1 0\r\nf -2 -1 3\r\nf -2 3 2 # triangle\r\nl 1 2\r\n"
        b"v 0 2 0\r\nv 1 3 0\r\nv 2 2 0\r\nf 4 3 6 9 8 7"
    )
    mesh = gso.load(path)
    assert mesh.vertices[:6].tolist() == [
        [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0],
    ]  # fmt: skip
    assert mesh.faces.tolist() == [
        [0, 1, 2, 3], [4, 5, 2, -1], [4, 2, 1, -1],
        [2, 5, 8, -1], [2, 8, 7, -1], [2, 7, 6, -1], [2, 6, 3, -1],
    ]  # fmt: skip
    assert mesh.notes == (
        "1 polygons with more than four corners were cut into triangles (the first is face 3)",
        "left out: 1 normals (vn), colours of vertices",
        "1 polylines (l): gso unfold and gso fabricate cut along them",
    )
    said = mesh.attributes
    assert said.libraries == ("x.mtl",)
    assert {k: v.names for k, v in said.labels.items()} == {
        "o": ("part",), "g": ("a b",), "s": ("off",), "usemtl": ("m",),
    }  # fmt: skip
    assert said.texture_corners.tolist() == [[0, -1, 0, -1], *[[-1] * 4] * 6]


def test_obj_with_old_line_ends(tmp_path):
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r")
    assert gso.load(tmp_path / "a.obj").faces.tolist() == [[0, 1, 2]]


def ply(form, *, mix=True):
    """A square and a triangle on it, with colours, flags and another element between."""
    order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    head = [
        "ply", f"format {form} 1.0", "comment made for a test", "element vertex 5",
        "property uchar red", "property float z", "property double y", "property float x",
        "element other 2", "property list ushort short things",
        f"element face {2 if mix else 1}", "property char flag",
        "property list uchar uint vertex_index", "property float quality", "end_header", "",
    ]  # fmt: skip
    vertices = [(9, 0.0, y, x) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (0.5, 2))]
    faces = [(1, [0, 1, 2, 3], 0.5), (2, [3, 2, 4], 0.25)][: 2 if mix else 1]
    if order is None:
        rows = [*vertices, (2, 7, 8), (1, 9), *((a, len(f), *f, q) for a, f, q in faces)]
        return "\n".join([*head[:-1], *(" ".join(map(str, r)) for r in rows)]).encode()
    body = b"".join(
        np.array(
            v, [("r", "u1"), ("z", f"{order}f4"), ("y", f"{order}f8"), ("x", f"{order}f4")]
        ).tobytes()
        for v in vertices
    )
    for row in ([7, 8], [9]):
        body += np.array([len(row), *row], f"{order}u2").tobytes()
    for flag, face, quality in faces:
        body += bytes([flag, len(face)]) + np.array(face, f"{order}u4").tobytes()
        body += np.array(quality, f"{order}f4").tobytes()
    return "\n".join(head).encode() + body


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("mix", [True, False])
def test_ply_as_other_programs_write_it(form, mix, tmp_path):
    (tmp_path / "a.ply").write_bytes(ply(form, mix=mix))
    mesh = gso.load(tmp_path / "a.ply")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]
    assert mesh.faces.tolist() == ([[0, 1, 2, 3], [3, 2, 4, -1]] if mix else [[0, 1, 2, 3]])


@pytest.mark.parametrize("head", ["OFF\n# comment\n4 2 0", "OFF 4 2 5", "COFF\n4 2 0"])
def test_off_as_other_programs_write_it(head, tmp_path):
    vertices = "0 0 0 9 9 9 9\n1 0 0 9 9 9 9\n\n1 1 0 9 9 9 9\n0 1 0 9 9 9 9"
    text = f"{head}\n{vertices}\n3 0 1 2 255 0 0\n3 0 2 3\n"
    (tmp_path / "a.off").write_text(text)
    assert gso.load(tmp_path / "a.off").faces.tolist() == [[0, 1, 2], [0, 2, 3]]


SQUARE_POINTS = ["0", "0", "0", "1", "0", "0", "1", "1", "0", "0", "1", "0"]


@pytest.mark.parametrize(
    "text",
    [
        "OFF4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3",
        "OFF\n4\n2\n0\n" + "\n".join(SQUARE_POINTS) + "\n3\n0\n1\n2\n3\n0 2\n3",
        "OFF 4 2 5 " + " ".join(SQUARE_POINTS) + " 3 0 1 2 3 0 2 3",
        "OFF 4 2 5 " + " ".join(SQUARE_POINTS) + " 3 0 1 2 255 0 0 3 0 2 3 0 0 255",
        "OFF # all\n4 2 5 # counts\n0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2 0.5 0 0 1\n3 0 2 3 1 1 1 1",
        "COFF 4 2 5 0 0 0 9 9 9 9 1 0 0 9 9 9 9 1 1 0 9 9 9 9 0 1 0 9 9 9 9 3 0 1 2 3 0 2 3",
        "COFF 4 2 5 0 0 0 9 9 9 1 0 0 9 9 9\n1 1 0 9 9 9 0 1 0 9 9 9 3 0 1\n2 3 0 2 3",
        "NOFF 4 2 5\n0 0 0 0 0 1 1 0 0 0 0 1\n1 1 0 0 0 1 0 1 0 0 0 1\n3 0 1 2 7\n3 0 2 3 8\n",
        "off\r\n4 2\r\n0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0\r\n3 0 1 2\r\n3 0 2 3\r\n",
        "OFF\n4 2 5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0\n1 2 0.1 0.2 0.3\n3 0 2 3 0.5\n",
    ],
)
def test_off_is_read_by_numbers_whatever_its_lines(text, tmp_path):
    (tmp_path / "a.off").write_text(text)
    mesh = gso.load(tmp_path / "a.off")
    assert mesh.vertices.ravel().tolist() == [float(x) for x in SQUARE_POINTS]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("seed", range(5))
def test_off_with_random_line_breaks_is_the_same_mesh(seed, tmp_path):
    mesh = mixed()
    gso.save(mesh, tmp_path / "a.off")
    words = (tmp_path / "a.off").read_text().split()
    breaks = np.random.default_rng(seed).choice([" ", "\n", " # x 1\n", "\n\n"], len(words))
    breaks[:3] = " "
    (tmp_path / "b.off").write_text("".join(w + b for w, b in zip(words, breaks, strict=True)))
    back = gso.load(tmp_path / "b.off")
    assert np.array_equal(back.vertices, mesh.vertices)
    assert np.array_equal(back.faces, mesh.faces)


def test_stl_text_is_welded_and_collapsed_triangles_left_out(tmp_path):
    facet = "facet normal 0 0 1\n outer loop\n{} endloop\nendfacet\n"
    corners = ["000", "100", "110"], ["000", "110", "010"], ["000", "000", "010"]
    rows = ["".join(f"  vertex {' '.join(c)}\n" for c in t) for t in corners]
    (tmp_path / "a.stl").write_text(
        "solid a b\n" + "".join(map(facet.format, rows)) + "endsolid a b"
    )
    mesh = gso.load(tmp_path / "a.stl")
    assert len(mesh.vertices) == 4 and len(mesh.faces) == 2
    assert mesh.notes == ("1 triangles with two equal corners were left out",)


def test_glb_scenes_are_merged_where_their_nodes_put_them(tmp_path):
    scene = trimesh.Scene()
    for shift, mirror in ((0, 1), (5, -1)):
        part = trimesh.Trimesh(triangles().vertices, triangles().faces, process=False)
        matrix = np.diag([1.0, 1.0, mirror, 1.0])
        matrix[0, 3] = shift
        scene.add_geometry(part, transform=matrix)
    # One vertex per corner, as programs write flat shading.
    split = trimesh.Trimesh(triangles().vertices, triangles().faces, process=False)
    split.unmerge_vertices()
    scene.add_geometry(split, transform=trimesh.transformations.translation_matrix([0, 9, 0]))
    (tmp_path / "a.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene))
    mesh = gso.load(tmp_path / "a.glb")
    assert len(mesh.vertices) == 3 * 12
    assert mesh.notes == ("the mesh has 3 components; each is treated on its own",)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert (low < 1).all() and high[0] == pytest.approx(6) and high[1] == pytest.approx(9 + 2 / 3)
    assert low[2] < 0 < high[2]


def test_npz_by_other_names(tmp_path):
    mesh = irregular()
    np.savez_compressed(tmp_path / "a.npz", V=mesh.vertices, F=mesh.faces, extra=[1])
    assert np.array_equal(gso.load(tmp_path / "a.npz").faces, mesh.faces)
    np.savez(tmp_path / "a.npz", surface=np.asfortranarray(grid_points()).astype(">f4"))
    assert np.array_equal(gso.load(tmp_path / "a.npz").grid, grid_points().astype("f4"))


def test_as_mesh_takes_what_users_have(tmp_path):
    mesh = Mesh.from_grid(grid_points())
    gso.save(mesh, tmp_path / "a.obj")
    assert gso.as_mesh(mesh) is mesh
    same = [
        grid_points(), grid_points().tolist(), (mesh.vertices, mesh.faces),
        [mesh.vertices.tolist(), mesh.faces.tolist()], tmp_path / "a.obj", str(tmp_path / "a.obj"),
    ]  # fmt: skip
    for x in same:
        assert np.array_equal(gso.as_mesh(x).grid, mesh.grid)
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert np.array_equal(gso.as_mesh(body).faces, mesh.triangles)


def test_importing_and_using_arrays_loads_neither_trimesh_nor_scipy():
    code = (
        "import sys, gso.io\n"
        "slow = [m for m in ('trimesh', 'scipy', 'casadi') if m in sys.modules]\n"
        "gso.as_mesh([[[i, j, 0] for j in range(3)] for i in range(3)])\n"
        "sys.exit(repr(slow) if slow or 'trimesh' in sys.modules else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@pytest.mark.parametrize(
    "error", [RuntimeError, KeyboardInterrupt, MeshError, OSError(28, "disk full")]
)
@pytest.mark.parametrize("there", [True, False])
def test_a_failed_write_leaves_what_was_there(error, there, tmp_path, monkeypatch):
    path = tmp_path / "a.obj"
    if there:
        path.write_text("precious")

    def write(mesh, file):
        file.write(b"half of it")
        raise error

    monkeypatch.setitem(gso.io._FORMATS, ".obj", (gso.io.obj.read, write))
    expected = MeshError if isinstance(error, OSError) else error
    with pytest.raises(expected, match="disk full" if expected is not error else None):
        gso.save(irregular(), path)
    assert [p.name for p in tmp_path.iterdir()] == (["a.obj"] if there else [])
    assert not there or path.read_text() == "precious"


def test_replacing_keeps_permissions_and_links(tmp_path):
    path, link = tmp_path / "a.obj", tmp_path / "link.obj"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    gso.save(irregular(), link)
    assert link.is_symlink() and gso.load(path).faces.shape == (4, 4)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    fresh, plain = tmp_path / "b.obj", tmp_path / "plain"
    gso.save(irregular(), fresh)
    plain.write_text("")
    assert fresh.stat().st_mode == plain.stat().st_mode


def drawing(path):
    """Size, viewBox, and the closed outlines of a drawing in its own coordinates."""
    root = ElementTree.parse(path).getroot()
    svg = "{http://www.w3.org/2000/svg}"
    layers = {g.get("id"): [p.get("d") for p in g.iter(f"{svg}path")] for g in root.iter(f"{svg}g")}
    outline = []
    for d in layers["outline"]:
        assert d[0] == "M" and d[-1] == "Z"
        outline.append(np.array([p.split() for p in d[1:-1].split("L")], float))
    return root, layers, outline


def area(p):
    x, y = p.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1), ("cm", 10), ("m", 1000), ("in", 25.4)])
def test_flat_patterns_are_drawn_at_full_size_and_not_mirrored(unit, factor, tmp_path):
    y, x = np.mgrid[:6, :8] * 1.0
    faces = np.delete(topology.grid_faces(6, 8)[:, ::-1], [10, 12], axis=0)
    mesh = Mesh(np.stack([x, y, np.sin(x)], axis=-1).reshape(-1, 3), faces)
    flat = np.c_[2 * x.ravel() - 50, y.ravel() + 1e3]
    gso.io.save_flat(flat, mesh, tmp_path / "a.svg", unit=unit, mesh_lines=True)
    root, layers, outline = drawing(tmp_path / "a.svg")
    width, height = (float(root.get(k).removesuffix("mm")) for k in ("width", "height"))
    assert [float(v) for v in root.get("viewBox").split()] == [0, 0, width, height]
    every = np.concatenate(outline)
    assert np.ptp(every, axis=0) == pytest.approx([14 * factor, 5 * factor])
    assert (every > 0).all() and (every < [width, height]).all()
    assert np.array([width, height]) == pytest.approx(np.ptp(every, axis=0), rel=0.15)
    # Upwards on paper is downwards in SVG: anticlockwise stays anticlockwise.
    areas = [area(p * [1, -1]) for p in outline]
    assert areas == pytest.approx([70 * factor**2, -2 * factor**2, -2 * factor**2])
    rim = np.isin(np.arange(48), mesh.boundary_loops[0])
    assert len(outline[0]) == rim.sum() == 24
    assert layers["mesh"][0].count("M") == len(mesh.edges) - 24 - 8
    gso.io.save_flat(flat, mesh, tmp_path / "a.svg")
    assert list(drawing(tmp_path / "a.svg")[1]) == ["outline"]


@pytest.mark.parametrize("suffix", [*EXACT, ".npy"])
def test_flat_results_are_meshes_at_z_zero(suffix, tmp_path):
    mesh = Mesh.from_grid(grid_points())
    flat = mesh.replaced(mesh.vertices * [1, 1, 0])
    gso.save(flat, tmp_path / f"flat{suffix}")
    assert np.array_equal(gso.load(tmp_path / f"flat{suffix}").grid, flat.grid)


def test_replacing_writes_any_bytes(tmp_path):
    with gso.io.replacing(tmp_path / "a.bin") as file:
        assert isinstance(file, io.BufferedWriter)
        file.write(b"x" * 9)
    assert (tmp_path / "a.bin").read_bytes() == b"x" * 9


@pytest.mark.parametrize("first", range(8))
@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
def test_concave_polygons_are_cut_inside_whatever_the_first_corner(tmp_path, first, suffix):
    # A C of width 60 and height 80, cut out by 40 x 40, on a plane that rises by 3 in 10.
    outline = [(20, 20), (20, 60), (60, 60), (60, 80), (0, 80), (0, 0), (60, 0), (60, 20)]
    ring = np.roll(np.array([(x, y, 0.3 * x) for x, y in outline]), first, axis=0)
    rows = "\n".join(" ".join(map(str, row)) for row in ring)
    numbers = " ".join(map(str, range(8)))
    path = tmp_path / f"c.{suffix}"
    path.write_text(
        {
            "obj": "v " + rows.replace("\n", "\nv ") + "\nf 1 2 3 4 5 6 7 8\n",
            "off": f"OFF\n8 1 0\n{rows}\n8 {numbers}\n",
            "ply": "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
            "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            f"{rows}\n8 {numbers}\n",
        }[suffix]
    )
    mesh = gso.load(path)
    corners = mesh.vertices[mesh.faces]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(mesh.faces) == 6
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(3200 * np.hypot(1, 0.3), rel=1e-9)
    assert "cut into triangles" in mesh.notes[0]


def test_repeated_vertices_of_faces_are_left_out_with_a_note(tmp_path):
    path = tmp_path / "twice.obj"
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    path.write_text(square + "f 1 1 2 3\nf 1 3 3\nf 3 4 4 4 1\n")
    mesh = gso.load(path)
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert any("3 faces repeat a vertex" in note for note in mesh.notes)
    assert any("1 faces have fewer than three" in note and "face 1" in note for note in mesh.notes)


def _arrow(first, inner=(10.0, 10.0)):
    """Return a quad with an inner corner, listed from a corner on: its area is 400 by default."""
    return np.roll([(0.0, 0, 0), (40, 0, 0), (*inner, 0), (0, 40, 0)], -first, axis=0)


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("inner", [(10.0, 10.0), (5.0, 12.0), (20.0, 20.0)])
def test_concave_quads_are_cut_through_their_inner_corner(first, inner):
    # The shoelace formula of the corners (0, 0), (40, 0), inner, (0, 40).
    right = 20.0 * (inner[0] + inner[1])
    points = _arrow(first, inner)
    mesh = gso.io.as_mesh((points, [[0, 1, 2, 3]]))
    assert mesh.faces.shape == (2, 3)
    assert gso.metrics.area(mesh) == pytest.approx(right, rel=1e-12)
    assert "1 quads are not convex" in mesh.notes[0] and "face 0" in mesh.notes[0]
    # A mesh made without a reader keeps its face, and its triangles are the right ones.
    corners = points[Mesh(points, [[0, 1, 2, 3]]).triangles]
    areas = np.linalg.norm(np.cross(*(corners[:, k] - corners[:, 0] for k in (1, 2))), axis=1) / 2
    assert areas.sum() == pytest.approx(right, rel=1e-12) and areas.min() > 1.0


def test_a_concave_quad_among_others_keeps_the_names_of_its_faces(tmp_path):
    path = tmp_path / "hat.obj"
    points = [(0, 0, 0), (40, 0, 0), (10, 10, 0), (0, 40, 0), (40, 40, 0), (0, 0, 20), (40, 0, 20)]
    path.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in points)
        + "g wall\nf 1 6 7 2\ng floor\nf 2 3 4 1\ng wedge\nf 4 3 2 5\n"
    )
    mesh = gso.load(path)
    said = mesh.attributes.labels["g"]
    by_name = dict.fromkeys(said.names, 0.0)
    for face, k in zip(mesh.faces, said.of_face, strict=True):
        x, y = mesh.vertices[face[face >= 0]][:, [0, 1 if said.names[k] != "wall" else 2]].T
        by_name[said.names[k]] += abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
    assert by_name == {"wall": 800.0, "floor": 400.0, "wedge": 1200.0}


def test_errors_name_the_face_of_the_file(tmp_path):
    path = tmp_path / "flat.obj"
    ring = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    points = [*np.c_[np.cos(ring), np.sin(ring), 0 * ring], (2, 2, 0), (3, 3, 0), (4, 4, 0)]
    rows = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    path.write_text(rows + "f 1 2 3 4 5 6\nf 7 8 9\n")
    with pytest.raises(MeshError, match=r"face 1 = \[6, 7, 8\] has no area"):
        gso.load(path)
