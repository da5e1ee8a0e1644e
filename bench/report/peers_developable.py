"""Other solvers on the package's objective, and MeshLab's filter, on the developable task.

The objective is that of the preset ``balanced`` on the design's own grid. The unknowns are offsets
along the design's normals, and the start is the design itself, without the coarser grids that
``balanced`` begins with. One row is the package's own iteration on the same problem.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import harness
import numpy as np

import gso
from gso.mesh import Mesh
from gso.pipeline import Canonical
from gso.solver import Problem, minimise
from report import energy
from report.energy import last_problem
from report.method import Array, Method, Solved, combinations
from report.peers_denoise import meshlab
from report.surfaces import Case

#: Relative decrease of the objective at which each solver stops, and most iterations of each.
TOLERANCE, ITERATIONS = 1e-5, 50
_PROBLEM = ("developable", "balanced")
#: Names of the rows that compare the solvers.
SAME_ENERGY = ("balanced, all of it", "Levenberg-Marquardt of gso", "least_squares", "IPOPT")


def _whole(case: Case) -> Solved:
    result = gso.tno.optimize(case.given, verdict=False)

    def left() -> dict[str, float]:
        return _ratio(harness.energy(result), *last_problem(case.given, *_PROBLEM))

    return Solved(np.asarray(result.grid), result.iterations, left)


def _from_the_design(
    solve: Callable[[Problem, Array], tuple[Array, int]],
) -> Callable[[Case], Solved]:
    """Return a solver of the problem as one of cases, in the frame of the design."""

    def run(case: Case) -> Solved:
        problem, start = last_problem(case.given, *_PROBLEM)
        x, iterations = solve(problem, start)
        frame = Canonical(Mesh.from_grid(case.given, weld=False))
        at = frame.back("surface", problem.variables.points(x).reshape(-1, 3))
        points = frame.frame.to_user(at).reshape(case.given.shape)
        return Solved(points, iterations, lambda: _ratio(problem.energy(x), problem, start))

    return run


def _ratio(energy: float, problem: Problem, start: Array) -> dict[str, float]:
    return {"objective_ratio": energy / problem.energy(start)}


@_from_the_design
def _own(problem: Problem, x: Array) -> tuple[Array, int]:
    given = {"iterations": ITERATIONS, "tolerance": TOLERANCE, "method": "levenberg-marquardt"}
    found = minimise(problem, x, **given)
    return found.x, found.iterations


@_from_the_design
def _least_squares(problem: Problem, x: Array) -> tuple[Array, int]:
    from scipy.optimize import least_squares

    residuals, jacobian = (partial(f, problem) for f in (energy.residuals, energy.jacobian))
    stop = {"ftol": TOLERANCE, "xtol": 1e-12, "gtol": 1e-12, "max_nfev": ITERATIONS}
    found = least_squares(residuals, x, jacobian, tr_solver="lsmr", x_scale="jac", **stop)
    return found.x, int(found.nfev)


@_from_the_design
def _ipopt(problem: Problem, x: Array) -> tuple[Array, int]:
    import casadi as ca

    unknowns, value = energy.expressions(problem)
    slope = ca.jacobian(value, unknowns)
    factor, none = ca.MX.sym("lam_f"), ca.MX.sym("none", 0)
    matrix = ca.triu(factor * ca.mtimes(slope.T, slope))
    hessian = ca.Function("hessian", [unknowns, none, factor, none], [matrix])
    options = {"hess_lag": hessian, "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    options |= {"ipopt.max_iter": ITERATIONS, "ipopt.acceptable_tol": 1e-5}
    options |= {"ipopt.acceptable_obj_change_tol": TOLERANCE}
    aim = {"x": unknowns, "f": 0.5 * ca.sumsqr(value)}
    solver = ca.nlpsol("solver", "ipopt", aim, options)
    return np.asarray(solver(x0=x)["x"]).ravel(), solver.stats()["iter_count"]


def _same(name: str, run: Callable[[Case], Solved], note: str, kernels: bool = True) -> Method:
    kind = {"peer": name in SAME_ENERGY[2:], "pace": "peer", "solver": True, "kernels": kernels}
    return Method(name, "developable", run, note=note, **kind)


METHODS = [
    _same(SAME_ENERGY[0], _whole, "coarse grids first"),
    _same(SAME_ENERGY[1], _own, "on the one grid, from the design"),
    _same(SAME_ENERGY[2], _least_squares, "SciPy: trust region, LSMR, the same Jacobian"),
    _same(
        SAME_ENERGY[3],
        _ipopt,
        "CasADi's expressions of the same terms, Gauss-Newton matrix; time with building them",
        kernels=False,
    ),
    Method(
        "MeshLab developability",
        "developable",
        partial(meshlab, "developability_of_mesh", edgeflips=False, edgecollapses=False),
        peer=True,
        note="Stein et al. 2018, of hinges; tuned",
        needs=("pymeshlab",),
        candidates=combinations(maxfunevals=(10, 50, 200), stepsize=(1e-4, 1e-3, 1e-2)),
    ),
]
