"""Writers of flat parts: one file each, chosen by the suffix of the file to be written.

A writer has ``SUFFIX``, with its dot, ``PACKAGE`` if it needs one, and ``content(drawing, layers,
**options)``, which returns the bytes of the file; every writer has the option ``bend_text``. It
takes its lines and texts from :mod:`gso.workshop.writers.strokes`. A new format is one file in this
folder.
"""

from __future__ import annotations

from types import ModuleType

from gso.errors import OptionError
from gso.io.atomic import check_writable, suffix_of, write_bytes
from gso.registry import Registry
from gso.spelling import choices
from gso.typing import AnyPath
from gso.workshop.part import Drawing
from gso.workshop.writers.layers import layer_set
from gso.workshop.writers.writer_checks import check, require

_MODULES = Registry(__name__, __path__, ("layers", "strokes", "tiles", "writer_checks"))
#: Register a writer from outside the package: ``add(name, module)``.
add = _MODULES.add


def names() -> list[str]:
    """List the names of the writers.

    >>> names()
    ['dxf', 'pdf', 'svg']
    """
    return _MODULES.names()


def get(name: str) -> ModuleType:
    """Import the module of a writer.

    >>> get("dxf").SUFFIX
    '.dxf'
    """
    if name not in names():
        raise OptionError(f"no writer {name!r}; {choices(name, names())}")
    return _MODULES.get(name)


def require_package(writer: ModuleType) -> None:
    """Raise a GSOError if the package that a writer needs is not installed."""
    if hasattr(writer, "PACKAGE"):
        require(writer.PACKAGE, f"{writer.SUFFIX[1:].upper()} files")


def suffixes() -> dict[str, str]:
    """Return the names of the writers by the suffixes of their files.

    >>> suffixes()
    {'.dxf': 'dxf', '.pdf': 'pdf', '.svg': 'svg'}
    """
    return {get(name).SUFFIX: name for name in names()}


def check_output(path: AnyPath) -> ModuleType:
    """Return the writer of a file, after checking that it can be written.

    Raises
    ------
    OptionError, MeshError, GSOError
        As of :func:`write`.
    """
    suffix = suffix_of(path)
    known = suffixes()
    if suffix not in known:
        what = f"{suffix!r} files" if suffix else "files without a suffix"
        raise OptionError(f"{path}: no writer for {what}; there are {', '.join(known)}")
    writer = get(known[suffix])
    require_package(writer)
    check_writable(path)
    return writer


def write(
    drawing: Drawing, path: AnyPath, *, layers: str = "operations", **options: object
) -> None:
    """Write a drawing to a file, at the scale 1:1 in millimetres.

    Parameters
    ----------
    drawing : Drawing
        Parts in their places.
    path : str or PathLike
        A .dxf, .svg or .pdf file, or one of a writer that was added. It is replaced only when
        the new one is complete.
    layers : {"operations", "astm"}
        Names of the layers: operations, or the numbers of ASTM D6673.
    **options
        Those of the writer: see ``content`` in :mod:`gso.workshop.writers.dxf`,
        :mod:`gso.workshop.writers.svg` and :mod:`gso.workshop.writers.pdf`.

    Raises
    ------
    OptionError
        No writer has this suffix, unknown layers, or the writer does not take the value of an
        option.
    MeshError
        The drawing is empty, a part is not usable, or the file cannot be written.
    GSOError
        A package that the writer needs is not installed.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from gso.workshop.part import Part
    >>> plate = Part("plate", np.array([[0.0, 0], [80, 0], [80, 50], [0, 50]]))
    >>> path = os.path.join(tempfile.mkdtemp(), "plate.svg")
    >>> write(Drawing((plate,)), path)
    >>> write(Drawing((plate,)), "plate.dwg")
    Traceback (most recent call last):
    gso.errors.OptionError: plate.dwg: no writer for '.dwg' files; there are .dxf, .pdf, .svg
    """
    writer = check_output(path)
    check(drawing)
    content: bytes = writer.content(drawing, layer_set(layers), **options)
    write_bytes(path, content)
