"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.solver.method import METHODS, Method
from gso.solver.minimiser import Callback, Minimum, Timings, minimise

__all__ = ["METHODS", "Callback", "Method", "Minimum", "Timings", "minimise"]
