"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from typing import Any

from gso.tno.batch import optimize_many
from gso.tno.optimize import check, optimize
from gso.tno.session import Session
from gso.tno.start import Start

#: ``optimize_batch`` is not among them, as it needs PyTorch.
__all__ = ["Session", "Start", "check", "optimize", "optimize_many"]


def __getattr__(name: str) -> Any:
    if name != "optimize_batch":
        raise AttributeError(f"module 'gso.tno' has no attribute {name!r}")
    from importlib import import_module

    # Imported on first use, as it loads PyTorch.
    value = import_module("gso.tno.batched.optimize").optimize_batch
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "optimize_batch"])
