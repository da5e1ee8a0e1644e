"""Bad meshes and bad files: each is refused with a message that names the place."""

from __future__ import annotations

import io
import json
import os
import warnings
import zipfile

import numpy as np
import pytest

import gso.io
from gso import Mesh, MeshError
from gso.mesh import topology

NAN = float("nan")
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
TEXT = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"


@pytest.fixture(autouse=True)
def no_warnings():
    """A refusal is an error and no warning of NumPy besides."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def grid_points(height=4, width=5):
    y, x = np.mgrid[:height, :width] / 3
    return np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1)


def changed(index, value):
    out = np.array(SQUARE, float)
    out[index] = value
    return out


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (changed((2, 1), NAN), [[0, 1, 2, 3]], r"coordinates of vertex 2 are not finite \(1 such"),
        (changed((1, 0), np.inf), [[0, 1, 2, 3]], "vertex 1 are not finite"),
        (SQUARE, [[0, 1, 2, 4]], r"face 0 = \[0, 1, 2, 4\] points outside the 4 vertices"),
        (SQUARE, [[0, 1, 2], [0, 2, -2]], "face 1 .* points outside"),
        (SQUARE, [[0, -1, 2, 3]], "face 0 .* points outside"),
        (SQUARE, [[0, 1, 2, 2**40]], "face 0 .* points outside"),
        (np.empty((0, 3)), [[0, 1, 2]], "points outside the 0 vertices"),
        (SQUARE, [[0, 1, 1, 3]], r"face 0 = \[0, 1, 1, 3\] repeats a vertex"),
        (SQUARE, [[0, 1, 2, 0]], "repeats a vertex"),
        (SQUARE, [[0, 1, 2], [2, 0, 1]], "face 0 .* is there 2 times; delete the duplicates"),
        (SQUARE, [[0, 1, 2, 3], [3, 2, 1, 0]], "is there 2 times"),
        (changed(slice(None), 1.0), [[0, 1, 2, 3]], "all its vertices are one point"),
        (changed((slice(None), 1), 0.0), [[0, 1, 2, 3]], "face 0 .* has no area"),
        (np.c_[np.arange(4), np.arange(4), np.zeros(4)], [[0, 1, 2], [1, 3, 2]], "has no area"),
        (SQUARE, [[0, 2, 1, 3]], "has no area"),
        (changed(0, 1e200), [[0, 1, 2, 3]], "its unit of length needs changing"),
        (np.multiply(SQUARE, 1e-150), [[0, 1, 2, 3]], "its unit of length needs changing"),
        (SQUARE, [], r"faces must be integers in an array"),
        (SQUARE, np.empty((0, 4), int), "the mesh has no faces"),
        (SQUARE, [[0, 1, 2, 3], [0, 1]], r"pad triangles with -1"),
        (SQUARE, [[0, 1, 2.5, 3]], "face 0 has an index that is no integer"),
        (SQUARE, [[0, 1, NAN, 3]], "face 0 has an index that is no integer"),
        (SQUARE, [["a", "b", "c"]], "faces must be integers"),
        (SQUARE, [[0, 1, 2, 3, 0]], r"not \(1, 5\)"),
        (SQUARE, None, "faces must be integers"),
        (
            [[0, 0], [1, 0], [1, 1]],
            [[0, 1, 2]],
            r"vertices must be an array \(n, 3\), not \(3, 2\)",
        ),
        ([[0, 0, 0], [1, 0]], [[0, 1, 2]], "vertices must be numbers"),
        ([["x", 0, 0]], [[0, 1, 2]], "vertices must be numbers"),
        ([[10**400, 0, 0]], [[0, 1, 2]], "vertices must be numbers"),
        (np.multiply(SQUARE, 1j), [[0, 1, 2, 3]], "complex"),
        (None, [[0, 1, 2]], "vertices must be an array"),
    ],
)
def test_bad_arrays(vertices, faces, message):
    with pytest.raises(MeshError, match=message):
        Mesh(vertices, faces)


def test_edges_with_three_faces():
    vertices = [*SQUARE, [0.5, 0, 1]]
    faces = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    with pytest.raises(MeshError, match=r"edge 1-0 belongs to 3 faces \(0, 1, 2\).*delete"):
        Mesh(vertices, faces)


def test_a_moebius_strip():
    turn = np.linspace(0, 2 * np.pi, 9)[:-1]
    across = np.array([-0.3, 0.3])[:, None]
    r = 1 + across * np.cos(turn / 2)
    strip = np.stack([r * np.cos(turn), r * np.sin(turn), across * np.sin(turn / 2)], axis=-1)
    faces = np.r_[topology.grid_faces(2, 8), [[7, 15, 0, 8]]]
    with pytest.raises(MeshError, match=r"one-sided.*Moebius.*at edge .* cut it open"):
        Mesh(strip.reshape(-1, 3), faces)


@pytest.mark.parametrize("closed", [False, True])
def test_vertices_in_which_parts_merely_touch(closed):
    if closed:
        corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
        vertices, faces = np.r_[corners, -corners[1:]], np.r_[faces, np.where(faces, faces + 3, 0)]
    else:
        vertices = np.array([*SQUARE, [2, 1, 0], [2, 2, 0], [1, 2, 0]])
        faces = [[0, 1, 2, 3], [2, 4, 5, 6]]
    with pytest.raises(MeshError, match=r"vertex [02] joins 2 parts .* own copy of the vertex"):
        Mesh(vertices, faces)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((2, 2, 3)), "a grid of 2 x 2 points has no interior vertex; give at least 3 x 3"),
        (np.zeros((2, 9, 3)), "2 x 9"),
        (np.zeros((9, 2, 3)), "9 x 2"),
        (np.zeros((4, 4, 2)), r"array \(H, W, 3\), not \(4, 4, 2\)"),
        (np.zeros((4, 3)), r"not \(4, 3\)"),
        (np.zeros((4, 4, 3)), "one point"),
        ([[[0, 0, 0]], [[0, 0]]], "array of numbers"),
        (np.where(np.arange(60).reshape(4, 5, 3) == 22, NAN, grid_points()), r"vertex \(1, 2\)"),
    ],
)
def test_bad_grids(points, message):
    with pytest.raises(MeshError, match=message):
        Mesh.from_grid(points)


@pytest.mark.parametrize(
    "x",
    [None, 3, "", "nothing.obj", np.zeros((4, 3)), np.zeros((4, 4, 2)), {"a": 1}, [1], object()],
)
def test_what_is_no_surface(x):
    with pytest.raises(MeshError, match=r"no surface|cannot read|no such file"):
        gso.as_mesh(x)


def test_a_trimesh_scene_is_no_mesh():
    trimesh = pytest.importorskip("trimesh")
    with pytest.raises(MeshError, match="to_mesh"):
        gso.as_mesh(trimesh.Scene())


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
)
OFF = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
)


def binary_ply(vertices=4, faces=1):
    head = PLY[: PLY.index("0 0 0")].replace("ascii", "binary_little_endian")
    head = head.replace("vertex 4", f"vertex {vertices}").replace("face 1", f"face {faces}")
    return (
        head.encode()
        + np.array(SQUARE, "<f4").tobytes()
        + b"\4"
        + np.arange(4, dtype="<i4").tobytes()
    )


def binary_stl(count=1, body=50):
    return bytes(80) + count.to_bytes(4, "little") + np.arange(body, dtype="u1").tobytes()


def npy(array, **claim):
    stream = io.BytesIO()
    head = {"descr": array.dtype.str, "fortran_order": False, "shape": array.shape, **claim}
    np.lib.format.write_array_header_1_0(stream, head)
    return stream.getvalue() + array.tobytes()


def npz(name, data):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, data)
    return stream.getvalue()


def pickled():
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array([print], object), allow_pickle=True)
    return stream.getvalue()


def glb(header, *, length=None, version=2):
    text = json.dumps(header).encode()
    head = (
        b"glTF" + version.to_bytes(4, "little") + (length or 20 + len(text)).to_bytes(4, "little")
    )
    return head + len(text).to_bytes(4, "little") + b"JSON" + text


FILES = [
    ("a.obj", "", "the file is empty"),
    ("a.obj", " \n\n", "the file is empty"),
    ("a.obj", "hello", "there is no vertex .* is it an OBJ file"),
    ("a.obj", "# v 0 0 0", "there is no vertex"),
    ("a.obj", "v 0 0 0\nv 1 0 0\n", "there is no face"),
    ("a.obj", TEXT[:24] + "v 0 1\nf 1 2 3 4\n", "line 4: a vertex needs three numbers, not 2"),
    ("a.obj", TEXT.replace("1 1 0", "1 1e 0"), "line 3: '1e' is not a finite number"),
    ("a.obj", TEXT.replace("1 1 0", "1 1,5 0"), "line 3: '1,5' is not a finite number"),
    ("a.obj", TEXT.replace("1 1 0", "1 1_0 0"), "line 3: '1_0' is not a finite number"),
    ("a.obj", TEXT.replace("1 1 0", "nan 1 0"), "line 3: 'nan' is not a finite number"),
    ("a.obj", TEXT.replace("1 1 0", "1 1 0 0"), "line 3: a vertex has the weight 0"),
    ("a.obj", TEXT.replace("1 1 0", "1 1e999 0"), "line 3: '1e999' is not"),
    (
        "a.obj",
        TEXT.replace("2 3 4", "2 9 4"),
        "line 5: a face refers to vertex 9, .* has 4 vertices",
    ),
    ("a.obj", TEXT.replace("2 3 4", "2 0 4"), "line 5: .* vertex 0, but vertices count from 1"),
    ("a.obj", TEXT.replace("2 3 4", "2 -5 4"), "line 5: .* vertex -5"),
    ("a.obj", TEXT.replace("2 3 4", "2 3 " + "9" * 40), "line 5: '9{24}'... is not a whole number"),
    ("a.obj", TEXT.replace("2 3 4", "2 3 99999999999999999"), "line 5: a face refers to vertex 9"),
    ("a.obj", TEXT.replace("2 3 4", "2 /3 4"), "line 5: '/3' is not a whole number"),
    ("a.obj", TEXT.replace("2 3 4", "2 3.0 4"), "line 5: '3.0' is not a whole number"),
    ("a.obj", TEXT + "f 1 2\n", "line 6: a face needs three corners or more, not 2"),
    ("a.obj", TEXT.replace("1 2 3 4", "1 \\\n2 \\\n9"), "line 7: a face refers to vertex 9"),
    ("a.obj", TEXT + TEXT[-10:], "face 0 .* is there 2 times"),
    ("a.obj", bytes(range(256)), "no text"),
    ("a.obj", b"v \xff\xfe 0 0\nf 1 2 3", r"line 1: '.*xff.*' is not a finite number"),
    ("a.obj", TEXT.encode("utf-16"), "no text"),
    ("a.ply", "hello", "starts with the line 'ply'"),
    ("a.ply", PLY[:60], "does not end with 'end_header'"),
    ("a.ply", PLY.replace("ascii", "cuneiform"), "line 2: 'format cuneiform 1.0' has no meaning"),
    ("a.ply", PLY.replace("float y", "quaternion y"), "line 5: .* has no meaning in a PLY header"),
    ("a.ply", PLY.replace("vertex 4", "vertex -4"), "line 3"),
    ("a.ply", PLY.replace("format ascii 1.0", "comment"), "no line 'format"),
    ("a.ply", PLY.replace("float z", "float w"), "element 'vertex' .* has no 'z'"),
    ("a.ply", PLY.replace("vertex_indices", "corners"), "element 'face' .* has no 'vertex_ind"),
    ("a.ply", PLY.replace("element face 1", "element edge 1"), "no face"),
    ("a.ply", PLY.replace("vertex 4", "vertex 999999999999"), "announces 999999999999 of 'vertex'"),
    ("a.ply", PLY[:-10], "announces 1 of 'face', but the file ends before"),
    ("a.ply", PLY.replace("1 1 0", "1 1"), "line 12: a vertex has 2 numbers instead of 3"),
    ("a.ply", PLY.replace("1 1 0", "1 nan 0"), "line 12: 'nan'"),
    ("a.ply", PLY.replace("4 0 1", "7 0 1"), "line 14: a face has fewer numbers"),
    (
        "a.ply",
        PLY.replace("4 0 1 2 3", "4 0 1 2 9"),
        "face 0 refers to vertex 9, the last one is 3",
    ),
    ("a.ply", PLY.replace("4 0 1 2 3", "2 0 1"), "face 0 has 2 corners"),
    ("a.ply", binary_ply(vertices=10**12), "announces 1000000000000 of 'vertex'"),
    ("a.ply", binary_ply(faces=4 * 10**9), "announces 4000000000 of 'face'"),
    ("a.ply", binary_ply(faces=2), "announces 2 of 'face'"),
    ("a.ply", binary_ply()[:-1], "announces 1 of 'face'"),
    ("a.ply", binary_ply().replace(b"uchar int", b"uchar float"), "no whole numbers"),
    ("a.ply", binary_ply().replace(b"\0\0\x80\x3f", b"\0\0\xc0\x7f"), "vertex 1 are not finite"),
    ("a.off", "4 1 0\n", "line 1: an OFF file in three dimensions starts with OFF, not '4'"),
    ("a.off", "4OFF\n", "starts with OFF"),
    ("a.off", "OFF\n", "numbers of vertices and faces are missing"),
    ("a.off", "# nothing", "nothing but comments"),
    (
        "a.off",
        OFF[:-10],
        "line 2: 4 vertices and 1 faces are announced, .* ends before face 0",
    ),
    ("a.off", OFF.replace("4 1 0", "4 999999999999 0"), "line 2: .* cut off"),
    ("a.off", OFF.replace("1 1 0\n", "1 1\n"), "line 5: a vertex needs three numbers"),
    ("a.off", OFF.replace("4 0 1 2 3", "4 0 1 2 4"), "line 7: a face refers to vertex 4, the last"),
    ("a.off", OFF.replace("4 0 1 2 3", "5 0 1 2 3"), "line 7: a face with 5 corners"),
    ("a.off", OFF.replace("4 0 1 2 3", "2 0 1"), "line 7: a face with 2 corners"),
    ("a.stl", "solid a\n" + FACET, "no 'endsolid'; it is cut off"),
    ("a.stl", "solid a\n" + FACET + FACET[:50] + "endsolid", "it is cut off"),
    ("a.stl", "solid a\n" + FACET.replace("1 0 0", "1 0") + "endsolid", "line 5: a vertex needs"),
    ("a.stl", "solid a\n" + FACET.replace("1 0 0", "1 x 0") + "endsolid", "line 5: 'x' is not"),
    ("a.stl", "solid a\nendsolid", "no triangles"),
    ("a.stl", "garbage", "shorter than its header"),
    ("a.stl", binary_stl(2), "announces 2 triangles, but the file has room for 1"),
    ("a.stl", binary_stl(2**32 - 1), "announces 4294967295 triangles"),
    ("a.stl", binary_stl(0, 0), "no triangles"),
    ("a.stl", binary_stl(1, 34), "room for 0"),
    ("a.glb", "hello", "does not start with 'glTF'"),
    ("a.glb", glb({}, version=1), "glTF 1; export it as glTF 2.0"),
    ("a.glb", glb({}, length=10**9), "cut off"),
    ("a.glb", b"glTF" + b"\2\0\0\0", "cut off"),
    ("a.glb", glb({})[:20] + b"{]", "damaged"),
    ("a.glb", glb([1]), "damaged"),
    ("a.glb", glb({"scenes": [{"nodes": []}]}), "no triangles"),
    ("a.glb", glb({"buffers": [{"uri": "secret.bin", "byteLength": 1}]}), "other files"),
    ("a.glb", glb({"accessors": [{"count": 10**12, "type": "VEC3"}]}), "compressed"),
    (
        "a.glb",
        glb({"meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}),
        "no intact GLB",
    ),
    ("a.npy", "hello", "no intact array"),
    ("a.npy", npy(np.zeros((3, 3, 3)), shape=(10**6, 10**6, 3)), "claims an array"),
    ("a.npy", npy(np.zeros((3, 3, 3)), shape=(-1, 3, 3)), "claims an array|no intact array"),
    ("a.npy", npy(grid_points())[:-9], "the file is cut off"),
    ("a.npy", npy(np.zeros(4, "U3")), "no plain numbers"),
    ("a.npy", npy(np.zeros((4, 3))), r"a grid is an array \(H, W, 3\), not \(4, 3\)"),
    ("a.npy", npy(grid_points(2, 2)), "2 x 2"),
    ("a.npy", pickled(), "the array holds object"),
    ("a.npz", "hello", "no intact .npz"),
    ("a.npz", npz("x.npy", npy(grid_points()))[:-30], "no intact .npz"),
    ("a.npz", npz("x.npy", npy(np.zeros(3), shape=(10**12,))), "claims an array"),
    ("a.npz", npz("x.npy", pickled()), "the array holds object"),
    ("a.npz", npz("readme.txt", b"hello"), "this one has nothing"),
    ("a.npz", npz("vertices.npy", npy(np.zeros((4, 3)))), r"not \(4, 3\)"),
    ("a.txt", TEXT, r"cannot read a '.txt' file; use .obj, .ply, .off, .stl, .glb, .npy, .npz"),
    ("a", TEXT, "cannot read a file without a suffix"),
]


@pytest.mark.parametrize(("name", "content", "message"), FILES)
def test_bad_files(name, content, message, tmp_path):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(MeshError, match=message) as caught:
        gso.load(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_files_that_are_not_there(tmp_path):
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "folder").mkdir()
    for name, message in (
        ("none.obj", "no such file; check the name"),
        ("folder.obj", "is a folder"),
        ("folder", "is a folder"),
        ("none/a.obj", "no such file"),
        ("a\0.obj", "cannot be read"),
        ("a" * 300 + ".obj", "cannot be read"),
    ):
        with pytest.raises(MeshError, match=message):
            gso.load(tmp_path / name)


def test_files_that_may_not_be_read(tmp_path, monkeypatch):
    (tmp_path / "a.obj").write_text(TEXT)
    refusal = PermissionError(13, "Permission denied")

    def refuse(*_):
        raise refusal

    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(MeshError, match=r"a\.obj: cannot be read: Permission denied"):
        gso.load(tmp_path / "a.obj")


def test_a_file_too_large_for_memory_is_an_error_of_the_package(tmp_path, monkeypatch):
    (tmp_path / "a.obj").write_text(TEXT)

    def read(data):
        raise MemoryError

    monkeypatch.setitem(gso.io._FORMATS, ".obj", (read, gso.io.obj.write))
    with pytest.raises(MeshError, match=r"a\.obj: does not fit into memory"):
        gso.load(tmp_path / "a.obj")


@pytest.mark.parametrize("suffix", gso.io.SUFFIXES)
def test_damaged_files_are_refused_or_read(suffix, tmp_path):
    """Cut at every length, and with single bytes changed: MeshError or a mesh, nothing else."""
    path = tmp_path / f"a{suffix}"
    gso.save(grid_points(3, 4), path)
    data, rng = path.read_bytes(), np.random.default_rng(0)
    cuts = [data[:k] for k in np.unique(rng.integers(0, len(data), 60))]
    spoiled = []
    for place, value in zip(rng.integers(0, len(data), 100), rng.integers(0, 256, 100)):
        spoiled.append(data[:place] + bytes([value]) + data[place + 1 :])
    for text in cuts + spoiled:
        path.write_bytes(text)
        try:
            assert len(gso.load(path).faces) > 0
        except MeshError as error:
            assert str(error).startswith(f"{path}: ")


def irregular():
    return Mesh([*SQUARE, [2, 0, 0]], [[0, 1, 2, 3], [1, 4, 2, -1]])


def test_numbers_beyond_single_precision(tmp_path):
    for suffix in (".stl", ".glb"):
        with pytest.raises(MeshError, match=f"{suffix}: the coordinates are too large"):
            gso.save(grid_points() * 1e50, tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_outputs_are_checked_before_anything_is_computed(tmp_path, monkeypatch):
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "file").write_text("")
    for name, message in (
        ("a.doc", r"a\.doc: cannot write a '\.doc' file; use \.obj, \.ply"),
        ("a", "a file without a suffix"),
        ("none/a.obj", "there is no folder .*none; create it"),
        ("file/a.obj", "there is no folder"),
        ("folder.obj", "is a folder"),
        ("a\0.obj", "cannot be written"),
    ):
        with pytest.raises(MeshError, match=message):
            gso.io.check_writable(tmp_path / name, gso.io.SUFFIXES)
        with pytest.raises(MeshError, match=message):
            gso.save("not looked at", tmp_path / name)
    gso.io.check_writable(tmp_path / "a.doc")
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(MeshError, match=r"a\.obj: no permission to write in"):
        gso.save(irregular(), tmp_path / "a.obj")


def test_flat_patterns_that_cannot_be_drawn(tmp_path):
    mesh, path = Mesh.from_grid(grid_points()), tmp_path / "a.svg"
    flat = mesh.vertices[:, :2].copy()
    with pytest.raises(gso.OptionError, match="unknown unit 'parsec'; there are mm, um"):
        gso.io.save_flat(flat, mesh, path, unit="parsec")
    with pytest.raises(MeshError, match=r"array \(3, 2\), but the mesh needs \(20, 2\)"):
        gso.io.save_flat(flat[:3], mesh, path)
    with pytest.raises(MeshError, match=r"a\.dxf.*use \.svg"):
        gso.io.save_flat(flat, mesh, tmp_path / "a.dxf")
    flat[4] = np.nan
    with pytest.raises(MeshError, match="not finite"):
        gso.io.save_flat(flat, mesh, path)
    tetrahedron = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    with pytest.raises(MeshError, match="closed surface"):
        gso.io.save_flat(np.eye(4, 2), tetrahedron, path)
    assert list(tmp_path.iterdir()) == []
