"""The solver's promises: monotone, best iterate, bounds, callback, gradients, fixed pattern."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import gso
from gso import Progress, Status, energy, linalg
from gso import unknowns as kinds
from gso.constraints import compile_constraints
from gso.energy import Absolute, Distance, Weighted
from gso.mesh import Mesh, vertex_normals
from gso.solver import METHODS, Problem, minimise
from gso.unknowns import Layout, Variables, normal_offsets, spline_offsets, spline_surface
from tests.conftest import saddle

curvature, fairness, position, proximity = map(
    energy.registry().get, ("curvature", "fairness", "position", "proximity")
)

MESH = Mesh.from_grid(saddle(13, 11))
LAYOUT = Layout((("surface", len(MESH.vertices), 3),))
NORMALS = vertex_normals(MESH)
ACROSS, PAIRS = ([0, 0, 0], [1, 2, 0.5]), [[3, 3], [20, 30], [50, 60]]


def items() -> list[Weighted]:
    return [
        *(Weighted(t, 3e-3, Absolute(0.05)) for t in curvature.build(MESH)),
        Weighted(fairness.build(MESH), 1e-5),
        Weighted(proximity.build(MESH, NORMALS, tangential=0.7), 1.0, Distance(0.05)),
        Weighted(position.build(np.array([5]), MESH.vertices[[5]] + 0.01, np.ones(1)), 0.1),
    ]


def held(*constraints) -> Variables:
    reduction = compile_constraints(constraints, MESH).reduction
    return kinds.free(LAYOUT).constrained(*reduction.maps(0, LAYOUT.size))


def unknowns() -> dict:
    return {
        "free": kinds.free(LAYOUT),
        "normal": normal_offsets(LAYOUT, MESH.vertices, NORMALS),
        "spline-offsets": spline_offsets(LAYOUT, MESH.vertices, NORMALS, (13, 11), (6, 5)),
        "spline-surface": spline_surface(LAYOUT, (13, 11), (9, 8)),
        "fixed": held(gso.Fixed([0, 1, 2])),
        "glued": held(gso.Glue([[0, 60], [60, 14]]), gso.SymmetryPlane(*ACROSS, pairs=PAIRS)),
    }


KINDS = list(unknowns())


@pytest.mark.parametrize("kind", KINDS)
def test_gradient_is_that_of_the_energy(kind):
    variables = unknowns()[kind]
    problem = Problem(items(), variables)
    rng = np.random.default_rng(0)
    x = variables.project(MESH.vertices.ravel()) + 0.02 * rng.standard_normal(variables.size)
    energy, gradient, _ = problem.linearise(x)
    assert energy == pytest.approx(problem.energy(x))
    for _ in range(3):
        d = rng.standard_normal(variables.size)
        h = 1e-6
        numeric = (problem.energy(x + h * d) - problem.energy(x - h * d)) / (2 * h)
        assert gradient @ d == pytest.approx(numeric, rel=2e-5, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_matrix_is_that_of_dense_assembly(kind):
    variables = unknowns()[kind]
    x = variables.project(MESH.vertices.ravel())
    whole = [i for i in items() if i.quadratic]
    problem = Problem(whole, variables)
    _, gradient, values = problem.linearise(x)
    n = variables.size
    dense = np.zeros((n, n))
    dense[problem.pattern.indices, problem.pattern.columns] = values
    dense += np.tril(dense, -1).T
    d = np.random.default_rng(1).standard_normal(n)
    change = problem.linearise(x + d)[1] - gradient
    np.testing.assert_allclose(dense @ d, change, atol=1e-9 * np.abs(change).max())


@pytest.mark.parametrize("kind", ["normal", "spline-offsets", "spline-surface"])
def test_project_inverts_points(kind):
    variables = unknowns()[kind]
    x = np.random.default_rng(2).standard_normal(variables.size)
    np.testing.assert_allclose(variables.project(variables.points(x)), x, atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", KINDS)
def test_energy_falls_monotonically_and_the_best_comes_back(kind, method):
    variables = unknowns()[kind]
    problem = Problem(items(), variables)
    x = variables.project(MESH.vertices.ravel())
    before = problem.energy(x)
    solution = minimise(problem, x, iterations=12, method=method)
    energies = [p.energy for p in solution.history]
    assert all(b <= a * (1 + 1e-12) for a, b in pairwise(energies))
    assert solution.energy == pytest.approx(problem.energy(solution.x))
    assert solution.energy < before
    assert sum(problem.by_term(solution.x).values()) == pytest.approx(solution.energy)
    assert energies[0] == pytest.approx(before)


@pytest.mark.parametrize("backend", [k for k, m in linalg.backends().items() if m.available()])
def test_backends_give_the_same_result(backend):
    variables = unknowns()["normal"]
    x = np.zeros(variables.size)
    reference = minimise(Problem(items(), variables), x, iterations=8, backend="superlu")
    other = minimise(Problem(items(), variables), x, iterations=8, backend=backend)
    np.testing.assert_allclose(other.x, reference.x, atol=1e-7)
    assert other.backend == backend


def test_a_falling_epsilon_reports_the_last_one():
    variables = unknowns()["normal"]
    problem = Problem(items(), variables)
    losses = [Absolute(eps) for eps in (0.5, 0.1, 0.05)]
    solution = minimise(
        problem, np.zeros(variables.size), iterations=9, continuation=losses, continued="curvature"
    )
    fresh = Problem(items(), variables)
    assert solution.energy == pytest.approx(fresh.energy(solution.x))


def test_bounds_hold_at_every_iterate():
    variables = unknowns()["normal"]
    problem = Problem(items(), variables)
    bound = np.full(variables.size, 0.004)
    solution = minimise(problem, np.zeros(variables.size), iterations=15, bounds=(-bound, bound))
    assert np.abs(solution.x).max() <= 0.004
    assert (np.abs(solution.x) > 0.0039).any()
    loose = minimise(problem, np.zeros(variables.size), iterations=15)
    assert loose.energy < solution.energy < problem.energy(np.zeros(variables.size))


def test_the_callback_sees_every_iteration_and_can_stop():
    variables = unknowns()["normal"]
    problem = Problem(items(), variables)
    seen: list[Progress] = []

    def stop_at_three(progress: Progress) -> bool:
        seen.append(progress)
        return progress.iteration < 3

    solution = minimise(problem, np.zeros(variables.size), iterations=10, callback=stop_at_three)
    assert solution.status is Status.CANCELLED
    assert [p.iteration for p in seen] == [0, 1, 2, 3]
    assert sum(seen[-1].by_term.values()) == pytest.approx(seen[-1].energy)


def test_the_pattern_is_worked_out_once():
    variables = unknowns()["normal"]
    first, second = Problem(items(), variables), Problem(items(), variables)
    assert first.pattern is second.pattern


def test_held_coordinates_stay():
    variables = unknowns()["fixed"]
    solution = minimise(
        Problem(items(), variables), variables.project(MESH.vertices.ravel()), iterations=5
    )
    np.testing.assert_array_equal(variables.points(solution.x)[:9], MESH.vertices.ravel()[:9])


@pytest.mark.parametrize("kind", KINDS)
def test_the_sorting_and_the_table_analysis_agree(kind, monkeypatch):
    variables = unknowns()[kind]
    x = variables.project(MESH.vertices.ravel())
    table = Problem(items(), variables)
    one = table.linearise(x)
    monkeypatch.setattr("gso.solver.ranking._LARGEST_TABLE", 0)
    sorting = Problem(items(), variables)
    for name in ("indptr", "indices"):
        np.testing.assert_array_equal(getattr(sorting.pattern, name), getattr(table.pattern, name))
    for a, b in zip(sorting.linearise(x), one, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("held_ids", [[], [0, 5]])
def test_an_element_may_name_a_vertex_twice(held_ids):
    # Not quadratic by name, but in fact: the gradient's change is the matrix times the step.
    term = fairness.build(MESH)
    triples = term.stencil[0][1].copy()
    triples[:, 2] = triples[:, 1]
    twice = replace(term, stencil=(("surface", triples),), linear=False)
    variables = held(gso.Fixed(held_ids)) if held_ids else kinds.free(LAYOUT)
    problem = Problem([Weighted(twice, 1.0)], variables)
    x = variables.project(MESH.vertices.ravel())
    _, gradient, values = problem.linearise(x)
    dense = np.zeros((variables.size, variables.size))
    dense[problem.pattern.indices, problem.pattern.columns] = values
    dense += np.tril(dense, -1).T
    d = np.random.default_rng(1).standard_normal(variables.size)
    change = problem.linearise(x + d)[1] - gradient
    np.testing.assert_allclose(dense @ d, change, atol=1e-9 * np.abs(change).max())


def test_a_problem_takes_over_the_sparsity_of_one_like_it(monkeypatch):
    variables = unknowns()["normal"]
    first = Problem(items(), variables)
    pattern = first.pattern
    monkeypatch.setattr("gso.solver.assembly._analyse", None)
    assert Problem(items(), variables, like=first).pattern is pattern
    with pytest.raises(TypeError):
        Problem(items()[:1], variables, like=first).pattern  # noqa: B018
