"""HDF5 files of a dataset: named arrays of equal length."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from gso.dataset.lazy import Rows
from gso.errors import DatasetError
from gso.typing import AnyPath

if TYPE_CHECKING:
    import h5py


def pack(arrays: dict[str, np.ndarray]) -> bytes:
    """Return arrays of equal length as an HDF5 file, with the same bytes for the same arrays."""
    import h5py

    # Use the HDF5 core driver and keep every dataset open until the end. With a Python file
    # object, or datasets closed earlier, the layout depends on the timing of other threads.
    with h5py.File(
        "memory", "w", driver="core", backing_store=False, libver=("v110", "v110")
    ) as file:
        opened = []
        for name, values in arrays.items():
            # One chunk per surface; scalars per surface are stored contiguously.
            chunked: dict[str, Any] = {}
            if values.ndim > 1 and len(values):
                chunked = {"chunks": (1, *values.shape[1:]), "compression": 1, "shuffle": True}
            opened.append(file.create_dataset(name, data=values, track_times=False, **chunked))
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def contents(path: AnyPath) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    """Return the shape and type of each array of a file, by name."""
    import h5py

    found: dict[str, tuple[tuple[int, ...], np.dtype]] = {}

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, item.dtype)

    with _opened(path) as file:
        file.visititems(visit)
    return found


def read(path: AnyPath, name: str, rows: Rows = slice(None)) -> np.ndarray:
    """Read rows of an array of a file; row indices must be increasing."""
    with _opened(path) as file:
        values: np.ndarray = file[name][rows]
    return values


@contextmanager
def _opened(path: AnyPath) -> Iterator[h5py.File]:
    """Open a file.

    Raises
    ------
    DatasetError
        The file is missing or damaged.
    """
    import h5py

    try:
        # Files never change once written, so locks, which some disks lack, are not needed.
        with h5py.File(path, "r", locking=False) as file:
            yield file
    except (OSError, KeyError, RuntimeError) as error:
        raise DatasetError(
            f"{os.fsdecode(path)} is missing or damaged ({error}); "
            "build the set again with the same options, which makes such files anew"
        ) from None
