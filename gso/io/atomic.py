"""Atomic file writes: the file is either complete or unchanged."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

from gso.errors import MeshError
from gso.typing import AnyPath


def suffix_of(path: AnyPath) -> str:
    """Return the suffix of a file in lower case, with its dot.

    >>> suffix_of("Panel.OBJ")
    '.obj'
    """
    return os.path.splitext(os.fsdecode(path))[1].lower()


def check_writable(path: AnyPath, suffixes: Collection[str] | None = None) -> None:
    """Reject an output path that cannot be written, before anything is computed.

    Parameters
    ----------
    path : str or PathLike
        The file to be written; it need not exist.
    suffixes : collection of str, optional
        Suffixes that are accepted, with their dots. Any by default.

    Raises
    ------
    MeshError
        Unknown suffix, no such folder, a folder of that name, no permission.

    Examples
    --------
    >>> check_writable("panel.doc", suffixes=[".obj", ".ply"])
    Traceback (most recent call last):
    gso.errors.MeshError: panel.doc: cannot write a '.doc' file; use .obj, .ply
    """
    name = os.fsdecode(path)
    suffix = suffix_of(name)
    if suffixes is not None and suffix not in suffixes:
        what = f"a {suffix!r} file" if suffix else "a file without a suffix"
        raise MeshError(f"{name}: cannot write {what}; use {', '.join(suffixes)}")
    try:
        folder = os.path.dirname(os.path.realpath(name))
        if os.path.isdir(name):
            raise MeshError(f"{name}: is a folder; give the name of a file")
        if not os.path.isdir(folder):
            raise MeshError(f"{name}: there is no folder {folder}; create it first")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise MeshError(f"{name}: no permission to write in {folder}")
        if os.path.exists(name) and not os.access(name, os.W_OK):
            raise MeshError(f"{name}: the file is there and write-protected")
    except (OSError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{name}: cannot be written: {error}") from None


@contextmanager
def replacing(path: AnyPath) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path` that replaces it when the block ends normally.

    When the block raises, KeyboardInterrupt included, the temporary file is deleted and
    `path` stays unchanged. A replaced file keeps its permissions. A symbolic link is
    followed: its target is replaced, the link stays.

    Raises
    ------
    MeshError
        The path cannot be written (see :func:`check_writable`), or writing fails, for
        example on a full disk.
    """
    check_writable(path)
    target = os.path.realpath(os.fsdecode(path))
    # A short independent name: the target's name may already have the maximum length.
    temporary = os.path.join(os.path.dirname(target), f".gso-{secrets.token_hex(8)}.tmp")
    try:
        try:
            with open(temporary, "xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            if os.path.exists(target):
                os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
            os.replace(temporary, target)
        except BaseException:
            with suppress(OSError):
                os.unlink(temporary)
            raise
    except OSError as error:
        raise MeshError(
            f"{os.fsdecode(path)}: cannot be written: {error.strerror or error}"
        ) from error


def write_bytes(path: AnyPath, content: bytes) -> None:
    """Write a file, which replaces an earlier one when it is complete."""
    with replacing(path) as file:
        file.write(content)
