"""Folders of .npy files as in the published data: a folder per split, a file per surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gso.dataset.bezier import normalise
from gso.dataset.lazy import Rows
from gso.errors import DatasetError, MeshError
from gso.io import replacing
from gso.typing import AnyPath, Array

if TYPE_CHECKING:
    from gso.dataset.store import Dataset


def splits(path: Path) -> dict[str, list[Path]]:
    """Return the files of every split, sorted by name.

    Raises
    ------
    DatasetError
        There are no such files.
    """
    try:
        folders = sorted(p for p in path.iterdir() if p.is_dir())
        found = {folder.name: sorted(folder.glob("*.npy")) for folder in folders}
    except OSError as error:
        raise DatasetError(f"{path} cannot be read: {error.strerror}") from None
    found = {name: files for name, files in found.items() if files}
    if not found:
        raise DatasetError(
            f"{path} holds no dataset: neither a manifest nor folders of .npy files such as train/"
        )
    return found


def load(path: Path) -> Array:
    """Read a grid of finite numbers (H, W, d), d = 2 or 3, from a .npy file.

    Raises
    ------
    DatasetError
        The file is missing, damaged, or holds something else.
    """
    try:
        # Memory mapping checks the shape in the header against the size of the file.
        grid = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False), np.float64)
    except (OSError, ValueError, EOFError, TypeError) as error:
        raise DatasetError(f"{path} is no intact array of NumPy: {error}") from None
    if grid.ndim != 3 or grid.shape[-1] not in (2, 3) or min(grid.shape) < 2:
        raise DatasetError(f"{path} holds an array {grid.shape}, no grid (H, W, 3)")
    if not np.isfinite(grid).all():
        i, j = np.argwhere(~np.isfinite(grid))[0][:2]
        raise DatasetError(f"{path}: grid vertex ({i}, {j}) is not finite")
    if not np.ptp(grid, axis=(0, 1)).any():
        raise DatasetError(f"{path}: all points of the grid are one")
    return grid


def rows(path: Path, shape: tuple[int, ...], some: Rows) -> Array:
    """Read a file as an array of one row and index it; all grids of a split share one shape."""
    grid = load(path)
    if grid.shape != shape:
        raise DatasetError(f"{path} holds a grid {grid.shape}; the split's first one has {shape}")
    return np.asarray(grid[None][some])


def unit(grids: Array) -> Array:
    """Normalise grids (b, H, W, 3), each to the unit ball."""
    return np.stack([normalise(grid) for grid in grids])


def export(
    data: Dataset,
    path: AnyPath,
    *,
    array: str = "surface",
    only: tuple[str, ...] = (),
) -> int:
    """Write an array of a dataset as .npy files, one per surface, in a folder per split.

    File names depend only on the position in the split, so that exported surfaces and
    exported results correspond by name.

    Parameters
    ----------
    data : Dataset
        The dataset.
    path : path
        Folder to write to; existing files of the same names are replaced.
    array : str
        Name of the array: "surface", "developable", "strain", "noisy_0.005" ...
    only : tuple of str
        Splits to export; by default all that have the array.

    Returns
    -------
    int
        Number of files written: float64, (H, W, 3), or (H, W, 2) for flat images.

    Raises
    ------
    DatasetError
        No split has such an array, its rows are not grids, or a file cannot be written.
    """
    chosen = [data[name] for name in only] or list(data.values())
    chosen = [split for split in chosen if only or array in split.arrays]
    if not chosen:
        raise DatasetError(f"no split has an array {array!r}")
    count = 0
    for split in chosen:
        values = split[array]
        if values.ndim != 4:
            raise DatasetError(f"{array!r} is no grid of points; its rows have {values.shape[1:]}")
        target = Path(path) / split.name
        try:
            target.mkdir(parents=True, exist_ok=True)
            for k in range(len(split)):
                with replacing(target / f"{k:05d}.npy") as file:
                    np.lib.format.write_array(file, values[k].astype(np.float64))
                count += 1
        except (OSError, MeshError) as error:
            raise DatasetError(f"after {count} files: {error}") from None
    return count
