"""The net starts the optimiser, the optimiser finishes the net."""

from gso.hybrid.solving import solve, solve_many

__all__ = ["solve", "solve_many"]
