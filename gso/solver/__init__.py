"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.solver.directions import GaussNewton
from gso.solver.kernels import casadi_function
from gso.solver.method import METHODS, Method
from gso.solver.minimiser import Callback, Minimum, Timings, minimise
from gso.solver.problem import Problem

__all__ = [
    "METHODS",
    "Callback",
    "GaussNewton",
    "Method",
    "Minimum",
    "Problem",
    "Timings",
    "casadi_function",
    "minimise",
]
