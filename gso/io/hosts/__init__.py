"""Meshes of other packages, in and out: one file each, found by its name.

A file has ``PACKAGE``, the package to install; ``is_mesh(x)``, which recognises a mesh by its
attributes and imports nothing; ``surface(x)``, which reads it; and ``make(mesh)``, which makes one.
"""

from __future__ import annotations

from importlib.util import find_spec
from types import ModuleType
from typing import Any

from gso.errors import GSOError, OptionError
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.registry import Registry
from gso.spelling import choices

_MODULES = Registry(__name__, __path__)
#: Register a module of another package: ``add_host(name, module)``.
add_host = _MODULES.add


def names() -> list[str]:
    """List the packages.

    >>> names()
    ['compas', 'meshio', 'pyvista', 'trimesh']
    """
    return _MODULES.names()


def surface_of(x: object) -> Surface | None:
    """Return the surface of a mesh of another package; None if it is none.

    Raises
    ------
    MeshError
        It is such a mesh, but no surface.
    """
    for host in _MODULES.modules().values():
        if host.is_mesh(x):
            surface: Surface = host.surface(x)
            return surface
    return None


def made(mesh: Mesh, name: str) -> Any:
    """Make the mesh of another package.

    Raises
    ------
    OptionError
        There is no such package here.
    GSOError
        It is not installed.
    """
    if name not in names():
        raise OptionError(f"no meshes of {name!r}; {choices(name, names())}")
    host: ModuleType = _MODULES.get(name)
    if find_spec(host.PACKAGE) is None:
        raise GSOError(f"{host.PACKAGE} is not installed; pip install {host.PACKAGE}")
    return host.make(mesh)
