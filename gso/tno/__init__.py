"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from gso.tasks.start import Start
from gso.tno.optimize import check, optimize
from gso.tno.optimize_many import optimize_many
from gso.tno.session import Session

#: ``optimize_batch`` is not among them, as it needs PyTorch.
__all__ = ["Session", "Start", "check", "optimize", "optimize_many"]


def __getattr__(name: str) -> object:
    if name != "optimize_batch":
        raise AttributeError(f"module 'gso.tno' has no attribute {name!r}")
    from importlib import import_module

    value = import_module("gso.tno.batched.optimize_batch").optimize_batch
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "optimize_batch"])
