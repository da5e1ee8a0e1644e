"""Tasks of nets: one file each, found by name. PyTorch is not needed to import them."""

from __future__ import annotations

from types import ModuleType

from gso.errors import OptionError
from gso.net.tasks.base import NetTask
from gso.registry import Registry
from gso.spelling import choices

__all__ = ["NetTask", "add_task", "get", "names"]

_FILES = Registry(__name__, __path__, ("base",))


def names() -> list[str]:
    """List the names of the tasks.

    >>> names()
    ['denoise', 'developable', 'flatten']
    """
    return _FILES.names()


def get(name: object) -> NetTask:
    """Return the task of a name; an OptionError if there is none."""
    if name not in names():
        raise OptionError(f"no task {name!r} for a net; {choices(name, names())}")
    task: NetTask = _FILES.get(str(name)).TASK
    return task


def add_task(task: NetTask) -> None:
    """Register a task from outside the package, for this process."""
    module = ModuleType(task.name)
    module.TASK = task  # type: ignore[attr-defined]
    _FILES.add(task.name, module)
