"""Sparse symmetric positive definite solvers: one file per backend, found by name.

A backend module defines ``available()``, ``cost(pattern)`` (seconds of one numeric
factorisation, roughly: who is fastest) and a class ``Solver(pattern)`` with
``factor(values)`` and ``solve(rhs)``.
"""

from __future__ import annotations

from types import ModuleType

from gso.errors import BackendError, OptionError
from gso.linalg.base import Pattern, SingularError, Solver, blas_threads
from gso.linalg.spd import spd
from gso.registry import Plugins, Registry, lacks
from gso.spelling import choices

__all__ = ["Pattern", "SingularError", "add", "backends", "blas_threads", "choose", "find", "spd"]

_MODULES = Registry(
    __name__,
    __path__,
    ("base", "spd"),
    Plugins("gso.backends", lacks("available", "cost", "Solver")),
)
#: Register a backend module from outside the package: ``add(name, module)``.
add = _MODULES.add


def backends() -> dict[str, ModuleType]:
    """Every backend module by name, installed or not."""
    return _MODULES.modules()


def find(name: str) -> ModuleType:
    """Module of an installed backend.

    Raises
    ------
    OptionError, BackendError
        There is no such backend; it needs a package that is not installed.
    """
    if name not in _MODULES.names():
        raise OptionError(f"no linear backend {name!r}; {choices(name, _MODULES.names())}")
    backend = _MODULES.get(name)
    if not backend.available():
        raise BackendError(f"backend {name!r} needs a package: pip install {backend.PACKAGE}")
    return backend


def choose(pattern: Pattern, name: str | None = None) -> Solver:
    """Solver of the named backend, or of the fastest installed one for this pattern."""
    if name is not None:
        backend = find(name)
    else:
        usable = [m for m in backends().values() if m.available()]
        backend = min(usable, key=lambda m: m.cost(pattern))
    solver: Solver = backend.Solver(pattern)
    return solver
