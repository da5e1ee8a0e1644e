"""Read and write mesh files; flat patterns as drawings, lines in space.

>>> import tempfile, os
>>> import numpy as np
>>> y, x = np.mgrid[:3, :4]
>>> path = os.path.join(tempfile.mkdtemp(), "panel.obj")
>>> save(np.stack([x, y, x * y / 10], axis=-1), path)
>>> load(path)
Mesh(12 vertices, 6 faces, grid 3 x 4)
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from os import PathLike
from typing import Any, NamedTuple

from gso.io.atomic import check_writable, replacing
from gso.io.cad import SPLINE_SUFFIXES, check_spline, save_spline
from gso.io.convert import as_mesh
from gso.io.lines import save_lines
from gso.io.source import read_bytes
from gso.io.svg import save_flat
from gso.mesh import Mesh
from gso.status import MeshError

__all__ = [
    "SPLINE_SUFFIXES",
    "SUFFIXES",
    "as_mesh",
    "check_spline",
    "check_writable",
    "load",
    "replacing",
    "save",
    "save_flat",
    "save_lines",
    "save_spline",
]


class _Format(NamedTuple):
    """Module and functions of a format; modules load when they are used."""

    module: str
    read: str = "read"
    write: str = "write"

    def function(self, name: str) -> Callable[..., Any]:
        return getattr(importlib.import_module(f"gso.io.{self.module}"), name)


_FORMATS = {
    ".obj": _Format("obj"),
    ".ply": _Format("ply"),
    ".off": _Format("off"),
    ".stl": _Format("stl"),
    ".glb": _Format("glb"),
    ".npy": _Format("arrays", "read_npy", "write_npy"),
    ".npz": _Format("arrays", "read_npz", "write_npz"),
}

SUFFIXES = tuple(_FORMATS)
"""Suffixes of the mesh files that are read and written."""


def load(path: str | PathLike[str]) -> Mesh:
    """Read a mesh file; its suffix says which format it is.

    Parameters
    ----------
    path : str or PathLike
        An .obj, .ply or .off file (quads are kept), .stl or .glb (triangles, single
        precision, equal vertices merged), .npy (a grid of points (H, W, 3)) or .npz
        (`vertices` and `faces`, or one grid).

    Returns
    -------
    Mesh
        In the file's own unit and order of vertices. `notes` say what was changed.

    Raises
    ------
    MeshError
        The file is missing, of an unknown kind, damaged, or has a mesh that is refused.
        The message names the file, and the line of a text file.
    """
    name = os.fsdecode(path)
    suffix = os.path.splitext(name)[1].lower()
    try:
        if suffix not in _FORMATS and not os.path.isdir(name):
            what = f"a {suffix!r} file" if suffix else "a file without a suffix"
            raise MeshError(f"cannot read {what}; use {', '.join(SUFFIXES)}")
        data = read_bytes(name)
        form = _FORMATS[suffix]
        return form.function(form.read)(data)
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from error.__cause__
    except MemoryError:
        raise MeshError(f"{name}: does not fit into memory; give a coarser mesh") from None


def save(mesh: Any, path: str | PathLike[str]) -> None:
    """Write a mesh to a file; its suffix says which format it is.

    An existing file is replaced only when the new one is complete: a run that fails or
    is interrupted leaves it as it was.

    Parameters
    ----------
    mesh : Mesh
        Or anything that :func:`as_mesh` takes.
    path : str or PathLike
        An .obj, .ply, .off or .npz file (quads kept, exact), .npy (grids, exact; row by
        row), .stl or .glb (triangles in single precision).

    Raises
    ------
    MeshError
        Unknown suffix, no such folder, no permission, or a mesh that the format cannot
        hold. The message names the file.
    """
    check_writable(path, SUFFIXES)
    name = os.fsdecode(path)
    surface = as_mesh(mesh)
    form = _FORMATS[os.path.splitext(name)[1].lower()]
    write = form.function(form.write)
    with replacing(path) as file:
        try:
            write(surface, file)
        except MeshError as error:
            raise MeshError(f"{name}: {error}") from None
