"""Names of a package that are imported at first use, so that importing it stays cheap."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module


def at_first_use(
    package: str, places: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Make the functions ``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package : str
        Name of the package.
    places : mapping
        Names, separated by spaces, by the modules that define them, relative to the package. A
        name must not be that of a module of the package.

    Examples
    --------
    >>> load, names = at_first_use("gso.linalg", {"banded": "Solver cost"})
    >>> "cost" in names()
    True
    >>> load("cost").__module__
    'gso.linalg.banded'
    """
    modules = {name: module for module, names in places.items() for name in names.split()}

    def load(name: str) -> object:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        here = import_module(package)
        value: object = getattr(import_module(f"{package}.{modules[name]}"), name)
        setattr(here, name, value)
        return value

    return load, lambda: sorted({*vars(import_module(package)).get("__all__", ()), *modules})
