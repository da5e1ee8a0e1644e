"""Hybrid solves: a net predicts a warm start, and the optimiser refines it."""

from gso.hybrid.solving import solve, solve_many
from gso.hybrid.time_model import expected_seconds, load_seconds, net_saves_time
from gso.hybrid.two_starts import better_start

__all__ = [
    "better_start",
    "expected_seconds",
    "load_seconds",
    "net_saves_time",
    "solve",
    "solve_many",
]
