"""Registries of modules by name: the files of a package, and modules from elsewhere."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from functools import cached_property
from types import ModuleType

from gso.errors import OptionError


class Registry:
    """Modules by name.

    Parameters
    ----------
    package : str
        Name of the package whose files are registered.
    path : iterable of str
        Its folders.
    support : sequence of str
        Files of the folder that are not registered.
    """

    def __init__(self, package: str, path: Iterable[str], support: Iterable[str] = ()):
        self._package, self._path, self._support = package, path, frozenset(support)
        self._added: dict[str, ModuleType] = {}

    def names(self) -> list[str]:
        """List the names, sorted."""
        return sorted(self._files | self._added.keys())

    @cached_property
    def _files(self) -> set[str]:
        return {info.name for info in pkgutil.iter_modules(self._path)} - self._support

    def get(self, name: str) -> ModuleType:
        """Import the module of a name."""
        if name in self._added:
            return self._added[name]
        return importlib.import_module(f"{self._package}.{name}")

    def add(self, name: str, module: ModuleType) -> None:
        """Register a module from outside the package, for this process.

        Raises
        ------
        OptionError
            The name is taken.
        """
        if name in self.names():
            raise OptionError(f"{name!r} is taken in {self._package}; choose another name")
        self._added[name] = module
