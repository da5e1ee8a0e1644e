"""Tasks: one file each, which exports its :class:`gso.tasks.base.Task` as ``TASK``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.errors import OptionError
from gso.first_use import at_first_use
from gso.registry import Plugins, Registry, lacks
from gso.spelling import choices

if TYPE_CHECKING:
    from gso.tasks.base import Formulation, Plan, Stage, Task
    from gso.tasks.evaluation import compute_metrics, largest_strain
    from gso.tasks.options import Options
    from gso.tasks.request import Limits, check
    from gso.tasks.start import Start

__all__ = [
    "Formulation",
    "Limits",
    "Options",
    "Plan",
    "Stage",
    "Start",
    "Task",
    "add",
    "check",
    "choose",
    "compute_metrics",
    "get",
    "largest_strain",
    "names",
]

# The names of tasks are read without NumPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "base": "Formulation Plan Stage Task",
        "evaluation": "compute_metrics largest_strain",
        "options": "Options",
        "request": "Limits check",
        "start": "Start",
    },
)

_SUPPORT = (
    "base constrained evaluation options own_terms per_component request stage_constraints start"
)
_FILES = Registry(__name__, __path__, tuple(_SUPPORT.split()))
_ADDED: dict[str, Task] = {}
#: Tasks of installed packages.
_PLUGINS = Plugins("gso.tasks", lacks("formulations", "metrics"))


def names() -> list[str]:
    """List the names of the tasks."""
    return sorted({*_FILES.names(), *_ADDED, *_PLUGINS.names()})


def get(name: str) -> Task:
    """Return the task of a name."""
    if name in _ADDED:
        return _ADDED[name]
    found: Task | None
    if name in _FILES.names():
        found = _FILES.get(name).TASK
    else:
        found = _PLUGINS.get(name)
    if found is None:
        raise OptionError(f"no task {name!r}; {choices(name, names())}")
    return found


def add(name: str, task: Task) -> None:
    """Register a task from outside the package, for this process.

    Raises
    ------
    OptionError
        The name is taken.
    """
    if name in names():
        raise OptionError(f"{name!r} is taken in gso.tasks; choose another name")
    _ADDED[name] = task


def choose(
    task: str, formulation: str | None = None, options: str | Options | None = None
) -> tuple[str, Formulation[Options]]:
    """Return the name of the formulation to use, and the formulation.

    Without a name, the preset or the class of `options` determines the formulation; failing
    that, it is the task's default.
    """
    known = get(task).formulations
    implied = next((name for name, one in known.items() if options in one.presets), None)
    of_class = (name for name, one in known.items() if type(options) is one.options)
    name = formulation
    if name is None:
        name = implied or next(of_class, next(iter(known)))
    if name not in known:
        raise OptionError(f"task {task!r} has no formulation {name!r}; {choices(name, known)}")
    if implied not in (None, name):
        raise OptionError(
            f"options {options!r} are those of the formulation {implied!r}, not {name!r}"
        )
    return name, known[name]
