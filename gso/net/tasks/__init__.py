"""Tasks of nets: one file each, found by name. PyTorch is not needed to import them."""

from __future__ import annotations

from gso.errors import OptionError
from gso.net.tasks.base import NetTask
from gso.registry import Plugins, Registry, lacks
from gso.spelling import choices

__all__ = ["NetTask", "add_task", "get", "names"]

_FILES = Registry(__name__, __path__, ("base",))
_ADDED: dict[str, NetTask] = {}
#: Tasks of nets of installed packages.
_PLUGINS = Plugins("gso.net.tasks", lacks("components", "figures", "score"))


def _tasks() -> dict[str, NetTask]:
    files: list[NetTask] = [_FILES.get(name).TASK for name in _FILES.names()]
    more = {task.name: task for _, task in _PLUGINS.items()}
    return more | {task.name: task for task in files} | _ADDED


def names() -> list[str]:
    """List the names of the tasks.

    >>> names()
    ['denoise', 'developable', 'flatten']
    """
    return sorted(_tasks())


def get(name: object) -> NetTask:
    """Return the task of a name; an OptionError if there is none."""
    found = _tasks()
    if name not in found:
        raise OptionError(f"no task {name!r} for a net; {choices(name, sorted(found))}")
    return found[name]


def add_task(task: NetTask) -> None:
    """Register a task from outside the package, for this process."""
    _ADDED[task.name] = task
