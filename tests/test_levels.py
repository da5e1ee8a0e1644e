"""Coarser meshes: thinning, displacements carried to finer meshes, constraints on coarser ones."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import faults, tasks
from gso.constraints import compile_constraints
from gso.hierarchy import Prolongation, Transfer, coarser, nearest_on_grid, thinned
from gso.mesh import Mesh, vertex_normals
from gso.tasks import check
from gso.tasks.developable import Options
from gso.tasks.developable import levels as planned


def lifted(plane: np.ndarray) -> np.ndarray:
    x, y = plane.T
    return np.stack([x, y, 0.3 * x * x - 0.2 * y * y + 0.1 * np.sin(3 * x + y)], axis=1)


def star(n: int, valence: int = 5) -> Mesh:
    """A quad mesh of patches (n, n) around a vertex of the given valence."""
    t = np.linspace(0, 1, n + 1)
    u, v = (x[..., None] for x in np.meshgrid(t, t, indexing="ij"))
    points, faces = [], []
    ids = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1)
    for k in range(valence):
        turn = 2 * np.pi * (k + np.array([0, 0.5, 1])) / valence
        a, b, c = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        points.append((u * (1 - v) * a + v * (1 - u) * c + 1.15 * u * v * b).reshape(-1, 2))
        faces.append(quads.reshape(-1, 4) + k * ids.size)
    flat = np.concatenate(points)
    _, first, inverse = np.unique(
        np.round(flat * 1e6).astype(int), axis=0, return_index=True, return_inverse=True
    )
    return Mesh(lifted(flat[first]), inverse.ravel()[np.concatenate(faces)])


def scattered(count: int) -> Mesh:
    """A triangle mesh of scattered points over a disc."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(3)
    radius, turn = np.sqrt(rng.random(count)) * 0.97, rng.random(count) * 2 * np.pi
    rim = np.linspace(0, 2 * np.pi, int(3 * count**0.5), endpoint=False)
    plane = np.concatenate(
        [
            radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1),
            np.stack([np.cos(rim), np.sin(rim)], axis=1),
        ]
    )
    return Mesh(lifted(plane), Delaunay(plane).simplices)


def tube(n: int) -> np.ndarray:
    """A tube, open along a line, as a grid."""
    u, v = np.meshgrid(np.linspace(-3, 3, n), np.linspace(-1, 1, n), indexing="ij")
    r = 0.7 + 0.1 * np.cos(2 * v)
    return np.stack([r * np.cos(u), r * np.sin(u), v], axis=-1)


def wave(n: int) -> np.ndarray:
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return np.stack([u, v, 0.3 * np.cos(2 * u) * np.cos(1.5 * v)], axis=-1)


MESHES = {"quads": star(14), "triangles": scattered(1500), "grid": Mesh.from_grid(wave(33))}


@pytest.mark.parametrize("name", MESHES)
def test_a_thinned_mesh_keeps_the_surface(name):
    mesh = MESHES[name]
    light = thinned(mesh.vertices, mesh.triangles, len(mesh.vertices) // 4)
    copy = Mesh(mesh.vertices[light.ids], light.faces)
    assert len(light.ids) == len(mesh.vertices) // 4
    assert not len(faults.folded(copy))
    assert copy.euler_characteristic == mesh.euler_characteristic
    assert len(copy.boundary_loops) == len(mesh.boundary_loops)
    border = mesh.half_edges.boundary_vertex[light.ids]
    np.testing.assert_array_equal(border, copy.half_edges.boundary_vertex)
    away = gso.metrics.surface_distance(mesh, copy)
    assert max(away.there_max, away.back_max) < 0.06 * mesh.diagonal
    area = [gso.metrics.area(m) for m in (mesh, copy)]
    assert area[1] == pytest.approx(area[0], rel=0.05)


def test_thinning_keeps_vertices_that_it_is_told_to_keep():
    mesh = MESHES["quads"]
    keep = np.arange(40, 80)
    light = thinned(mesh.vertices, mesh.triangles, 150, keep)
    assert np.isin(keep, light.ids).all()


@pytest.mark.parametrize("name", MESHES)
def test_affine_displacements_are_carried_exactly_and_others_do_not_grow(name):
    mesh = MESHES[name]
    ids = thinned(mesh.vertices, mesh.triangles, len(mesh.vertices) // 4).ids
    carry = Prolongation(mesh, ids)
    rng = np.random.default_rng(0)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    wanted = mesh.vertices @ matrix + shift
    np.testing.assert_allclose(carry(wanted[ids]), wanted, atol=1e-6)
    rough = rng.normal(size=(len(ids), 3))
    field = carry(rough)
    assert np.linalg.norm(field, axis=1).max() <= np.linalg.norm(rough, axis=1).max() + 1e-12


def test_held_vertices_keep_their_displacement():
    mesh = MESHES["quads"]
    ids = thinned(mesh.vertices, mesh.triangles, 250).ids
    held = np.flatnonzero(mesh.half_edges.boundary_vertex)
    bump = 0.1 * np.exp(-3 * (mesh.vertices**2).sum(axis=1))[:, None] * [0, 0, 1.0]
    field = Prolongation(mesh, ids, held)(bump[ids], np.zeros((len(held), 3)))
    assert np.abs(field[held]).max() < 1e-4


def on_coarser(points, constraints, count=20):
    """Constraints on a grid and on a coarser copy of it."""
    mesh = Mesh.from_grid(points)
    compiled = compile_constraints(constraints, mesh)
    light = coarser(mesh, count)[0]
    ids = [p.vertices.ravel() for p in compiled.parts]
    near = nearest_on_grid(mesh, light, np.unique(np.concatenate(ids)))
    return light, compiled.on(Transfer(mesh, light, near))


@pytest.mark.parametrize(
    "constraint",
    [
        gso.Fixed([0, 40, 500]),
        gso.FixedBoundary(),
        gso.Handle([500], [[0.0, 0.0, 1.0]], weight=1.0),
        gso.OnCurve(np.arange(41), wave(41)[0]),
        gso.SlidingBoundary(),
        gso.SymmetryPlane([0, 0, 0], [1, 0, 0]),
        gso.PlanarFaces(),
        gso.FixedLengths(),
    ],
    ids=lambda c: type(c).__name__,
)
def test_constraints_on_coarser_grids_hold_on_the_coarser_design(constraint):
    light, compiled = on_coarser(wave(41), [constraint])
    assert compiled is not None and all(part.count for part in compiled.parts)
    if isinstance(constraint, gso.Handle | gso.PlanarFaces):
        return
    for miss in compiled.violations(light.vertices).values():
        assert miss.length < 5e-3


def test_glued_sides_are_glued_on_coarser_grids():
    n = 41
    ids = np.arange(n * n).reshape(n, n)
    light, compiled = on_coarser(tube(n), [gso.Glue(np.stack([ids[0], ids[-1]], axis=1))])
    assert compiled.parts[0].count == light.grid_shape[1]


def test_smooth_curves_are_left_out_and_soft():
    _, compiled = on_coarser(wave(41), [gso.SmoothCurves([np.arange(41)])])
    assert compiled is not None and compiled.empty


def resolutions(mesh, constraints=(), **options):
    frame = Mesh(mesh.vertices, mesh.faces)
    analysis = tasks.get("developable").analysis(frame, compile_constraints(constraints, frame))
    return planned.levels(analysis, check("developable", options=Options(**options)))


def test_only_large_meshes_have_coarser_ones():
    mesh = MESHES["quads"]
    assert len(resolutions(mesh)) == 1
    small = resolutions(star(30), coarse_vertices=1000)
    assert [len(x.mesh.vertices) for x in small] == [len(star(30).vertices) // 4, 4651]
    assert len(resolutions(Mesh.from_grid(wave(96)), [gso.FixedBoundary()])) == 1
    assert len(resolutions(Mesh.from_grid(wave(98)), [gso.FixedBoundary()])) > 2
    # Many glued vertices have no copy on thinned meshes, few are kept.
    pairs = np.stack([np.arange(200), 1500 + np.arange(200)], axis=1)
    assert len(resolutions(star(30), [gso.Glue(pairs)], coarse_vertices=1000)) == 1
    assert len(resolutions(star(30), [gso.Glue(pairs[:20])], coarse_vertices=1000)) == 2


@pytest.mark.parametrize("mesh", [star(30), scattered(4600)], ids=["quads", "triangles"])
def test_coarser_meshes_cost_no_energy(mesh):
    full, begun = (
        gso.tno.optimize(mesh, options=Options(coarse_vertices=k), verdict=False)
        for k in (10**9, 1000)
    )
    assert sum(begun.energy.values()) <= 1.01 * sum(full.energy.values())
    assert begun.metrics["loss_gc_worst"] <= 1.05 * full.metrics["loss_gc_worst"]


def test_stages_have_names_and_can_be_cancelled():
    names = []

    def told(progress):
        names.append(progress.name)
        return len(names) < 8

    mesh = star(30)
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.tno.optimize(
            mesh, options=Options(coarse_vertices=800), callback=told, verdict=False
        )
    assert names[0].endswith("triangles")
    assert result.status is gso.Status.CANCELLED and np.isfinite(result.mesh.vertices).all()


def test_a_bound_holds_after_coarser_meshes():
    mesh = star(26)
    result = gso.tno.optimize(
        mesh,
        formulation="curvature",
        options=Options(coarse_vertices=800),
        max_deviation=0.01,
        verdict=False,
    )
    assert np.linalg.norm(result.mesh.vertices - mesh.vertices, axis=1).max() <= 0.01


def test_the_boundary_stays_fixed_after_coarser_meshes():
    mesh = star(26)
    inner = int(np.linalg.norm(mesh.vertices, axis=1).argmin())
    up = mesh.vertices[inner] + [0, 0, 0.05]
    given = [gso.FixedBoundary(), gso.Handle([inner], [up])]
    result = gso.tno.optimize(
        mesh, options=Options(coarse_vertices=800), constraints=given, verdict=False
    )
    border = mesh.half_edges.boundary_vertex
    np.testing.assert_allclose(result.mesh.vertices[border], mesh.vertices[border], atol=1e-12)
    np.testing.assert_allclose(result.mesh.vertices[inner], up, atol=1e-12)
    assert result.metrics["loss_gc"] < 0.6 * result.metrics["loss_gc_before"]


@pytest.mark.slow
def test_hard_constraints_hold_on_grids_with_coarser_ones(monkeypatch):
    # Smaller grids have coarser ones, too.
    monkeypatch.setattr("gso.tasks.developable.levels._SHORT", 48)
    n = 50
    points, ids = wave(n), np.arange(n * n).reshape(n, n)
    cases = {
        "handle": (points, [gso.Fixed(ids[0]), gso.Handle([ids[20, 15]], [[0.2, 0.0, 0.4]])]),
        "curve": (points, [gso.OnCurve(ids[0], points[0])]),
        "sliding": (points, [gso.SlidingBoundary()]),
        "glue": (tube(n), [gso.Glue(np.stack([ids[0], ids[-1]], axis=1))]),
        "symmetry": (points, [gso.SymmetryPlane([0, 0, 0], [1, 0, 0])]),
        "planar": (points, [gso.PlanarFaces()]),
        "lengths": (points, [gso.FixedLengths(np.stack([ids[0, :-1], ids[0, 1:]], axis=1))]),
    }
    for name, (design, given) in cases.items():
        result = gso.tno.optimize(design, constraints=given, verdict=False)
        assert max(result.details["constraints"].values()) < 1e-6, name


def eared(n: int) -> Mesh:
    """A quad patch with quads on its border, each with a vertex that no polyline goes through."""
    t = np.linspace(-1, 1, n)
    plane = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    ids = np.arange(n * n).reshape(n, n)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1)
    tips, ears = [], []
    for k in range(2, n - 3, 4):
        p, q, r = ids[0, k : k + 3]
        tips.append(plane[q] - [0.4 / n, 0.0])
        ears.append([p, q, r, n * n + len(tips) - 1])
    plane = np.concatenate([plane, tips])
    return Mesh(lifted(plane), np.concatenate([quads.reshape(-1, 4), ears]))


def test_vertices_that_no_polyline_goes_through_are_carried_too(monkeypatch):
    mesh = eared(20)
    ids = np.flatnonzero(np.arange(len(mesh.vertices)) % 3 == 0)
    values = mesh.vertices @ np.diag([0.1, 0.2, -0.1]) + 0.3
    field = Prolongation(mesh, ids)(values[ids])
    np.testing.assert_allclose(field, values, atol=1e-5)
    monkeypatch.setattr("gso.tasks.developable.levels._COARSEST", 100)
    options = Options(coarse_vertices=200)
    assert gso.tno.optimize(mesh, options=options, verdict=False).energy["curvature"] < 1e-3


def test_sessions_move_vertices_freely_after_coarser_meshes(monkeypatch):
    monkeypatch.setattr("gso.tasks.developable.levels._COARSEST", 100)
    mesh = star(10)
    corner = int(np.argmax(mesh.vertices[:, 0]))
    held = np.flatnonzero(mesh.vertices[:, 0] < -0.6)
    session = gso.tno.Session(
        mesh,
        task="developable",
        options=Options(coarse_vertices=100),
        constraints=[gso.Fixed(held), gso.Handle([corner], mesh.vertices[[corner]])],
    )
    session.move([corner], mesh.vertices[[corner]] + [0, 0, 0.1])
    first = session.step(1)
    moved = session.step(2) - first
    along = np.abs(np.einsum("nd,nd->n", moved, vertex_normals(mesh.replaced(first))))
    assert np.linalg.norm(moved, axis=1).max() > along.max()
