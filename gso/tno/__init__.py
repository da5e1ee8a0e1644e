"""The traditional numerical optimiser: sparse Gauss-Newton on CasADi's derivatives."""

from gso.tasks.request import Start, check
from gso.tno.optimize import optimize
from gso.tno.optimize_many import optimize_many
from gso.tno.session import Session

#: The names in :data:`_BATCHED` are not among them, as they need PyTorch.
__all__ = ["Session", "Start", "check", "optimize", "optimize_many"]

#: Names that are imported on first use, and their modules.
_BATCHED = {"optimize_batch": "optimize_batch", "BatchWorkers": "workers"}


def __getattr__(name: str) -> object:
    if name not in _BATCHED:
        raise AttributeError(f"module 'gso.tno' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"gso.tno.batched.{_BATCHED[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_BATCHED])
