"""File options shared by several commands, and the check that no output replaces an input."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from gso.cli.shared_options import MM
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.io import Unwelded
    from gso.mesh import Mesh
    from gso.typing import Array


def _length(ctx: click.Context, option: click.Parameter, value: float | None) -> float | None:
    from gso.io import checked_weld

    return None if value is None else checked_weld(value)


#: ``--weld TOL``
weld = click.option(
    "--weld",
    metavar="TOL",
    type=float,
    callback=_length,
    help="Merge vertices closer than this, in the input's unit of length: for faces that have "
    "vertices of their own. 0 merges equal ones.",
)


def _remembered(ctx: click.Context, option: click.Parameter, value: float | None) -> None:
    ctx.meta[_CHORD] = value


_CHORD = "gso.chord"
#: ``--chord MM``; :func:`load` and :func:`source` take it from the command's context.
chord = click.option(
    "--chord",
    metavar="MM",
    type=MM,
    callback=_remembered,
    expose_value=False,
    help="Largest distance of curved edges and faces of a CAD file from their chords; 1e-4 of the "
    "size by default. Planes, cylinders, cones and other torsal faces are unrolled exactly.",
)

#: ``--force``
force = click.option("--force", is_flag=True, help="Let an output replace an input.")


def load(file: str, weld: float | None = None) -> Mesh:
    """Read a mesh from a file, and merge vertices if `weld` is given."""
    from gso import io

    return io.load(file, weld=weld, chord=_chord())


def source(file: str, weld: float | None) -> str | Unwelded:
    """Return a file as input of :func:`gso.as_mesh`, for a worker process to read."""
    from gso.io import Unwelded

    chord = _chord()
    return file if weld is None and chord is None else Unwelded(file, weld, chord)


def _chord() -> float | None:
    context = click.get_current_context(silent=True)
    return None if context is None else context.meta.get(_CHORD)


def here(file: str, weld: float | None) -> Mesh | str | Unwelded:
    """Read a file for workers that cannot; one that cannot be read is left to them to report."""
    from gso.errors import GSOError

    try:
        return load(file, weld)
    except GSOError:
        return source(file, weld)


def scale_of(
    files: Sequence[Mesh | str | Unwelded],
    scale: float | None,
    height: str | float | None,
    up: str,
    unit: str,
) -> float:
    """Return the factor by which designs are scaled, all by the same.

    Raises
    ------
    OptionError
        Both options are given, or the designs have no height.
    """
    from gso.io import as_mesh
    from gso.quantities import as_length

    if height is None:
        return 1.0 if scale is None else scale
    if scale is not None:
        raise OptionError("--scale and --height exclude each other; leave one of them out")
    own = [as_mesh(file).vertices[:, "xyz".index(up)] for file in files]
    extent = max(float(x.max()) for x in own) - min(float(x.min()) for x in own)
    if extent <= 0:
        raise OptionError(f"the design has no height along {up}; name another axis with --up")
    return as_length(height, "--height", diagonal=float("nan"), unit=unit) / extent


def lines(option: str, file: str | None) -> list[Array] | None:
    """Read the polylines (k, 3) that an option names a file of.

    Raises
    ------
    OptionError
        The file has none.
    """
    from gso import io

    if file is None:
        return None
    found = io.polylines(file)
    if not found:
        raise OptionError(
            f"{option}: {file} has no polylines; give an OBJ file with l elements, as CAD and "
            "modelling programs write curves"
        )
    return found


def spare(inputs: Iterable[str | None], outputs: Iterable[str | None], force: bool) -> None:
    """Raise an error if an output is also an input, through symbolic or hard links too.

    Raises
    ------
    OptionError
        An output would replace an input, and `force` is False.
    """
    if force:
        return
    taken = {key: name for name in inputs if name is not None for key in _keys(name)}
    for out in filter(None, outputs):
        name = next((taken[key] for key in _keys(out) if key in taken), None)
        if name is not None:
            called = "" if name == out else f" ({name})"
            raise OptionError(
                f"{out} would replace an input{called}; give another name or folder, or --force"
            )


def _keys(name: str) -> list[object]:
    """Return keys of a file (real path; device and inode); equal files share at least one."""
    keys: list[object] = []
    with suppress(OSError, ValueError):
        keys.append(os.path.realpath(name))
        seen = os.stat(name)
        keys.append((seen.st_dev, seen.st_ino))
    return keys
