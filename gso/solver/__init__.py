"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.solver.directions import METHODS, GaussNewton
from gso.solver.kernels import casadi_function
from gso.solver.minimiser import Callback, Minimum, Timings, minimise
from gso.solver.problem import Problem

__all__ = [
    "METHODS",
    "Callback",
    "GaussNewton",
    "Minimum",
    "Problem",
    "Timings",
    "casadi_function",
    "minimise",
]
