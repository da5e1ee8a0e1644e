"""The package's objective in the form of other solvers: residuals with Jacobian, or expressions.

All are built from the terms of a :class:`gso.solver.problem.Problem`, so that the
derivatives are the same to the last bit. Each loss is expressed by residuals, half of whose
squared norm it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gso.energy import Absolute, Distance, Loss, Squared
from gso.mesh import Mesh
from gso.pipeline import Case
from gso.solver import Problem, casadi_function
from gso.tasks import check
from gso.typing import Array


def last_problem(points: np.ndarray, task: str, options: str) -> tuple[Any, np.ndarray]:
    """Return the problem of a task's last stage, and unknowns to evaluate it at."""
    case = Case(check(task, options=options), Mesh.from_grid(points))
    plan = case.task.plan(case.analysis, case.solver_request)
    coordinates = plan.start
    for stage in plan.stages:
        coordinates = stage.enter(coordinates)
    variables = plan.stages[-1].unknowns(coordinates)
    problem = Problem(plan.stages[-1].items, variables, plan.stages[-1].limits)
    return problem, variables.project(coordinates)


def residuals(problem: Problem, x: Array) -> Array:
    """Return residuals of which half the sum of squares is the objective."""
    coordinates = problem.variables.points(x)
    quadratic = problem._quadratic
    parts = [quadratic.a @ x - quadratic.b]
    for element in problem._elements:
        value, _ = _rooted(element.item.loss, element.residual(coordinates))
        parts.append((value * np.sqrt(element.item.weight * element.weights)).ravel())
    return np.concatenate(parts)


def jacobian(problem: Problem, x: Array) -> Any:
    """Return the sparse Jacobian of :func:`residuals`."""
    from scipy.sparse import csr_matrix, vstack

    coordinates = problem.variables.points(x)
    parts = [problem._quadratic.a]
    for element in problem._elements:
        value, slope = element.linearise(coordinates)
        _, outer = _rooted(element.item.loss, value)
        slope = np.einsum("rse,sqe->rqe", outer, slope)
        slope *= np.sqrt(element.item.weight * element.weights)
        r, _, count = slope.shape
        row = np.broadcast_to(np.arange(r * count).reshape(r, 1, count), slope.shape)
        column = np.broadcast_to(element.columns, slope.shape)
        keep = column < problem.variables.size
        shape = (r * count, problem.variables.size)
        parts.append(csr_matrix((slope[keep], (row[keep], column[keep])), shape=shape))
    return vstack(parts).tocsr()


def _rooted(loss: Loss, r: Array) -> tuple[Array, Array]:
    """Return numbers of which half the squared norm is the loss, and their derivatives (r, r, e).

    `r` are the residuals of the elements, (r, e).
    """
    same = np.eye(len(r))[:, :, None]
    if isinstance(loss, Squared):
        return r, np.broadcast_to(same, (len(r), *r.shape))
    root, factor = _factor(loss, r, np.sqrt, lambda squares: squares.sum(axis=0))
    outer = r[:, None] * r * (same if isinstance(loss, Absolute) else 1.0)
    return r * factor, factor * (same - outer / (2.0 * root * (root + loss.eps)))


def _factor(loss: Loss, r: Any, sqrt: Callable[[Any], Any], total: Callable[[Any], Any]) -> Any:
    """Return the smoothed size of residuals, and the factor that makes squares of them the loss."""
    if not isinstance(loss, Absolute | Distance):
        raise TypeError(f"{type(loss).__name__} is no loss that this bench knows as sum of squares")
    single = isinstance(loss, Absolute)
    root = sqrt((r * r if single else total(r * r)) + loss.eps**2)
    return root, sqrt(2.0 * (1.0 if single else loss.eps) / (root + loss.eps))


def expressions(problem: Problem) -> tuple[Any, Any]:
    """Return CasADi symbols of the unknowns, and :func:`residuals` as their expression."""
    import casadi as ca

    variables, quadratic = problem.variables, problem._quadratic
    x = ca.MX.sym("x", variables.size)
    coordinates = x
    if variables.basis is not None:
        coordinates = ca.mtimes(_matrix(variables.basis), x) + variables.offset
    parts = [ca.mtimes(_matrix(quadratic.a), x) - quadratic.b]
    for element in problem._elements:
        k, count = element.gather.shape
        one = casadi_function(
            element.item.term.residual, element.shape, len(element.constants), False
        )
        point, constants = ca.SX.sym("p", k), ca.SX.sym("c", len(element.constants))
        weight = ca.SX.sym("w")
        loss, rooted = element.item.loss, one(point, constants)
        if not isinstance(loss, Squared):
            rooted *= _factor(loss, rooted, ca.sqrt, ca.sum1)[1]
        each = ca.Function("each", [point, constants, weight], [weight * rooted], {"cse": True})
        gathered = ca.reshape(coordinates[element.gather.T.ravel().tolist()], k, count)
        weights = np.sqrt(element.item.weight * element.weights)[None]
        parts.append(ca.vec(each.map(count)(gathered, ca.DM(element.constants), ca.DM(weights))))
    return x, ca.vertcat(*parts)


def _matrix(sparse: Any) -> Any:
    import casadi as ca

    columns = sparse.tocsc()
    columns.sort_indices()
    pattern = ca.Sparsity(*columns.shape, columns.indptr.tolist(), columns.indices.tolist())
    return ca.DM(pattern, columns.data)
