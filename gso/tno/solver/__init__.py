"""The generic solver: sums of terms over unknowns, minimised by Gauss-Newton iterations."""

from gso.tno.solver.minimiser import Callback, Solution, Timings, minimise

__all__ = ["Callback", "Solution", "Timings", "minimise"]
