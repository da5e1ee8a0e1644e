"""Readers and writers of mesh and CAD files; writers of flat patterns and polylines.

>>> import tempfile, os
>>> import numpy as np
>>> y, x = np.mgrid[:3, :4]
>>> path = os.path.join(tempfile.mkdtemp(), "panel.obj")
>>> save(np.stack([x, y, x * y / 10], axis=-1), path)
>>> load(path)
Mesh(12 vertices, 6 faces, grid 3 x 4)
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from types import ModuleType
from typing import BinaryIO, TypeVar

from gso.errors import MeshError, NonManifoldError, OptionError
from gso.io import arrays, glb, obj, off, ply, stl
from gso.io.atomic import check_writable, replacing, suffix_of
from gso.io.cad import (
    SPLINE_SUFFIXES,
    Solid,
    Turned,
    check_package,
    check_spline,
    check_unit,
    read_faces,
    save_faces,
    save_patches,
    save_solids,
    save_spline,
)
from gso.io.convert import as_host, as_mesh, as_surface
from gso.io.flat_svg import save_flat
from gso.io.hosts import add_host
from gso.io.lines import save_lines
from gso.io.offsets import read_offsets
from gso.io.raw_surface import Surface, welded
from gso.io.raw_surface import checked as checked_weld
from gso.io.source import read_bytes
from gso.mesh import Mesh
from gso.registry import Plugins, lacks
from gso.typing import AnyPath, Array, MeshLike, Unwelded

__all__ = [
    "SPLINE_SUFFIXES",
    "SUFFIXES",
    "Solid",
    "Surface",
    "Turned",
    "Unwelded",
    "add_format",
    "add_host",
    "as_host",
    "as_mesh",
    "as_surface",
    "check_package",
    "check_spline",
    "check_unit",
    "check_writable",
    "checked_weld",
    "left_out",
    "load",
    "read_offsets",
    "read_surface",
    "replacing",
    "save",
    "save_faces",
    "save_flat",
    "save_lines",
    "save_patches",
    "save_solids",
    "save_spline",
    "suffix_of",
    "suffixes",
    "welded",
    "write",
]


_Made = TypeVar("_Made")
#: Reader and writer of a file format.
_Format = tuple[Callable[[bytes], Surface], Callable[[Mesh, BinaryIO], None]]
_FORMATS: dict[str, _Format] = {
    ".obj": (obj.read, obj.write),
    ".ply": (ply.read, ply.write),
    ".off": (off.read, off.write),
    ".stl": (stl.read, stl.write),
    ".glb": (glb.read, glb.write),
    ".npy": (arrays.read_npy, arrays.write_npy),
    ".npz": (arrays.read_npz, arrays.write_npz),
}
SUFFIXES = tuple(_FORMATS)
"""Suffixes of the mesh files that the package itself reads and writes."""
#: Formats of installed packages; their names are the suffixes, without the dot.
_PLUGINS = Plugins("gso.formats", lacks("read", "write"))


def suffixes() -> tuple[str, ...]:
    """Return the suffixes of the mesh files that are read and written, also by plug-ins.

    >>> suffixes()[:2]
    ('.obj', '.ply')
    """
    more = (f".{name.lower()}" for name in _PLUGINS.names())
    return tuple(dict.fromkeys((*_FORMATS, *more)))


def _format(suffix: str) -> _Format:
    """Return the reader and writer of a suffix, one of :func:`suffixes`."""
    if suffix in _FORMATS:
        return _FORMATS[suffix]
    name = next(n for n in _PLUGINS.names() if n.lower() == suffix[1:])
    module = _PLUGINS.get(name)
    if module is None:
        raise MeshError(f"the package for {suffix!r} files cannot be used; see the warnings")
    return module.read, module.write


def add_format(suffix: str, module: ModuleType) -> None:
    """Register a file format from outside the package, for this process.

    Parameters
    ----------
    suffix : str
        Such as ".msh".
    module : module
        With ``read(data)``, which returns an object whose ``mesh(weld)`` makes the mesh, and
        ``write(mesh, file)``; see :class:`gso.io.Surface`.

    Raises
    ------
    OptionError
        The suffix is taken, or does not begin with a dot.
    """
    if not suffix.startswith(".") or suffix.lower() in suffixes():
        raise OptionError(f"{suffix!r} is taken or is no suffix; give a new one such as '.msh'")
    _FORMATS[suffix.lower()] = (module.read, module.write)


def load(path: AnyPath, *, weld: float | None = None, chord: float | None = None) -> Mesh:
    """Read a mesh or CAD file; its suffix selects the format.

    Parameters
    ----------
    path : str or PathLike
        An .obj, .ply or .off file (quads are kept), .stl or .glb (triangles, single
        precision, equal vertices merged), .npy (a grid of points (H, W, 3)) or .npz
        (`vertices` and `faces`, or one grid). Or a CAD file, whose faces become triangles:
        .step, .stp, .iges, .igs (needs OpenCASCADE) or .3dm (needs rhino3dm).
    weld : float, optional
        Merge vertices that lie within this distance of each other, in the file's unit of
        length (see :func:`welded`). Use it for files in which each face has its own copies
        of its vertices, at seams or everywhere. 0 merges equal vertices.
    chord : float, optional
        Largest distance between the triangles and the faces of a CAD file, in millimetres; 1e-4
        of the size when not given.

    Returns
    -------
    Mesh
        In the file's own unit and order of vertices; in millimetres from a CAD file. `notes` list
        what was changed or left out. `attributes` hold the face names and texture coordinates of
        an OBJ file, or the names and colours in a CAD file; :func:`save` writes them again.

    Raises
    ------
    MeshError
        The file is missing, of an unknown format or damaged, or :class:`gso.Mesh` rejects
        its geometry. The message names the file and, in a text file, the line.
    OptionError
        `weld` is not a finite number of 0 or more; `chord` is not a positive number, or the file
        is no CAD file.
    GSOError
        The package that reads the CAD file is not installed: ``pip install ".[cad]"`` in the
        folder of gso.
    """
    return _read(path, lambda surface: surface.mesh(weld), chord)


def read_surface(path: AnyPath, *, chord: float | None = None) -> Surface:
    """Read the vertices and faces of a file without checking that they are a surface.

    Parameters
    ----------
    path : str or PathLike
    chord : float, optional
        As for :func:`load`.

    Raises
    ------
    MeshError
        The file is missing, of an unknown format or damaged.
    """
    return _read(path, lambda surface: surface, chord)


def polylines(path: AnyPath) -> list[Array]:
    """Read the points (k, 3) of each polyline (``l``) in an OBJ file; none from other files.

    Raises
    ------
    MeshError
        The file is missing or damaged.
    """
    if suffix_of(path) != ".obj":
        return []
    try:
        return obj.polylines(read_bytes(path))
    except MeshError as error:
        raise MeshError(f"{os.fsdecode(path)}: {error}") from None


def _read(path: AnyPath, made: Callable[[Surface], _Made], chord: float | None = None) -> _Made:
    """Make something of the content of a file; errors name the file."""
    name = os.fsdecode(path)
    suffix = suffix_of(name)
    if chord is not None and suffix not in SPLINE_SUFFIXES:
        raise OptionError(f"{name} is no CAD file, and has triangles already; leave out chord")
    try:
        readable = (*suffixes(), *SPLINE_SUFFIXES)
        if suffix not in readable and not os.path.isdir(name):
            what = f"a {suffix!r} file" if suffix else "a file without a suffix"
            raise MeshError(f"cannot read {what}; use {', '.join(readable)}")
        data = read_bytes(name)
        if suffix in SPLINE_SUFFIXES:
            return made(read_faces(data, suffix, chord))
        return made(_format(suffix)[0](data))
    except MeshError as error:
        kind = NonManifoldError if isinstance(error, NonManifoldError) else MeshError
        raise kind(f"{name}: {error}") from error.__cause__
    except MemoryError:
        raise MeshError(f"{name}: does not fit into memory; give a coarser mesh") from None


def save(mesh: MeshLike, path: AnyPath) -> None:
    """Write a mesh to a file; its suffix selects the format.

    An existing file is replaced only when the new one is complete: a write that fails or
    is interrupted leaves the existing file unchanged.

    Parameters
    ----------
    mesh : Mesh
        Or anything that :func:`as_mesh` takes.
    path : str or PathLike
        An .obj, .ply, .off or .npz file (quads kept, exact), .npy (grids, exact; row by
        row), .stl or .glb (triangles in single precision).

    Warns
    -----
    UserWarning
        The mesh has names of faces, materials or texture coordinates from an OBJ file, which
        .obj and .npz keep and the other formats do not.

    Raises
    ------
    MeshError
        Unknown suffix, no such folder, no permission, or a mesh that the format cannot
        store. The message names the file.
    """
    for note in write(mesh, path):
        warnings.warn(note, stacklevel=2)


def write(mesh: MeshLike, path: AnyPath) -> tuple[str, ...]:
    """Write a mesh as :func:`save` does, and return its warnings instead of issuing them."""
    check_writable(path, suffixes())
    name = os.fsdecode(path)
    surface = as_mesh(mesh)
    write_surface = _format(suffix_of(name))[1]
    with replacing(path) as file:
        try:
            write_surface(surface, file)
        except MeshError as error:
            raise MeshError(f"{name}: {error}") from None
    return left_out(surface, path)


def left_out(mesh: Mesh, path: AnyPath) -> tuple[str, ...]:
    """Return notes to the user on the attributes of a mesh that this file cannot store."""
    suffix = suffix_of(path)
    if mesh.attributes is None or mesh.attributes.empty or suffix in (".obj", ".npz"):
        return ()
    return (f"a {suffix} file holds no {mesh.attributes}: left out, an .obj file keeps them",)
