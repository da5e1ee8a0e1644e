"""Sparse symmetric positive definite solvers: one file per backend, found by name.

A backend module defines ``available()``, ``cost(pattern)`` (seconds of one numeric
factorisation, roughly: who is fastest) and a class ``Solver(pattern)`` with
``factor(values)`` and ``solve(rhs)``.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType
from typing import Any

from gso.errors import BackendError, OptionError
from gso.linalg.base import Pattern, SingularError, blas_threads
from gso.linalg.spd import spd
from gso.spelling import choices

__all__ = ["Pattern", "SingularError", "backends", "blas_threads", "choose", "find", "spd"]

_SUPPORT = ("base", "spd")


def backends() -> dict[str, ModuleType]:
    """Every backend module of this folder by name, installed or not."""
    return {
        info.name: importlib.import_module(f"{__name__}.{info.name}")
        for info in pkgutil.iter_modules(__path__)
        if info.name not in _SUPPORT
    }


def find(name: str) -> ModuleType:
    """Module of an installed backend.

    Raises
    ------
    OptionError, BackendError
        There is no such backend; it needs a package that is not installed.
    """
    found = backends()
    if name not in found:
        raise OptionError(f"no linear backend {name!r}; {choices(name, sorted(found))}")
    if not found[name].available():
        raise BackendError(f"backend {name!r} needs a package: pip install {found[name].PACKAGE}")
    return found[name]


def choose(pattern: Pattern, name: str | None = None) -> Any:
    """Solver of the named backend, or of the fastest installed one for this pattern."""
    if name is not None:
        return find(name).Solver(pattern)
    usable = [m for m in backends().values() if m.available()]
    return min(usable, key=lambda m: m.cost(pattern)).Solver(pattern)
