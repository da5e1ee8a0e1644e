"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from typing import Any

from gso.tno.batch import optimize_many
from gso.tno.optimize import check, optimize
from gso.tno.session import Session
from gso.tno.start import Start

__all__ = ["Session", "Start", "check", "optimize", "optimize_batch", "optimize_many"]


def __getattr__(name: str) -> Any:
    if name != "optimize_batch":
        raise AttributeError(f"module 'gso.tno' has no attribute {name!r}")
    # Imported on first use, as it loads PyTorch.
    from importlib import import_module
    from importlib.util import find_spec

    from gso.errors import BackendError

    if find_spec("torch") is None:
        raise BackendError('batched solves need torch: pip install ".[net]" in the folder of gso')
    value = import_module("gso.tno.batched.optimize").optimize_batch
    globals()[name] = value
    return value
