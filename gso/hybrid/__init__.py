"""Hybrid solves: a net predicts a warm start, and the optimiser refines it."""

from gso.hybrid.solving import solve, solve_many
from gso.hybrid.time_model import net_saves_time

__all__ = ["net_saves_time", "solve", "solve_many"]
