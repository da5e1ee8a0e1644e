"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.solver.directions import GaussNewton, LevenbergMarquardt, LinearSolver
from gso.solver.kernels import casadi_function, casadi_geometric_stiffness
from gso.solver.method import METHODS, Method
from gso.solver.minimiser import Callback, Minimum, Timings, minimise
from gso.solver.problem import Problem, energies, largest_counts

__all__ = [
    "METHODS",
    "Callback",
    "GaussNewton",
    "LevenbergMarquardt",
    "LinearSolver",
    "Method",
    "Minimum",
    "Problem",
    "Timings",
    "casadi_function",
    "casadi_geometric_stiffness",
    "energies",
    "largest_counts",
    "minimise",
]
