"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.solver.directions import METHODS
from gso.solver.minimiser import Callback, Minimum, Timings, minimise

__all__ = ["METHODS", "Callback", "Minimum", "Timings", "minimise"]
