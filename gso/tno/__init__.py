"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from gso.tno.batch import optimize_many
from gso.tno.optimize import check, optimize
from gso.tno.session import Session
from gso.tno.start import Start

__all__ = ["Session", "Start", "check", "optimize", "optimize_many"]
