"""Locking of a dataset's folder for one build at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gso.dataset import manifest
from gso.errors import DatasetError


@contextmanager
def claimed(place: Path) -> Iterator[None]:
    """Lock a folder for one build, and delete temporary files of interrupted builds.

    Raises
    ------
    DatasetError
        The folder holds something other than a dataset, cannot be made or written, or is
        locked by another build.
    """
    from filelock import FileLock, Timeout

    try:
        place.mkdir(parents=True, exist_ok=True)
        there = [p.name for p in place.iterdir() if not p.name.startswith(".")]
    except OSError as error:
        raise DatasetError(f"{place}: cannot be made a folder: {error.strerror}") from None
    if there and manifest.NAME not in there:
        raise DatasetError(f"{place} holds {there[0]} and no dataset; give a new or empty folder")
    lock = FileLock(place / ".lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise DatasetError(f"another build is at work in {place}; wait for it to end") from None
    except OSError as error:
        raise DatasetError(f"{place}: cannot be written: {error.strerror}") from None
    try:
        for half in (*place.glob(".gso-*.tmp"), *place.glob("*/.gso-*.tmp")):
            with suppress(OSError):
                os.unlink(half)
        yield
    finally:
        lock.release()
        with suppress(OSError):
            os.unlink(place / ".lock")
