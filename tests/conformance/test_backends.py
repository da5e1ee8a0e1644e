"""Every linear backend solves every pattern like dense algebra, again and again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_matrix, random_array, tril

from gso import BackendError, OptionError, linalg
from gso.linalg import Pattern, SingularError


def banded(n: int, width: int, seed: int = 0) -> csc_matrix:
    rng = np.random.default_rng(seed)
    a = np.triu(np.tril(rng.standard_normal((n, n)), width), -width)
    return csc_matrix(a @ a.T + n * np.eye(n))


def scattered(n: int, seed: int = 0) -> csc_matrix:
    a = random_array((n, n), density=0.05, rng=seed).toarray()
    return csc_matrix(a @ a.T + np.eye(n))


MATRICES = {"banded": banded(60, 4), "scattered": scattered(80), "one": csc_matrix([[4.0]])}
INSTALLED = [k for k, m in linalg.backends().items() if m.available()]


def lower(matrix: csc_matrix) -> tuple[Pattern, np.ndarray]:
    low = tril(matrix, format="csc")
    low.sort_indices()
    pattern = Pattern(low.shape[0], low.indptr.astype(np.int64), low.indices.astype(np.int64))
    return pattern, low.data


@pytest.mark.parametrize("name", INSTALLED)
@pytest.mark.parametrize("kind", MATRICES)
def test_solutions_match_dense_algebra(name, kind):
    matrix = MATRICES[kind]
    pattern, values = lower(matrix)
    solver = linalg.choose(pattern, name)
    rng = np.random.default_rng(1)
    for factor in (1.0, 2.5):
        solver.factor(factor * values)
        for rhs in (rng.standard_normal(pattern.size), rng.standard_normal((pattern.size, 3))):
            expected = np.linalg.solve(factor * matrix.toarray(), rhs)
            np.testing.assert_allclose(solver.solve(rhs), expected, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("name", [k for k in INSTALLED if k != "superlu"])
def test_indefinite_matrices_are_refused(name):
    pattern, values = lower(csc_matrix(np.array([[1.0, 2.0], [2.0, 1.0]])))
    solver = linalg.choose(pattern, name)
    with pytest.raises(SingularError):
        solver.factor(values)
    solver.factor(np.array([3.0, 1.0, 3.0]))
    np.testing.assert_allclose(solver.solve(np.array([4.0, 4.0])), [1.0, 1.0])


def test_the_cheapest_installed_one_is_chosen():
    pattern, _ = lower(MATRICES["banded"])
    costs = {k: linalg.backends()[k].cost(pattern) for k in INSTALLED}
    assert linalg.choose(pattern).name == min(costs, key=costs.get)


def test_unknown_and_missing_backends_are_named(monkeypatch):
    pattern, _ = lower(MATRICES["one"])
    with pytest.raises(OptionError, match=r"nonsense.*cholmod"):
        linalg.choose(pattern, "nonsense")
    monkeypatch.setattr(linalg.backends()["cholmod"], "available", lambda: False)
    with pytest.raises(BackendError, match="pip install cvxopt"):
        linalg.choose(pattern, "cholmod")
