"""Registries by name: files of a package, modules from elsewhere, entry points of packages."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property, lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

from gso.errors import OptionError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class Plugins:
    """What installed packages offer in a group of entry points; each is loaded at first use.

    One that cannot be loaded gives a warning that names its package, and is left out from then
    on.

    Parameters
    ----------
    group : str
        Name of the group, such as "gso.tasks".
    check : callable, optional
        Says what is wrong with a loaded object; empty if nothing is.

    Examples
    --------
    >>> Plugins("gso.no.such.group").names()
    []
    """

    def __init__(self, group: str, check: Callable[[Any], str] | None = None):
        self.group, self._check = group, check
        self._loaded: dict[EntryPoint, Any] = {}
        self._broken: set[EntryPoint] = set()

    def _points(self) -> dict[str, EntryPoint]:
        found = _in_group(tuple(sys.path), self.group)
        return {name: point for name, point in found.items() if point not in self._broken}

    def names(self) -> list[str]:
        """List the names, sorted, without loading anything."""
        return sorted(self._points())

    def get(self, name: str) -> Any | None:
        """Return the object of a name, None if there is none or it cannot be loaded.

        Warns
        -----
        UserWarning
            It cannot be loaded.
        """
        point = self._points().get(name)
        if point is None:
            return None
        if point not in self._loaded:
            try:
                self._loaded[point] = point.load()
                wrong = "" if self._check is None else self._check(self._loaded[point])
            # Code of another package, which may raise anything; it must not stop this one.
            except Exception as error:
                wrong = f"{type(error).__name__}: {error}"
            if wrong:
                self._broken.add(point)
                self._loaded.pop(point, None)
                package = "an installed package" if point.dist is None else point.dist.name
                warnings.warn(
                    f"{name!r} of {package} (entry point of {self.group}) is left out, because it "
                    f"cannot be used: {wrong}; update or uninstall {package}",
                    stacklevel=2,
                )
                return None
        return self._loaded[point]

    def items(self) -> Iterator[tuple[str, Any]]:
        """Load all objects; yield those that can be used, with their names."""
        for name in self.names():
            found = self.get(name)
            if found is not None:
                yield name, found


@lru_cache(maxsize=8)
def _entry_points(path: tuple[str, ...]) -> Any:
    """Search the folders of `path`, that of ``sys.path``, for entry points: once for all groups."""
    # Imported here, as it is slow. What it returns has another class from Python 3.12 on.
    from importlib.metadata import entry_points

    return entry_points()


@lru_cache(maxsize=64)
def _in_group(path: tuple[str, ...], group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group by name: every solve asks for the linear backends."""
    return {point.name: point for point in _entry_points(path).select(group=group)}


def lacks(*members: str) -> Callable[[Any], str]:
    """Make a check, for :class:`Plugins`, that an object has some members."""

    def check(found: Any) -> str:
        missing = [name for name in members if not hasattr(found, name)]
        return f"it has no {', '.join(missing)}" if missing else ""

    return check


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
    plugins : Plugins, optional
        Modules of installed packages, whose names are not those of files.
    """

    def __init__(
        self,
        package: str,
        path: Iterable[str],
        support: Iterable[str] = (),
        plugins: Plugins | None = None,
    ):
        self._package, self._path, self._support = package, path, frozenset(support)
        self._added: dict[str, ModuleType] = {}
        self._plugins = plugins

    def names(self) -> list[str]:
        """List the names, sorted."""
        more = () if self._plugins is None else self._plugins.names()
        return sorted({*self._files, *self._added, *more})

    @cached_property
    def _files(self) -> set[str]:
        return {info.name for info in pkgutil.iter_modules(self._path)} - self._support

    def get(self, name: str) -> ModuleType:
        """Import the module of a name.

        Raises
        ------
        OptionError
            The module is one of an installed package, and cannot be used.
        """
        if name in self._added:
            return self._added[name]
        if name in self._files or self._plugins is None:
            return importlib.import_module(f"{self._package}.{name}")
        found: ModuleType | None = self._plugins.get(name)
        if found is None:
            raise OptionError(f"{name!r} of {self._package} cannot be used; see the warnings")
        return found

    def modules(self) -> dict[str, ModuleType]:
        """Import all modules but those of installed packages that cannot be used."""
        own = {name: self.get(name) for name in sorted({*self._files, *self._added})}
        more = {} if self._plugins is None else dict(self._plugins.items())
        return dict(sorted((more | own).items()))

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
