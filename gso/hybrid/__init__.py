"""Hybrid solves: a net predicts a warm start, and the optimiser refines it."""

from gso.hybrid.solving import solve, solve_many

__all__ = ["solve", "solve_many"]
