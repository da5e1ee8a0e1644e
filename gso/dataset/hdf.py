"""HDF5 files of a dataset: named arrays of equal length."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from gso.errors import DatasetError
from gso.typing import Ints

Rows = slice | Ints


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
        return file.id.get_file_image()


def contents(path: str | os.PathLike[str]) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    """Return the shape and type of each array of a file, by name."""
    import h5py

    def collect(file: Any) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
        found: dict[str, tuple[tuple[int, ...], np.dtype]] = {}

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                found[name] = (item.shape, item.dtype)

        file.visititems(visit)
        return found

    return _opened(path, collect)


def read(path: str | os.PathLike[str], name: str, rows: Rows = slice(None)) -> np.ndarray:
    """Read rows of an array of a file; row indices must be increasing."""
    return _opened(path, lambda file: file[name][rows])


def _opened(path: str | os.PathLike[str], use: Callable[[Any], Any]) -> Any:
    """Open a file and return the result of `use` for it.

    Raises
    ------
    DatasetError
        The file is missing or damaged.
    """
    import h5py

    try:
        # Files never change once written, so locks, which some disks lack, are not needed.
        with h5py.File(path, "r", locking=False) as file:
            return use(file)
    except (OSError, KeyError, RuntimeError) as error:
        raise DatasetError(
            f"{os.fsdecode(path)} is missing or damaged ({error}); "
            "build the set again with the same options, which makes such files anew"
        ) from None
