"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from gso.first_use import at_first_use
from gso.tasks.start import Start
from gso.tno.optimize import check, optimize
from gso.tno.optimize_many import optimize_many
from gso.tno.session import Session

#: ``optimize_batch`` is not among them, as it needs PyTorch.
__all__ = ["Session", "Start", "check", "optimize", "optimize_many"]

__getattr__, __dir__ = at_first_use(__name__, {"batched.optimize_batch": "optimize_batch"})
