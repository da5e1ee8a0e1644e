"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.tno.solver.method import METHODS, Method
from gso.tno.solver.minimiser import Callback, Minimum, Timings, minimise

__all__ = ["METHODS", "Callback", "Method", "Minimum", "Timings", "minimise"]
