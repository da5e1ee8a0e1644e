"""Tasks: one file each, found by name.

A task module defines ``FORMULATIONS`` (the first is the default), an ``Options``
dataclass with presets, ``plan(analysis, request)`` and ``metrics(...)``; see :mod:`gso.tasks.base`.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

from gso.errors import OptionError
from gso.registry import Registry
from gso.spelling import choices

if TYPE_CHECKING:
    from gso.constraints import Compiled
    from gso.mesh import Mesh
    from gso.tasks.base import Analysis
    from gso.tasks.options import Options

_MODULES = Registry(
    __name__,
    __path__,
    ("base", "constrained", "evaluation", "imposed", "options", "per_component"),
)
#: Register a task module from outside the package: ``add(name, module)``.
add = _MODULES.add


def names() -> list[str]:
    """List the names of the tasks."""
    return _MODULES.names()


def choose(module: ModuleType, formulation: str | None, options: Any) -> tuple[str, type[Options]]:
    """Return the formulation to use and the class of its settings.

    Without a name, the preset or the class of `options` determines the formulation; failing
    that, it is the task's default.
    """
    kinds: dict[str, type[Options]] = getattr(module, "OPTIONS", {})
    implied = getattr(module, "IMPLIES", {}).get(options) if isinstance(options, str) else None
    if formulation is None:
        of_class = (name for name, kind in kinds.items() if type(options) is kind)
        formulation = implied or next(of_class, module.FORMULATIONS[0])
    if formulation not in module.FORMULATIONS:
        raise OptionError(
            f"task {module.__name__.rpartition('.')[2]!r} has no formulation {formulation!r}; "
            + choices(formulation, module.FORMULATIONS)
        )
    if implied not in (None, formulation):
        raise OptionError(
            f"options {options!r} are those of the formulation {implied!r}, not {formulation!r}"
        )
    return formulation, kinds.get(formulation, module.Options)


def get(name: str) -> ModuleType:
    """Import the module of a task."""
    if name not in names():
        raise OptionError(f"no task {name!r}; {choices(name, names())}")
    return _MODULES.get(name)


def analyse(module: ModuleType, mesh: Mesh, constraints: Compiled) -> Analysis:
    """Analyse a design for a task.

    Parameters
    ----------
    module : module
        The task.
    mesh : Mesh
        The design, scaled to the unit ball, with grids numbered row by row.
    constraints : Compiled
        Constraints on it, in the same frame and numbering.
    """
    from gso.tasks import base

    made: Analysis = getattr(module, "Analysis", base.Analysis)(mesh, constraints)
    return made
