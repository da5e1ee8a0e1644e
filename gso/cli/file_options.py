"""File options shared by several commands, and the check that no output replaces an input."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
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


_CHORD, _STDIN = "gso.chord", "gso.stdin"
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


#: The name that stands for standard input or output.
STANDARD = "-"
#: First bytes of files, by their suffix; others are OBJ.
_BEGIN = {b"OFF": ".off", b"ply": ".ply", b"solid": ".stl", b"\x93NUMPY": ".npy", b"PK": ".npz"}


def load(file: str, weld: float | None = None) -> Mesh:
    """Read a mesh from a file or standard input, and merge vertices if `weld` is given."""
    from gso import io

    return io.load(_on_disk(file), weld=weld, chord=_chord())


def _on_disk(file: str) -> str:
    """Return a file's name, or that of a temporary file with what standard input holds.

    A ``--unit`` for a CAD file, which has its own, is an OptionError.
    """
    from gso.io import check_unit

    if file != STANDARD:
        check_unit(file, _unit())
        return file
    context = click.get_current_context()
    if _STDIN not in context.meta:
        data = sys.stdin.buffer.read()
        if not data:
            raise OptionError("standard input is empty; give a mesh, such as an OBJ file")
        suffix = next((end for begin, end in _BEGIN.items() if data.startswith(begin)), ".obj")
        path = os.path.join(_temporary(context), f"stdin{suffix}")
        with open(path, "wb") as stream:
            stream.write(data)
        context.meta[_STDIN] = path
    return str(context.meta[_STDIN])


def _temporary(context: click.Context) -> str:
    """Make a folder that is removed when the command ends."""
    from tempfile import TemporaryDirectory

    return context.with_resource(TemporaryDirectory(prefix="gso-"))


@contextmanager
def written(out: str) -> Iterator[str]:
    """Provide the name of the file to write, whose content then goes to standard output for "-".

    It is an OBJ file there.
    """
    if out != STANDARD:
        yield out
        return
    path = os.path.join(_temporary(click.get_current_context()), "stdout.obj")
    yield path
    with open(path, "rb") as stream:
        sys.stdout.buffer.write(stream.read())


def source(file: str, weld: float | None) -> str | Unwelded:
    """Return a file as input of :func:`gso.as_mesh`, for a worker process to read."""
    from gso.io import Unwelded

    chord, file = _chord(), _on_disk(file)
    return file if weld is None and chord is None else Unwelded(file, weld, chord)


def _unit() -> str:
    context = click.get_current_context(silent=True)
    return "mm" if context is None else context.params.get("unit", "mm")


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
