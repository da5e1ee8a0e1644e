"""Energy terms: one module each, registered by name.

A term is a stencil, constants per element, and the residual of *one* element, written
once for NumPy, torch and CasADi numbers. Any module of this package that defines
``residual`` is in the registry. It also defines ``examples`` for the conformance tests,
which find it there.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

from gso.energy.base import Limit, Term, Weighted

__all__ = ["Limit", "Term", "Weighted", "registry"]


def registry() -> dict[str, ModuleType]:
    """Return every term module of this package by name."""
    found = {}
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        if hasattr(module, "residual"):
            found[info.name] = module
    return found
