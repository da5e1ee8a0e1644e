"""Tasks: one file each, found by name.

A task module defines ``FORMULATIONS`` (the first is the default), an ``Options``
dataclass with presets, ``plan(request)`` and ``metrics(...)``; see :mod:`gso.tasks.base`.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

from gso.status import OptionError

_SUPPORT = ("base", "held", "joint", "options")


def names() -> list[str]:
    """Names of the tasks."""
    return sorted(info.name for info in pkgutil.iter_modules(__path__) if info.name not in _SUPPORT)


def get(name: str) -> ModuleType:
    """Module of a task."""
    if name not in names():
        raise OptionError(f"no task {name!r}; there are {', '.join(names())}")
    return importlib.import_module(f"{__name__}.{name}")
