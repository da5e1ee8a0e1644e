"""Energy terms: one module each, registered by name.

A term is a stencil, constants per element, and the residual of *one* element, written
once for NumPy, torch and CasADi numbers. Any module of this package that defines
``residual`` is in the registry, where the conformance tests find it.
"""

from __future__ import annotations

from types import ModuleType

from gso.energy.base import Limit, Term, Weighted, mean_weights
from gso.energy.losses import Absolute, Distance, Loss, Squared
from gso.energy.multipliers import STIFF, hardened
from gso.registry import Plugins, Registry, lacks

__all__ = [
    "STIFF",
    "Absolute",
    "Distance",
    "Limit",
    "Loss",
    "Squared",
    "Term",
    "Weighted",
    "add",
    "hardened",
    "mean_weights",
    "registry",
]

_MODULES = Registry(__name__, __path__, plugins=Plugins("gso.terms", lacks("residual", "build")))
#: Register a term module from outside the package: ``add(name, module)``.
add = _MODULES.add


def registry() -> dict[str, ModuleType]:
    """Return every term module by name."""
    found = _MODULES.modules()
    return {name: module for name, module in found.items() if hasattr(module, "residual")}
