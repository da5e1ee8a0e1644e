"""The mesh: what it derives, what it repairs and says, and that its surfaces are consistent."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gso import Mesh, MeshError
from gso.mesh import topology
from tests.conftest import is_disk


def points(height, width):
    """A bent grid of points."""
    y, x = np.mgrid[:height, :width].astype(float)
    return np.stack([x, 1.5 * y, 0.1 * x * y - 0.05 * x**2], axis=-1)


def sphere(height, width):
    """Points of a sphere whose first and last rows are its poles."""
    polar = np.linspace(0, np.pi, height)[:, None]
    turn = np.linspace(0, 1.5 * np.pi, width)
    ring = np.sin(polar)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), np.cos(polar) + 0 * turn], axis=-1)


def faces_of(mesh):
    return [[v for v in f if v >= 0] for f in mesh.faces.tolist()]


def sides(faces):
    return Counter((a, b) for f in faces for a, b in zip(f, f[1:] + f[:1]))


def problems(faces):
    """What makes a list of polygons no surface of manifold parts, by plain counting."""
    edges = Counter(tuple(sorted(s)) for s in sides(faces).elements())
    if len({frozenset(f) for f in faces}) < len(faces):
        return "duplicate"
    if max(edges.values()) > 2:
        return "edge"
    for vertex in {v for f in faces for v in f}:
        # Link of the vertex: one path or one cycle, or two fans touch in it.
        at = [(f, f.index(vertex)) for f in faces if vertex in f]
        around = [(f[k - 1], f[(k + 1) % len(f)]) for f, k in at]
        reached, todo = set(), [around[0][0]]
        while todo:
            here = todo.pop()
            reached.add(here)
            todo += [v for pair in around if here in pair for v in pair if v not in reached]
        if {v for pair in around for v in pair} != reached:
            return "vertex"
    return None


def check(mesh):
    """The invariants that the rest of the package relies on."""
    n, faces = len(mesh.vertices), faces_of(mesh)
    directed = sides(faces)
    assert max(directed.values()) == 1
    assert problems(faces) is None
    he = mesh.half_edges
    inner = np.flatnonzero(he.twin >= 0)
    assert (he.twin[he.twin[inner]] == inner).all()
    assert (he.origin[he.twin[inner]] == he.dest[inner]).all()
    assert (he.next[he.prev] == np.arange(he.origin.size)).all()
    rim = {s for s in directed if s[::-1] not in directed}
    walked = [s for p in mesh.boundary_loops for s in zip(p.tolist(), np.roll(p, -1).tolist())]
    assert len(walked) == len(rim) and set(walked) == rim
    triangles = sides(mesh.triangles.tolist())
    assert max(triangles.values()) == 1
    assert {s for s in triangles if s[::-1] not in triangles} == rim
    boundary = {v for s in rim for v in s}
    centres = np.concatenate([c for c, _ in mesh.stars]).tolist() if mesh.stars else []
    assert sorted(centres) == sorted({v for f in faces for v in f} - boundary)
    assert mesh.components.shape == (n,)
    if mesh.grid_index is not None:
        again = mesh.grid_index.ravel()[topology.grid_faces(*mesh.grid_shape)]
        assert {frozenset(f) for f in again.tolist()} == {frozenset(f) for f in faces}
        assert np.array_equal(mesh.grid, mesh.vertices[mesh.grid_index])


def test_a_grid_of_points():
    grid = points(4, 6)
    mesh = Mesh.from_grid(grid)
    assert np.array_equal(mesh.grid, grid) and mesh.grid_shape == (4, 6)
    assert is_disk(mesh) and mesh.notes == () and not mesh.is_triangles
    assert repr(mesh) == "Mesh(24 vertices, 15 faces, grid 4 x 6)"
    # Cells are split along (i, j)-(i+1, j+1).
    ids = mesh.grid_index
    diagonals = set(zip(ids[:-1, :-1].ravel().tolist(), ids[1:, 1:].ravel().tolist()))
    assert diagonals <= set(sides(mesh.triangles.tolist()))
    check(mesh)


@pytest.mark.parametrize("seed", range(5))
def test_a_grid_in_any_numbering(seed):
    rng = np.random.default_rng(seed)
    plain = Mesh.from_grid(points(4, 6))
    names = rng.permutation(24)
    vertices = np.empty((24, 3))
    vertices[names] = plain.vertices
    mesh = Mesh(vertices, rng.permutation(names[plain.faces]))
    check(mesh)
    assert mesh.grid_shape in ((4, 6), (6, 4))
    same = [g for g in (mesh.grid, mesh.grid.swapaxes(0, 1)) if g.shape == (4, 6, 3)]
    turned = [h for g in same for h in (g, g[::-1], g[:, ::-1], g[::-1, ::-1])]
    assert any(np.array_equal(h, points(4, 6)) for h in turned)


def test_arrays_are_copies_and_cannot_be_written():
    vertices = points(3, 3).reshape(-1, 3)
    mesh = Mesh(vertices, topology.grid_faces(3, 3))
    vertices[0] = 7
    assert mesh.vertices[0, 0] == 0
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_replaced_vertices_keep_the_connectivity():
    mesh = Mesh.from_grid(points(4, 5))
    loops = mesh.boundary_loops
    other = mesh.replaced(2 * mesh.vertices, notes=("doubled",))
    assert other.boundary_loops is loops and other.notes == ("doubled",)
    assert np.array_equal(other.grid, 2 * mesh.grid)
    assert other.frame.scale == pytest.approx(2 * mesh.frame.scale)
    with pytest.raises(MeshError, match="3 vertices given for 20"):
        mesh.replaced(np.zeros((3, 3)))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_the_frame_takes_the_farthest_vertex_to_the_unit_sphere(unit):
    mesh = Mesh.from_grid(unit * (points(4, 5) + np.array([1e3, -2e3, 5e2])))
    inside = mesh.frame.to_unit(mesh.vertices)
    assert np.linalg.norm(inside, axis=1).max() == pytest.approx(1.0)
    assert np.abs(inside.mean(axis=0)).max() < 1e-12
    assert np.allclose(mesh.frame.to_user(inside), mesh.vertices, rtol=1e-14)


def test_vertices_of_no_face_are_noted_and_do_not_move_the_frame():
    plain = Mesh.from_grid(points(3, 4))
    mesh = Mesh(np.r_[plain.vertices, [[1e9, 0, 0]]], plain.faces)
    assert mesh.notes == (
        "1 vertices belong to no face and stay as they are (the first is vertex 12)",
    )
    assert mesh.frame.scale == plain.frame.scale and mesh.diagonal == plain.diagonal
    assert is_disk(mesh) and mesh.grid is None
    check(mesh)


def test_inconsistent_orientation_is_repaired_and_noted():
    plain = Mesh.from_grid(points(4, 5))
    faces = plain.faces.copy()
    faces[[2, 7]] = topology.reverse(faces[[2, 7]])
    mesh = Mesh(plain.vertices, faces)
    assert mesh.notes == ("2 faces were reversed to make the orientation consistent",)
    assert np.array_equal(mesh.faces, plain.faces)


def test_components_are_noted():
    plain = Mesh.from_grid(points(3, 4))
    vertices = np.r_[plain.vertices, plain.vertices + np.array([9, 0, 0])]
    mesh = Mesh(vertices, np.r_[plain.faces, plain.faces + 12])
    assert mesh.notes == ("the mesh has 2 components; each is treated on its own",)
    assert len(set(mesh.components[:12])) == len(set(mesh.components[12:])) == 1
    assert not is_disk(mesh) and len(mesh.boundary_loops) == 2
    check(mesh)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("ends", [(True, False), (False, True), (True, True)])
def test_a_side_that_is_one_point_is_welded_to_a_pole(axis, ends):
    height, width = 6, 7
    grid = sphere(height + 2, width)[0 if ends[0] else 1 : None if ends[1] else -1]
    rows = len(grid)
    mesh = Mesh.from_grid(grid.swapaxes(0, 1) if axis else grid)
    poles = sum(ends)
    assert len(mesh.vertices) == rows * width - poles * (width - 1)
    assert len(mesh.faces) == (rows - 1) * (width - 1)
    assert np.count_nonzero(mesh.faces[:, 3] < 0) == poles * (width - 1)
    assert mesh.grid is None and is_disk(mesh)
    (note,) = mesh.notes
    assert "column" in note if axis else "row" in note
    assert ("one point each" in note) == (poles == 2)
    check(mesh)


def test_adjacent_sides_in_one_point_become_one_pole():
    for turn in range(4):
        grid = np.rot90(points(5, 5), turn).copy()
        grid[0] = grid[:, 0] = grid[0, 0]
        for view in (grid, grid[::-1], grid[:, ::-1], grid[::-1, ::-1]):
            mesh = Mesh.from_grid(view)
            assert len(mesh.vertices) == 17 and len(mesh.faces) == 15
            check(mesh)


CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


def test_closed_surfaces_are_accepted():
    cube = Mesh(CORNERS, CUBE)
    assert cube.euler_characteristic == 2 and cube.boundary_loops == [] and not is_disk(cube)
    assert sum(len(c) for c, _ in cube.stars) == 8
    check(cube)
    tetrahedron = Mesh(CORNERS[[0, 1, 3, 4]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert tetrahedron.is_triangles and tetrahedron.euler_characteristic == 2
    check(tetrahedron)


def test_mixed_faces_and_padding():
    faces = [[0, 1, 2, 3], [4, 5, 6, -1], [4, 6, 7, -1], *CUBE[2:].tolist()]
    mesh = Mesh(CORNERS, faces)
    assert repr(mesh) == "Mesh(8 vertices, 7 faces, quads and triangles)"
    check(mesh)
    padded = Mesh(CORNERS[:3], [[0, 1, 2, -1]])
    assert padded.faces.shape == (1, 3) and padded.is_triangles


def test_whole_numbers_in_other_types_are_accepted():
    for kind in (np.int32, np.uint8, np.uint64, float):
        assert np.array_equal(Mesh(CORNERS.astype(kind), CUBE.astype(kind)).faces, CUBE)


@st.composite
def spoiled_surfaces(draw):
    """Part of a grid or of its triangulation, renumbered, reversed and doubled in places."""
    height, width = draw(st.integers(2, 5)), draw(st.integers(2, 5))
    quads = topology.grid_faces(height, width).tolist()
    split = draw(st.lists(st.booleans(), min_size=len(quads), max_size=len(quads)))
    faces = [t for q, s in zip(quads, split) for t in ([q[:3], [q[0], *q[2:]]] if s else [q])]
    faces = draw(st.lists(st.sampled_from(faces), min_size=1, unique_by=tuple))
    if draw(st.booleans()) and draw(st.booleans()):
        faces.append(draw(st.sampled_from(faces)))
    turns = draw(st.lists(st.booleans(), min_size=len(faces), max_size=len(faces)))
    names = draw(st.permutations(range(height * width)))
    faces = [[names[v] for v in (f[::-1] if t else f)] for f, t in zip(faces, turns)]
    vertices = np.empty((height * width, 3))
    vertices[list(names)] = points(height, width).reshape(-1, 3)
    return vertices, faces


def padded(faces):
    return [f + [-1] * (4 - len(f)) for f in faces]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(spoiled_surfaces())
def test_parts_of_a_surface_are_consistent_or_refused_for_a_reason(surface):
    vertices, faces = surface
    if problems(faces):
        with pytest.raises(MeshError, match=r"there is|there \d|belongs to|joins"):
            Mesh(vertices, padded(faces))
        return
    mesh = Mesh(vertices, padded(faces))
    check(mesh)
    assert [set(f) for f in faces_of(mesh)] == [set(f) for f in faces]
    assert np.array_equal(mesh.vertices, vertices)


corners = st.lists(st.integers(0, 6), min_size=3, max_size=4, unique=True)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(corners, min_size=1, max_size=6))
def test_any_few_faces_are_consistent_or_refused(faces):
    angle = np.arange(7.0)
    vertices = np.c_[np.cos(angle), np.sin(angle), angle**2 / 9]
    try:
        mesh = Mesh(vertices, padded(faces))
        mesh.triangles  # noqa: B018
    except MeshError:
        return
    check(mesh)


def test_a_quad_that_cannot_be_split_is_named():
    faces = [[1, 5, 4, 2], [4, 3, 1], [1, 3, 2], [0, 3, 5, 4], [4, 2, 5, 3]]
    mesh = Mesh(np.random.default_rng(0).random((6, 3)), padded(faces))
    with pytest.raises(MeshError, match="cannot be split into triangles"):
        mesh.triangles  # noqa: B018
