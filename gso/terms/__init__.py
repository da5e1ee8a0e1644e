"""Energy terms: one file each, found by name.

A term is a stencil, constants per element, and the residual of *one* element, written
once for any kind of number. A file in this folder that defines ``residual`` and
``examples`` is a registered term: the conformance tests pick it up, nothing else changes.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

from gso.terms.base import Limit, Term, Weighted

__all__ = ["Limit", "Term", "Weighted", "registry"]


def registry() -> dict[str, ModuleType]:
    """Every term module of this folder by name."""
    found = {}
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        if hasattr(module, "residual"):
            found[info.name] = module
    return found
