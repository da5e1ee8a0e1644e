"""Constraints: each kind holds in every task, linear ones exactly; conflicts are named."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gso
from gso import geometry, unknowns
from gso.constraints import (
    Constraint,
    Part,
    Pins,
    Relations,
    check,
    compile_constraints,
    read_constraints,
    reduce,
)
from gso.energy import STIFF, Term, Weighted, hardened
from gso.mesh import Frame, Mesh, Polylines, vertex_normals
from gso.unknowns import Layout, normal_offsets
from gso.verdict import Code
from tests.conftest import codes, saddle, shuffled, sphere_cap

TIGHT = 1e-6


def mirrored(n: int = 13) -> np.ndarray:
    """A surface that is its own image under x -> -x, (n, n, 3)."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return np.stack([u, v, 0.4 * u * u * v + 0.2 * u * u], axis=-1)


def holed() -> Mesh:
    """Quads in disorder round a hole, in a unit and a frame of their own."""
    grid = Mesh.from_grid(mirrored())
    faces = np.delete(grid.faces, [54, 55, 66, 67, 78, 79, 90, 91], axis=0)
    return shuffled(Mesh(30.0 * grid.vertices + [5.0, 0.0, -100.0], faces))


GRID = Mesh.from_grid(mirrored())
MESHES = {"grid": GRID, "triangles": Mesh(GRID.vertices, GRID.triangles), "holed": holed()}
PLANES = {"grid": [0, 0, 0], "triangles": [0, 0, 0], "holed": [5, 0, 0]}


def raised(points: np.ndarray, height: float) -> np.ndarray:
    return points + np.array([0.0, 0.0, height])


def rim(mesh: Mesh) -> np.ndarray:
    return np.flatnonzero(mesh.half_edges.boundary_vertex)


def corner(mesh: Mesh) -> int:
    return int(mesh.vertices.sum(axis=1).argmin())


def kinds(name: str) -> dict[str, list[gso.constraints.Constraint]]:
    mesh = MESHES[name]
    size, start, outer = mesh.frame.scale, corner(mesh), mesh.boundary_loops[0]
    loop = mesh.vertices[outer]
    return {
        "fixed": [gso.Fixed([start, 5])],
        "handle": [gso.Handle([start], raised(mesh.vertices[[start]], 0.1 * size))],
        "curve": [gso.OnCurve(outer, raised(loop, 0.05 * size), closed=True)],
        "sliding": [gso.SlidingBoundary()],
        "glue": [gso.Glue([outer[[0, 3]], outer[[3, 6]]])],
        "mirror": [gso.SymmetryPlane(PLANES[name], [1, 0, 0])],
        "planar": [gso.PlanarFaces(np.arange(0, len(mesh.faces), 5))],
        "lengths": [gso.FixedLengths(mesh.edges[::5])],
        "several": [
            gso.SymmetryPlane(PLANES[name], [1, 0, 0]),
            gso.SlidingBoundary(),
            gso.FixedLengths(mesh.edges[::9]),
        ],
    }


@cache
def solved(name: str, kind: str, task: str) -> gso.Result:
    """A mesh with constraints of a kind, solved once; no test may change the result."""
    return gso.tno.optimize(MESHES[name], task=task, constraints=kinds(name)[kind])


@pytest.mark.parametrize("task", ["developable", "denoise", "bend"])
@pytest.mark.parametrize("kind", kinds("grid"))
@pytest.mark.parametrize("name", MESHES)
def test_every_kind_holds_on_every_mesh(name, kind, task):
    mesh = MESHES[name]
    result = solved(name, kind, task)
    left = result.details["constraints"]
    assert len(left) == len(kinds(name)[kind])
    assert max(left.values()) <= TIGHT * mesh.frame.scale
    assert result.status is not gso.Status.CONSTRAINTS_MISSED
    assert np.isfinite(result.mesh.vertices).all()


def test_linear_ones_hold_to_rounding():
    for kind in ("fixed", "handle", "glue", "mirror"):
        result = solved("holed", kind, "developable")
        left = result.details["constraints"]["constraint 0 (" + _type(kind) + ")"]
        assert left <= 1e-13 * 100


def _type(kind: str) -> str:
    return type(kinds("grid")[kind][0]).__name__


def test_violations_are_measured_on_the_result_itself():
    mesh = MESHES["holed"]
    outer = mesh.boundary_loops[0]
    after = {
        kind: solved("holed", kind, "developable").mesh.vertices
        for kind in ("glue", "mirror", "planar", "lengths", "curve")
    }
    glued = after["glue"]
    np.testing.assert_allclose(glued[outer[0]], glued[outer[6]], atol=1e-12)
    np.testing.assert_allclose(
        _sorted(after["mirror"]), _sorted(after["mirror"] * [-1, 1, 1] + [10, 0, 0]), atol=1e-9
    )
    for face in mesh.faces[::5]:
        p = after["planar"][face] - after["planar"][face].mean(axis=0)
        assert np.linalg.svd(p)[1][2] < TIGHT * mesh.frame.scale
    a, b = mesh.edges[::5].T
    was, now = (np.linalg.norm(v[a] - v[b], axis=1) for v in (mesh.vertices, after["lengths"]))
    np.testing.assert_allclose(now, was, atol=TIGHT * mesh.frame.scale)
    # Points on the curve are on the raised boundary's segments.
    line = raised(mesh.vertices[outer], 0.05 * mesh.frame.scale)
    foot = Polylines.of(line, closed=True).nearest(after["curve"][outer]).points
    assert np.abs(foot - after["curve"][outer]).max() < TIGHT * mesh.frame.scale


def _sorted(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 6).T)]


def test_numbering_unit_and_frame_do_not_matter():
    mesh = Mesh(GRID.vertices, np.delete(GRID.faces, [66, 67], axis=0))
    rng = np.random.default_rng(3)
    order = rng.permutation(len(mesh.vertices))
    new = np.argsort(order)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    shift = np.array([70.0, -3.0, 12.0])
    moved = Mesh((25.0 * mesh.vertices @ turn.T + shift)[order], new[mesh.faces])
    outer = mesh.boundary_loops[0]
    line = mesh.vertices[outer] * 1.02

    def wanted(rename, points, normal, point):
        return [
            gso.SymmetryPlane(point, normal),
            gso.OnCurve(rename[outer], points, closed=True),
            gso.FixedLengths(rename[mesh.edges[::9]]),
            gso.PlanarFaces(np.arange(0, len(mesh.faces), 9)),
        ]

    here = gso.tno.optimize(
        mesh, constraints=wanted(np.arange(len(order)), line, [1, 0, 0], [0, 0, 0])
    )
    there = gso.tno.optimize(
        moved, constraints=wanted(new, 25.0 * line @ turn.T + shift, turn[:, 0], shift)
    )
    back = ((there.mesh.vertices[new] - shift) @ turn) / 25.0
    assert here.status is not gso.Status.CONSTRAINTS_MISSED
    np.testing.assert_allclose(back, here.mesh.vertices, atol=1e-5)


def test_corners_stay_and_sides_slide():
    mesh = Mesh.from_grid(saddle(17))
    result = gso.tno.optimize(mesh, constraints=[gso.SlidingBoundary()])
    corners = mesh.grid_index[[0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_allclose(result.mesh.vertices[corners], mesh.vertices[corners], atol=1e-12)
    moved = np.linalg.norm(result.mesh.vertices - mesh.vertices, axis=1)[rim(mesh)]
    assert moved.max() > 1e-3
    fixed = gso.tno.optimize(mesh, constraints=[gso.FixedBoundary()])
    assert sum(result.energy.values()) < sum(fixed.energy.values())


def test_a_round_boundary_slides_as_a_whole():
    angle, radius = np.meshgrid(
        np.linspace(0, 2 * np.pi, 33)[:-1], np.linspace(0.3, 1, 6), indexing="ij"
    )
    ids = np.arange(192).reshape(32, 6)
    right = np.roll(ids, -1, axis=0)
    faces = np.stack([ids[:, :-1], right[:, :-1], right[:, 1:], ids[:, 1:]], -1).reshape(-1, 4)
    points = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), 0.5 * radius**2], axis=-1
    ).reshape(-1, 3)
    mesh = Mesh(points, faces)
    compiled = compile_constraints([gso.SlidingBoundary()], mesh)
    assert len(compiled.hard_ids) == 0
    turned = gso.Handle([ids[0, -1]], [[np.cos(0.05), np.sin(0.05), 0.5]], weight=10.0)
    result = gso.tno.optimize(mesh, constraints=[gso.SlidingBoundary(), turned])
    assert result.details["constraints"]["constraint 0 (SlidingBoundary)"] <= TIGHT


def test_an_end_of_a_curve_is_not_passed():
    mesh = Mesh.from_grid(saddle(9, strength=0.0))
    # The vertex wants to x = 0, the rail ends at x = 0.2.
    rail = [[0.9, 0.0, 0.1], [0.2, 0.0, 0.1]]
    at = int(mesh.grid_index[4, 4])
    result = gso.tno.optimize(
        mesh,
        constraints=[gso.OnCurve([at], rail), gso.Handle([at], [[-0.5, 0.0, 0.1]], weight=1.0)],
    )
    np.testing.assert_allclose(result.mesh.vertices[at], rail[1], atol=TIGHT)


def test_soft_ones_give_way_to_weight():
    away = []
    for weight in (1e-4, 1e-2, 1.0):
        curve = gso.OnCurve([0], [[-2, -1, 1], [2, -1, 1]], weight=weight)
        result = gso.tno.optimize(saddle(9), constraints=[curve], verdict=False)
        assert result.converged or result.status is gso.Status.MAX_ITERATIONS
        away.append(result.details["constraints"]["constraint 0 (OnCurve)"])
    assert away[0] > away[1] > away[2] > 0
    for soft in (gso.PlanarFaces(weight=0.1), gso.FixedLengths(weight=0.1)):
        result = gso.tno.optimize(sphere_cap(9), constraints=[soft], max_deviation=0.01)
        assert result.metrics["distance_max"] <= 1.0 / result.design.diagonal * (1 + 1e-6)


def test_given_lengths_are_reached():
    mesh = Mesh.from_grid(saddle(9, strength=0.1))
    result = gso.tno.optimize(mesh, constraints=[gso.FixedLengths([[0, 80]], [2.5])])
    v = result.mesh.vertices
    assert np.linalg.norm(v[0] - v[80]) == pytest.approx(2.5, abs=TIGHT)


def test_hard_constraints_are_no_part_of_the_energy():
    result = gso.tno.optimize(GRID, constraints=[gso.FixedLengths(GRID.edges[::5])])
    assert set(result.energy) == {"curvature", "proximity", "fairness", "elongation"}
    soft = gso.tno.optimize(GRID, constraints=[gso.FixedLengths(GRID.edges[::5], weight=1.0)])
    assert soft.energy["length"] > 0


def test_a_solve_can_be_stopped_while_constraints_are_tightened():
    constraints = [gso.FixedLengths(GRID.edges[::5])]
    seen = []
    gso.tno.optimize(GRID, constraints=constraints, callback=seen.append)
    count = len(seen)
    with pytest.warns(gso.ConvergenceWarning, match="callback"):
        result = gso.tno.optimize(
            GRID,
            constraints=constraints,
            callback=lambda progress: seen.append(progress) or len(seen) < 2 * count,
        )
    assert result.status is gso.Status.CANCELLED


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("task", ["bend", "denoise"])
def test_nothing_left_to_move(task):
    held = gso.Fixed(np.ones(len(V), bool))
    result = gso.tno.optimize(GRID, constraints=[held], task=task)
    assert result.converged and result.iterations == 0
    np.testing.assert_allclose(result.mesh.vertices, V, atol=1e-12)


@pytest.mark.parametrize(
    ("more", "code"), [({}, Code.NOTHING_DONE), ({"max_deviation": 0.1}, Code.STRAIN)]
)
def test_nothing_left_to_move_leaves_it_curved(more, code):
    held = gso.Fixed(np.ones(len(V), bool))
    with pytest.warns(gso.ConvergenceWarning, match="not usable as what was asked for:"):
        result = gso.tno.optimize(GRID, constraints=[held], **more)
    assert result.status is gso.Status.UNUSABLE and not result.usable
    assert code in codes(result.reasons)
    assert result.iterations == 0
    np.testing.assert_allclose(result.mesh.vertices, V, atol=1e-12)


def test_one_constraint_or_a_generator_will_do():
    for given in (gso.Fixed([0]), (c for c in [gso.Fixed([0])])):
        result = gso.tno.optimize(GRID, constraints=given, options="fast")
        np.testing.assert_allclose(result.mesh.vertices[0], V[0], atol=1e-12)
    given = (c for c in [gso.Fixed([0])])
    for item in gso.tno.optimize_many([GRID, GRID], workers=0, constraints=given, options="fast"):
        np.testing.assert_allclose(item.result.mesh.vertices[0], V[0], atol=1e-12)


def test_denoising_keeps_what_is_known():
    clean = sphere_cap(24, radius=1.0)
    noisy = clean + 0.004 * np.random.default_rng(0).standard_normal(clean.shape)
    mesh = Mesh.from_grid(noisy)
    ids = rim(mesh)
    known = gso.Handle(ids, clean.reshape(-1, 3)[ids])
    free_result = gso.tno.optimize(mesh, task="denoise")
    held = gso.tno.optimize(mesh, task="denoise", constraints=[known])
    assert gso.metrics.normal_angle(clean, held.grid) < gso.metrics.normal_angle(
        clean, free_result.grid
    )
    # What holds already is not touched.
    same = gso.tno.optimize(
        mesh,
        task="denoise",
        constraints=[gso.Handle([40], free_result.mesh.vertices[[40]])],
    )
    np.testing.assert_allclose(same.mesh.vertices, free_result.mesh.vertices, atol=1e-9)


FLAT = Mesh.from_grid(saddle(13, strength=0.25))
SIDE = FLAT.grid_index[0]


@pytest.mark.parametrize("formulation", ["strain", "lengths"])
@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize(
    "constraints",
    [
        [gso.Handle([0, 12], [[50.0, 7.0], [50.0, 9.0]])],
        [gso.OnCurve(SIDE, [[3.0, -9.0], [4.0, 9.0]])],
        [gso.FixedLengths(FLAT.edges[::3])],
        [gso.SymmetryPlane([4, 1], [1, 2], pairs=np.c_[SIDE, FLAT.grid_index[-1]])],
        [gso.Handle([0], [[1.0, 1.0]]), gso.OnCurve(SIDE, [[1.0, 1.0], [1.0, 9.0]])],
    ],
    ids=["handles", "edge", "lengths", "mirror", "two"],
)
def test_flat_images_keep_constraints(constraints, triangles, formulation):
    mesh = Mesh(FLAT.vertices, FLAT.triangles) if triangles else FLAT
    result = gso.tno.optimize(
        mesh, task="flatten", formulation=formulation, constraints=constraints
    )
    assert max(result.details["constraints"].values()) <= TIGHT
    assert result.status is not gso.Status.CONSTRAINTS_MISSED
    assert result.metrics["flipped_cells"] == 0


def test_rigidly_possible_handles_cost_nothing():
    plain = gso.tno.optimize(FLAT, task="flatten", options="accurate")
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    goal = plain.flat[[0, 80, 168]] @ turn.T + [100.0, -40.0]
    held = gso.tno.optimize(
        FLAT, task="flatten", options="accurate", constraints=[gso.Handle([0, 80, 168], goal)]
    )
    assert held.metrics["strain_mean"] == pytest.approx(plain.metrics["strain_mean"], rel=1e-3)
    np.testing.assert_allclose(held.flat, plain.flat @ turn.T + [100.0, -40.0], atol=1e-3)


def test_loose_parts_of_a_pattern_lie_beside_the_anchored_one():
    two = Mesh(np.r_[FLAT.vertices, raised(FLAT.vertices, 3)], np.r_[FLAT.faces, FLAT.faces + 169])
    anchored = gso.Handle([0, 12], [[0.0, 0.0], [2.0, 0.0]])
    flat = gso.tno.optimize(two, task="flatten", constraints=[anchored]).flat
    np.testing.assert_allclose(flat[[0, 12]], [[0.0, 0.0], [2.0, 0.0]], atol=1e-9)
    assert flat[169:, 0].min() > flat[:169, 0].max()


V = GRID.vertices


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        ([gso.Fixed([3]), gso.Handle([3], [[9, 9, 9]])], r"0 \(Fixed\) and .*1 .*vertex 3"),
        (
            [gso.Fixed([3, 50]), gso.Fixed([9]), gso.Glue([[3, 7]]), gso.Handle([7], [[0, 0, 0]])],
            r"^constraint 0 \(Fixed\), constraint 2 \(Glue\) and constraint 3 \(Handle\)",
        ),
        (
            [gso.Glue([[8, 40]]), gso.Handle([0], raised(V[[0]], 1)), gso.FixedBoundary()],
            r"1 \(Handle\) and constraint 2 \(FixedBoundary\)",
        ),
        (
            [gso.SymmetryPlane([0, 0, 0], [1, 0, 0]), gso.Handle([6 * 13], [[0.1, 0, 0]])],
            r"0 \(SymmetryPlane\) and constraint 1 \(Handle\).*vertex 78",
        ),
        ([gso.Handle([1, 1], [[0, 0, 0], [1, 1, 1]])], r"0 \(Handle\) contradicts itself.*1"),
        ([gso.SymmetryPlane([0.1, 0, 0], [1, 0, 0])], "no mirror image of vertex"),
        ([gso.SymmetryPlane([0, 0, 0], [1, 0, 0], pairs=[[0, 1], [1, 2]])], "vertex 1 in more"),
        ([gso.SymmetryPlane([0, 0, 0], [0, 0, 0])], "must not be zero"),
        ([gso.SymmetryPlane([0, 0, np.nan], [1, 0, 0])], "a point"),
        ([gso.Glue([[0, 5], [5, 14]])], "corners 0 and 14 of face 0"),
        ([gso.Glue([[3, 3]])], "glues vertex 3 to itself"),
        ([gso.Glue([[1, 2], [3]])], "pairs of vertex indices"),
        ([gso.Glue([[1, 999]])], "vertex 999"),
        ([gso.PlanarFaces([-1])], "face -1"),
        ([gso.PlanarFaces(weight=0)], "weight 0"),
        ([gso.FixedLengths([[3, 4]], [0.0])], r"edge \(3, 4\)"),
        ([gso.FixedLengths([[3, 4]], [1.0, 2.0])], "length for each of 1"),
        ([gso.OnCurve([0], [[0, 0, 0]])], "2 points"),
        ([gso.OnCurve([0], [[0, 0, 0], [1, 0, 0]], closed=True)], "3 points"),
        ([gso.OnCurve([0], [[0, 0], [1, 0]])], r"\(k, 3\), got \(2, 2\)"),
        ([gso.Handle([0], [["a", 0, 0]])], "finite numbers"),
        ([gso.Fixed([0.5])], "vertex indices"),
        ([gso.Fixed([1, [2]])], "vertex indices"),
        ([gso.PlanarFaces([1, [2]])], "face indices"),
        ([gso.OnCurve([0], [[0, 0, 0], [1, 0, 0]], closed="false")], "closed 'false'"),
        ([gso.Handle([0, 1], [[0, 0, 0], [0, np.nan, 0]])], "row 1 is not"),
        ([gso.SlidingBoundary(corner=400)], "at most 180"),
        ([gso.Fixed], "none of those"),
        (7, "must be a list"),
    ],
)
def test_contradictions_and_bad_input_are_named(constraints, message):
    with pytest.raises(gso.OptionError, match=message):
        gso.tno.optimize(GRID, constraints=constraints)


@pytest.mark.parametrize(
    ("constraint", "message"),
    [
        (gso.FixedBoundary(), "Handle"),
        (gso.SlidingBoundary(), "OnCurve"),
        (gso.PlanarFaces(), "means nothing"),
        (gso.SymmetryPlane([0, 0], [1, 0]), "pairs"),
        (gso.SymmetryPlane([0, 0, 0], [1, 0, 0]), "2 finite"),
        (gso.Handle([0], [[0, 0, 0]]), r"\(1, 2\)"),
    ],
)
def test_what_means_nothing_in_the_plane_is_refused(constraint, message):
    with pytest.raises(gso.OptionError, match=message):
        gso.tno.optimize(FLAT, task="flatten", constraints=[constraint])


def test_what_offsets_along_normals_cannot_keep_is_refused():
    for constraint in (gso.Glue([[0, 99]]), gso.PlanarFaces(), gso.SlidingBoundary()):
        with pytest.raises(gso.OptionError, match="max_deviation"):
            gso.tno.optimize(GRID, max_deviation=0.1, constraints=[constraint])


@pytest.mark.parametrize(("task", "dim"), [("developable", 3), ("flatten", 2), ("denoise", 3)])
def test_what_cannot_be_met_is_said(task, dim):
    apart = np.zeros((2, dim))
    apart[1, 0] = 2.0
    constraints = [gso.Handle([0, 1], apart), gso.FixedLengths([[0, 1]], [1.0])]
    with pytest.warns(gso.ConvergenceWarning, match="constraints"):
        result = gso.tno.optimize(GRID, task=task, constraints=constraints)
    assert result.status is gso.Status.CONSTRAINTS_MISSED
    assert not result.converged
    assert not result.usable
    assert "constraint 1 (FixedLengths) is missed by 1 (vertices 0, 1)" in result.notes
    assert result.details["constraints"]["constraint 1 (FixedLengths)"] == pytest.approx(1.0)


def test_chains_and_rings_of_glue_are_solved_and_conflicts_in_them_found():
    n = 20_000
    mesh = Mesh.from_grid(saddle(100, 200))
    order = np.random.default_rng(0).permutation(n)
    ring = Relations(1, order, np.roll(order, 1), np.eye(3), np.zeros(3))
    parts = [Pins(0, np.array([7]), mesh.vertices[[7]]), ring]
    check(parts, ["pin", "ring"], mesh)
    _, basis, offset = reduce(parts).maps(0, 3 * n)
    assert basis.nnz == 0
    np.testing.assert_allclose(offset.reshape(-1, 3), np.tile(mesh.vertices[7], (n, 1)), atol=1e-12)
    parts.append(Pins(2, np.array([8]), mesh.vertices[[8]]))
    with pytest.raises(gso.OptionError, match="pin, ring and other contradict"):
        check(parts, ["pin", "ring", "other"], mesh)


def test_pieces_are_sewn_together_in_the_plane():
    strip = Mesh.from_grid(saddle(13, strength=0.1))
    turn = Rotation.from_rotvec([0, 0, 2.5]).as_matrix()
    other = strip.vertices @ turn.T + [0, 0, 3]
    two = Mesh(np.r_[strip.vertices, other], np.r_[strip.faces, strip.faces + 169])
    seam = np.c_[strip.grid_index[-1], strip.grid_index[0] + 169]
    result = gso.tno.optimize(two, task="flatten", constraints=[gso.Glue(seam)])
    np.testing.assert_allclose(result.flat[seam[:, 0]], result.flat[seam[:, 1]], atol=1e-12)
    assert result.metrics["flipped_cells"] == 0
    alone = gso.tno.optimize(strip, task="flatten").metrics["strain_mean"]
    assert result.metrics["strain_mean"] < 3 * alone


def test_two_planes_leave_a_line_and_three_a_point():
    planes = [gso.SymmetryPlane([0, 0, 0], n, pairs=[[5, 5]]) for n in np.eye(3)]
    for count in (1, 2, 3):
        compiled = compile_constraints(planes[:count], GRID)
        _, basis, _ = compiled.reduction.maps(0, 3 * len(V))
        used = np.unique(basis.tocsr()[15:18].indices)
        assert len(used) == 3 - count


def test_eliminated_unknowns_reach_all_that_is_allowed_and_nothing_else():
    constraints = [
        gso.SymmetryPlane([0, 0, 0], [1, 0, 0]),
        gso.Glue([[0, 12]]),
        gso.Handle([40], [[0.3, 0.1, 0.2]]),
    ]
    compiled = compile_constraints(constraints, GRID).mapped(
        Frame(np.array([0.1, 0.0, 0.0]), 2.0), np.arange(len(V))
    )
    layout = Layout.of(len(V), "surface")
    maps = compiled.reduction.maps(0, layout.size)
    rng = np.random.default_rng(0)
    for before in (unknowns.free(layout), normal_offsets(layout, V, vertex_normals(GRID))):
        variables = before.constrained(*maps)
        points = variables.points(rng.standard_normal(variables.size)).reshape(-1, 3)
        assert max(m.length for m in compiled.violations(points).values()) < 1e-12
        x = variables.project(points.ravel())
        np.testing.assert_allclose(variables.points(x).reshape(-1, 3), points, atol=1e-9)
    # Of 13 x 13 vertices, 6 x 13 have three freedoms and 13 on the plane two; one pair is
    # pinned, and the glued corners lose the freedom of one.
    assert unknowns.free(layout).constrained(*maps).size == 3 * 78 + 2 * 13 - 3 - 3


def test_files_of_constraints(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(
        json.dumps(
            [
                {"type": "Fixed", "ids": [0]},
                {"type": "Handle", "ids": [5], "positions": [[0, 0, 1]], "weight": 2.0},
                {"type": "SymmetryPlane", "point": [0, 0, 0], "normal": [1, 0, 0]},
            ]
        )
    )
    fixed, handle, mirror = read_constraints(path)
    assert isinstance(fixed, gso.Fixed)
    assert handle.weight == 2.0
    assert mirror.pairs is None
    for text, message in {
        "[": "no JSON",
        "{}": "a list",
        '[{"type": "Pink"}]': "Fixed, FixedBoundary",
        '[{"type": []}]': "entry 0 needs",
        '[{"type": "FixedBoundary", "ids": [0]}]': "takes no 'ids'; there are none",
        '[{"type": "Fixed", "id": [3]}]': "takes no 'id'; did you mean 'ids'",
        '[{"type": "Glue"}]': "pairs",
    }.items():
        path.write_text(text)
        with pytest.raises(gso.OptionError, match=message):
            read_constraints(path)
    with pytest.raises(gso.OptionError, match=r"no\.json"):
        read_constraints(tmp_path / "no.json")


def test_nearest_points_of_polylines():
    line = Polylines.of(np.array([[0.0, 0], [1, 0], [1, 1], [0.9, 2]]), closed=False)
    feet = line.nearest(np.array([[0.3, -1], [2, -1], [3, 0.5], [-4, 0.1]]))
    np.testing.assert_allclose(feet.points, [[0.3, 0], [1, 0], [1, 0.5], [0, 0]])
    # Open ends and the right angle end a slide, the slight turn does not.
    np.testing.assert_array_equal(line.stop, [[True, True], [True, False], [False, True]])
    np.testing.assert_allclose(line.tangent[1, 1], line.tangent[2, 0])


@dataclass(frozen=True)
class Within(Part):
    """Vertices at a distance `radius` from the point `centre`: a part from outside the package."""

    POSITIONS = ("centre",)
    LENGTHS = ("radius",)

    ids: np.ndarray
    centre: np.ndarray
    radius: float

    def violation(self, points):
        return np.abs(np.linalg.norm(points[self.ids] - self.centre, axis=1) - self.radius)

    def items(self, block):
        constants = np.r_[self.centre, self.radius, 0.0]
        term = Term(
            "sphere",
            on_sphere,
            ((block, self.vertices),),
            weights=np.ones(len(self.ids)),
            constants=np.repeat(constants[:, None], len(self.ids), axis=1),
        )
        return [Weighted(hardened(term), STIFF)]


def on_sphere(points, constants):
    away = geometry.sub(points[0], tuple(constants[:-2]))
    return (geometry.norm(away) - constants[-2] + constants[-1],)


@dataclass(frozen=True)
class OnSphere(Constraint):
    ids: tuple
    centre: tuple
    radius: float

    def parts(self, subject):
        return [Within(subject.number, np.array(self.ids), np.array(self.centre), self.radius)]


@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_a_constraint_from_outside_the_package(task):
    mesh = gso.Mesh.from_grid(saddle(9))
    dim = 2 if task == "flatten" else 3
    ids = (0, 8, 72, 80)
    sphere = OnSphere(ids, (0.0,) * dim, 1.35)
    result = gso.tno.optimize(mesh, task=task, constraints=[sphere])
    points = result.flat if dim == 2 else result.mesh.vertices
    np.testing.assert_allclose(np.linalg.norm(points[list(ids)], axis=1), 1.35, atol=1e-5)
