"""Reading of datasets: arrays by split and name, loaded when they are indexed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from gso.dataset import hdf, manifest, noise, npy_folder
from gso.dataset.lazy import LazyArray, Part, Read, Rows
from gso.dataset.screen import FEATURES, features
from gso.errors import DatasetError
from gso.spelling import choices
from gso.typing import AnyPath, Array, Json

if TYPE_CHECKING:
    from gso.dataset.torch_data import TorchData

#: Number of surfaces read together when features of a folder of .npy files are computed.
_BLOCK = 256


class Split:
    """The surfaces of a split with their labels and other arrays.

    ``split[name]`` is an array that is read when it is indexed, ``split[i]`` is a dict with
    the entries of all arrays for surface i, and ``len(split)`` is the number of surfaces.

    Attributes
    ----------
    name : str
        Name of the split.
    arrays : dict of str to LazyArray
        Arrays by name; see the manual for the names.
    """

    def __init__(self, name: str, count: int, arrays: Callable[[], dict[str, LazyArray]]):
        self.name, self._count, self._arrays = name, count, arrays

    @cached_property
    def arrays(self) -> dict[str, LazyArray]:
        """Arrays by name, the surfaces first."""
        found = self._arrays()
        if "noise" in found:
            for level in noise.LEVELS:
                found[f"noisy_{level:.3f}"] = _noisy(found["surface"], found["noise"], level)
        return found

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[dict[str, np.ndarray]]:
        return (self[k] for k in range(len(self)))

    @overload
    def __getitem__(self, key: str) -> LazyArray: ...
    @overload
    def __getitem__(self, key: int | Rows) -> dict[str, np.ndarray]: ...
    def __getitem__(self, key: str | int | Rows) -> LazyArray | dict[str, np.ndarray]:
        if isinstance(key, str):
            try:
                return self.arrays[key]
            except KeyError:
                raise DatasetError(
                    f"split {self.name!r} has no array {key!r}; {choices(key, self.arrays)}"
                ) from None
        return {name: array[key] for name, array in self.arrays.items()}

    def __repr__(self) -> str:
        return f"Split({self.name!r}, {len(self)} surfaces: {', '.join(self.arrays)})"

    @property
    def features(self) -> dict[str, Array]:
        """K_P, K_N, K_A and sigma^2 of every surface, by name."""
        if "features" in self.arrays:
            table = self.arrays["features"][:]
        else:
            surface = self["surface"]
            if surface.shape[-1] != 3:
                raise DatasetError(f"split {self.name!r} has flat images, and no surfaces")
            blocks = (surface[k : k + _BLOCK] for k in range(0, len(self), _BLOCK))
            table = np.concatenate([features(npy_folder.unit(b)) for b in blocks])
        return dict(zip(FEATURES, table.T, strict=True))

    @property
    def metrics(self) -> dict[str, dict[str, Array]]:
        """Metrics of the labels: an array over the surfaces by kind of label and metric."""
        found: dict[str, dict[str, Array]] = {}
        for name, array in self.arrays.items():
            if name.startswith("metrics/"):
                _, kind, metric = name.split("/")
                found.setdefault(kind, {})[metric] = array[:]
        return found

    def torch(self, *names: str, **keywords: Any) -> TorchData:
        """Return a torch ``Dataset`` of the named arrays (by default the surfaces).

        Keywords are passed to :class:`gso.dataset.torch_data.TorchData`.
        """
        if find_spec("torch") is None:
            raise DatasetError('this needs torch: pip install ".[net]" in the folder of gso')
        from gso.dataset.torch_data import TorchData

        return TorchData([self[name] for name in names or ("surface",)], **keywords)


class Dataset(Mapping[str, Split]):
    """A dataset of surfaces: a mapping from names of splits to :class:`Split`.

    Attributes
    ----------
    path : Path
        Folder of the dataset.
    manifest : dict
        Recipe, versions, files and statistics; empty for a folder of .npy files.
    """

    def __init__(self, path: AnyPath, record: Json | None = None):
        self.path = Path(path)
        if record is None and not (self.path / manifest.NAME).exists():
            self.manifest: Json = {}
            found = npy_folder.splits(self.path)
            self._splits = {
                name: Split(name, len(files), partial(_files, files))
                for name, files in found.items()
            }
            return
        self.manifest = manifest.load(self.path) if record is None else record
        if record is None and not self.manifest["complete"]:
            raise DatasetError(
                f"{self.path}: the build is not finished; run it again with the same options"
            )
        self._splits = {
            name: Split(name, count, partial(self._stored, name))
            for name, count in self.manifest["splits"].items()
        }

    def __getitem__(self, name: str) -> Split:
        try:
            return self._splits[name]
        except KeyError:
            raise DatasetError(
                f"{self.path} has no split {name!r}; {choices(name, self._splits)}"
            ) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._splits)

    def __len__(self) -> int:
        return len(self._splits)

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(s)} {name}" for name, s in self._splits.items())
        return f"Dataset({str(self.path)!r}: {counts})"

    def damaged(self) -> list[str]:
        """Return the files that are missing or do not match their checksum."""
        return manifest.damaged(self.path, self.manifest) if self.manifest else []

    def _stored(self, split: str) -> dict[str, LazyArray]:
        """Return the arrays of a split from this package's HDF5 files."""
        by_part: dict[str, list[Json]] = {}
        for entry in self.manifest["files"]:
            if entry["split"] == split:
                by_part.setdefault(entry["part"], []).append(entry)
        found = {}
        for entries in by_part.values():
            first = hdf.contents(self.path / entries[0]["name"])
            for name, (shape, dtype) in first.items():
                parts = [
                    Part(e["count"], partial(hdf.read, self.path / e["name"], name))
                    for e in entries
                ]
                found[name] = LazyArray(parts, shape[1:], dtype)
        order = sorted(found, key=lambda n: ("/" in n, n != "surface", n))
        return {name: found[name] for name in order}


def open(path: AnyPath) -> Dataset:
    """Open a dataset.

    Parameters
    ----------
    path : path
        Folder made by :func:`gso.dataset.build`, or a folder of .npy files as published: a
        folder per split (train/, test/) with a file (H, W, 3) per surface.

    Raises
    ------
    DatasetError
        There is no dataset, its build is not finished, or its manifest is damaged.

    Examples
    --------
    >>> import gso
    >>> data = gso.dataset.open("surfaces")                       # doctest: +SKIP
    >>> data["train"]["surface"][:16].shape                       # doctest: +SKIP
    (16, 64, 64, 3)
    """
    return Dataset(path)


def _files(files: list[Path]) -> dict[str, LazyArray]:
    """Return the surfaces of .npy files as one lazy array."""
    shape = npy_folder.load(files[0]).shape
    parts = [Part(1, partial(npy_folder.rows, path, shape)) for path in files]
    return {"surface": LazyArray(parts, shape, np.dtype(float))}


def _noisy(surface: LazyArray, unit: LazyArray, level: float) -> LazyArray:
    """Return surfaces plus noise of the standard deviation `level`."""
    parts = [
        Part(a.count, partial(_sum, a.read, b.read, level))
        for a, b in zip(surface.parts, unit.parts, strict=True)
    ]
    return LazyArray(parts, surface.shape[1:], surface.dtype)


def _sum(surface: Read, unit: Read, level: float, rows: Rows) -> Array:
    return np.asarray(surface(rows) + level * unit(rows).astype(float))
