"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from gso.tno.batch import optimize_many
from gso.tno.optimize import optimize

__all__ = ["optimize", "optimize_many"]
