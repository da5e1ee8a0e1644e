"""Writers of flat parts: one file each, chosen by the suffix of the file to be written.

A writer has ``SUFFIX``, with its dot, ``PACKAGE``, which it needs, and ``write(drawing, path,
**options)``, whose options ``layers`` and ``bend_text`` every writer has. It takes its lines
and texts from :mod:`gso.workshop.writers.strokes` and their layers from
:mod:`gso.workshop.writers.layers`. A new format is one file in this folder.
"""

from __future__ import annotations

import os
from os import PathLike
from types import ModuleType
from typing import Any

from gso.errors import OptionError
from gso.registry import Registry
from gso.spelling import choices
from gso.workshop.part import Drawing

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


def suffixes() -> dict[str, str]:
    """Return the names of the writers by the suffixes of their files.

    >>> suffixes()
    {'.dxf': 'dxf', '.pdf': 'pdf', '.svg': 'svg'}
    """
    return {get(name).SUFFIX: name for name in names()}


def write(drawing: Drawing, path: str | PathLike[str], **options: Any) -> None:
    """Write a drawing to a file, at the scale 1:1 in millimetres.

    Parameters
    ----------
    drawing : Drawing
        Parts in their places.
    path : str or PathLike
        A .dxf, .svg or .pdf file, or one of a writer that was added. It is replaced only when
        the new one is complete.
    **options
        Those of the writer: see ``write`` in :mod:`gso.workshop.writers.dxf`,
        :mod:`gso.workshop.writers.svg` and :mod:`gso.workshop.writers.pdf`.

    Raises
    ------
    OptionError
        No writer has this suffix, or the writer does not take an option or its value.
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
    name = os.fsdecode(path)
    suffix = os.path.splitext(name)[1].lower()
    known = suffixes()
    if suffix not in known:
        what = f"{suffix!r} files" if suffix else "files without a suffix"
        raise OptionError(f"{name}: no writer for {what}; there are {', '.join(known)}")
    get(known[suffix]).write(drawing, path, **options)
