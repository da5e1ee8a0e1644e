"""The package's objective in the form of other solvers: residuals with Jacobian, or expressions.

All are built from the terms of a :class:`gso.solver.problem.Problem`, so that the
derivatives are the same to the last bit. Each loss is expressed by residuals, half of whose
squared norm it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.energy.losses import Absolute, Distance, Loss, Squared
from gso.mesh import Mesh
from gso.pipeline.case import Case
from gso.solver.kernels import casadi_function
from gso.solver.problem import Problem
from gso.tasks.request import check

Array = NDArray[np.float64]


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
    if isinstance(loss, Absolute):
        root = np.sqrt(r * r + loss.eps**2)
        factor = np.sqrt(2.0 / (root + loss.eps))
        return r * factor, same * (factor * (1.0 - r * r / (2.0 * root * (root + loss.eps))))
    if isinstance(loss, Distance):
        root = np.sqrt((r * r).sum(axis=0) + loss.eps**2)
        factor = np.sqrt(2.0 * loss.eps / (root + loss.eps))
        return r * factor, factor * (same - r[:, None] * r / (2.0 * root * (root + loss.eps)))
    raise TypeError(f"{type(loss).__name__} is no loss that this bench knows as a sum of squares")


def expressions(problem: Problem) -> tuple[Any, Any]:
    """Return CasADi symbols of the unknowns, and :func:`residuals` as their expression."""
    import casadi

    ca: Any = casadi
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
        rooted = _rooted_casadi(element.item.loss, one(point, constants))
        each = ca.Function("each", [point, constants, weight], [weight * rooted], {"cse": True})
        gathered = ca.reshape(coordinates[element.gather.T.ravel().tolist()], k, count)
        weights = np.sqrt(element.item.weight * element.weights)[None]
        parts.append(ca.vec(each.map(count)(gathered, ca.DM(element.constants), ca.DM(weights))))
    return x, ca.vertcat(*parts)


def _rooted_casadi(loss: Loss, r: Any) -> Any:
    import casadi

    ca: Any = casadi
    if isinstance(loss, Squared):
        return r
    if isinstance(loss, Absolute):
        return r * ca.sqrt(2.0 / (ca.sqrt(r * r + loss.eps**2) + loss.eps))
    if isinstance(loss, Distance):
        return r * ca.sqrt(2.0 * loss.eps / (ca.sqrt(ca.sumsqr(r) + loss.eps**2) + loss.eps))
    raise TypeError(f"{type(loss).__name__} is no loss that this bench knows as a sum of squares")


def _matrix(sparse: Any) -> Any:
    import casadi

    ca: Any = casadi
    columns = sparse.tocsc()
    columns.sort_indices()
    pattern = ca.Sparsity(*columns.shape, columns.indptr.tolist(), columns.indices.tolist())
    return ca.DM(pattern, columns.data)
