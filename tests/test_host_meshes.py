"""Meshes of other packages, in and out, where these are installed."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import gso
from gso import GSOError, MeshError, OptionError
from gso.io import as_host

POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.1], [1, 1, 0.3], [2, 1, 0.2], [1, 2, 0]], float
)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
MIXED = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 6]]
#: A quad, and a polygon with five corners.
MANY = [[0, 1, 4, 3], [1, 2, 5, 6, 4]]


def meshes():
    """Quads, quads and triangles, triangles."""
    padded = [[*face, -1][:4] for face in MIXED]
    quads = gso.Mesh(POINTS[:6], QUADS)
    return {"quads": quads, "mixed": gso.Mesh(POINTS, padded), "triangles": gso.Mesh(
        POINTS[:6], quads.triangles
    )}  # fmt: skip


def corners(mesh):
    """Corners of all faces, without their order."""
    return sorted(tuple(p for p in sorted(row) if p >= 0) for row in mesh.faces.tolist())


@pytest.mark.parametrize("kind", meshes())
@pytest.mark.parametrize("name", ["compas", "meshio", "pyvista", "trimesh"])
def test_there_and_back(name, kind):
    pytest.importorskip(name)
    mesh = meshes()[kind]
    back = gso.as_mesh(as_host(mesh, name))
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    if name == "trimesh":
        np.testing.assert_array_equal(back.faces, mesh.triangles)
    elif name == "meshio":
        assert corners(back) == corners(mesh)
    else:
        np.testing.assert_array_equal(back.faces, mesh.faces)


@pytest.mark.parametrize("kind", ["array", "list", "polygons"])
def test_vertices_and_faces(kind):
    faces = {"array": np.array(QUADS), "list": MIXED, "polygons": MANY}[kind]
    mesh = gso.as_mesh((POINTS, faces))
    assert len(mesh.faces) == {"array": 2, "list": 3, "polygons": 4}[kind]
    area = sum(gso.metrics.area(part) for part in [mesh])
    whole = gso.metrics.area(gso.Mesh(POINTS[:6], QUADS))
    assert area >= whole - 1e-12
    assert any("more than four corners" in note for note in mesh.notes) == (kind == "polygons")


def test_compas_keeps_polygons():
    datastructures = pytest.importorskip("compas.datastructures")
    mesh = datastructures.Mesh.from_vertices_and_faces(POINTS.tolist(), MANY)
    assert gso.metrics.area(gso.as_mesh(mesh)) == pytest.approx(
        gso.metrics.area(gso.as_mesh((POINTS, MANY)))
    )
    # Keys need not be consecutive.
    mesh.delete_face(0)
    assert len(gso.as_mesh(mesh).faces) == 3
    # A flattened box has its exact size.
    box = datastructures.Mesh.from_polyhedron(6)
    assert gso.unfold(box).cut_length > 0


def test_pyvista_surfaces_and_others():
    pyvista = pytest.importorskip("pyvista")
    sphere = gso.as_mesh(pyvista.Sphere(theta_resolution=12, phi_resolution=8))
    assert sphere.euler_characteristic == 2
    half = pyvista.CylinderStructured(radius=[1.0], height=2.0)
    with pytest.raises(MeshError, match="extract_surface"):
        gso.as_mesh(half)
    with pytest.raises(MeshError, match="no faces"):
        gso.as_mesh(pyvista.PolyData(POINTS))
    assert len(gso.as_mesh(pyvista.PolyData(POINTS, [4, *MANY[0], 5, *MANY[1]])).faces) == 4


def test_meshio_cells():
    meshio = pytest.importorskip("meshio")
    lines = [("line", [[0, 1]]), ("triangle", [[0, 1, 4]]), ("quad", QUADS[1:])]
    mesh = gso.as_mesh(meshio.Mesh(POINTS, lines))
    assert mesh.faces.tolist() == [[0, 1, 4, -1], [1, 2, 5, 4]]
    flat = gso.as_mesh(meshio.Mesh(POINTS[:, :2], [("quad", QUADS)]))
    assert not flat.vertices[:, 2].any()
    curved = meshio.Mesh(POINTS, [("triangle6", [[0, 2, 6, 1, 5, 3]])])
    with pytest.raises(MeshError, match="'tetra'"):
        gso.as_mesh(meshio.Mesh(POINTS, [("tetra", [[0, 1, 4, 6]])]))
    assert any("triangle6" in note for note in gso.as_mesh(curved).notes)
    with pytest.raises(MeshError, match="no triangles or quads"):
        gso.as_mesh(meshio.Mesh(POINTS, [("line", [[0, 1]])]))


def test_methods_take_them():
    pyvista = pytest.importorskip("pyvista")
    box = pyvista.Box(bounds=(0, 1, 0, 2, 0, 3), quads=True).clean()
    net = gso.unfold(box)
    assert len(net) == 1
    assert net.areas[0] == pytest.approx(22.0)


def test_other_objects_are_recognised_by_their_attributes():
    given = SimpleNamespace(vertices=POINTS[:6], faces=QUADS)
    assert gso.as_mesh(given).faces.tolist() == QUADS
    points = SimpleNamespace(points=POINTS)
    with pytest.raises(MeshError, match=r"SimpleNamespace is no surface: .*pyvista"):
        gso.as_mesh(points)


def test_errors_say_what_to_do(monkeypatch):
    mesh = meshes()["quads"]
    with pytest.raises(OptionError, match="did you mean 'pyvista'"):
        as_host(mesh, "pyvsta")
    monkeypatch.setattr("gso.io.hosts.find_spec", lambda name: None)
    with pytest.raises(GSOError, match="meshio is not installed; pip install meshio"):
        as_host(mesh, "meshio")


@pytest.mark.parametrize(
    ("faces", "said"),
    [
        ([[0, 1], [0, 1, 2]], "face 0 = .* fewer than three corners"),
        ([[0, 1, 2], [0, 1, 2, 3, 9]], "face 1 = .* from 0 to 6"),
        ([[0, 1, 2], [0, 1, 2, -1, 4]], "face 1 = .* from 0 to 6"),
        ([[0, 1, 2], [0, 1, 2.5, 3]], "rows of vertex numbers"),
    ],
)
def test_polygons_that_cannot_be_used(faces, said):
    with pytest.raises(MeshError, match=said):
        gso.as_mesh((POINTS, faces))


def test_a_package_that_is_added():
    module = SimpleNamespace(
        PACKAGE="json",
        is_mesh=lambda x: isinstance(x, dict),
        surface=lambda x: gso.io.Surface(x["v"], x["f"]),
        make=lambda mesh: {"v": mesh.vertices, "f": mesh.faces},
    )
    gso.io.add_host("plain", module)
    try:
        mesh = meshes()["quads"]
        assert gso.as_mesh(as_host(mesh, "plain")).faces.tolist() == QUADS
    finally:
        from gso.io import hosts

        hosts._MODULES._added.pop("plain")


def test_recognising_them_imports_none():
    code = (
        "import sys, gso\n"
        "from types import SimpleNamespace as N\n"
        "m = N(to_vertices_and_faces=lambda: ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))\n"
        "gso.as_mesh(m)\n"
        "print(sorted({'compas', 'meshio', 'pyvista', 'trimesh'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
