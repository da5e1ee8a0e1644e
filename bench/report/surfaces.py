"""The surfaces on which methods are compared.

The test split of the published size is drawn again from its seed, without its labels. It is
selected once, in a minute or two, and stored in a folder.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import harness
import numpy as np

from gso import DatasetError, dataset
from gso.dataset import Recipe, select
from gso.dataset import noise as noises
from gso.dataset.builder import tasks
from gso.dataset.shard import surfaces as sampled
from gso.hierarchy import resample
from gso.io import replacing
from gso.linalg import blas_threads
from gso.mesh import Mesh
from gso.typing import Array
from report.store import Store, digest

Tick = Callable[[int, int], None]

#: Splits that are drawn again from the seed.
_SCREENED = ("validation", "test", "hard")


@dataclass(frozen=True)
class Case:
    """The input of a method, and the surface that its result is compared with.

    Attributes
    ----------
    surface : ndarray, (H, W, 3)
        The surface without noise.
    given : ndarray, (H, W, 3)
        The method's input: the surface, with noise for denoising.
    sigma : float
        Standard deviation of that noise.
    """

    surface: Array
    given: Array
    sigma: float = 0.0

    @cached_property
    def mesh(self) -> Mesh:
        """The method's input as a mesh with its triangles, which peers need.

        They are computed here, so that peers are not charged with their time.
        """
        mesh = Mesh.from_grid(self.given, weld=False)
        mesh.triangles  # noqa: B018 - cached by the mesh
        return mesh

    @property
    def small(self) -> Case:
        """The case with every fourth vertex only."""
        return Case(self.surface[::4, ::4], self.given[::4, ::4], self.sigma)


@dataclass(frozen=True)
class Surfaces:
    """Grids of the unit ball with their noise, in two files.

    Attributes
    ----------
    name : str
        Description for the reader.
    folder : Path
        Folder with ``surface.npy`` (n, H, W, 3) and ``noise.npy``.
    """

    name: str
    folder: Path

    @property
    def key(self) -> str:
        """Digest that identifies them."""
        return self.folder.name

    def __len__(self) -> int:
        return len(_mapped(self.folder / "surface.npy"))

    def __getitem__(self, k: int) -> Array:
        return np.array(_mapped(self.folder / "surface.npy")[k], float)

    def case(self, k: int, sigma: float = 0.0) -> Case:
        """Return surface k, with noise if `sigma` is positive."""
        surface = self[k]
        if not sigma:
            return Case(surface, surface)
        unit = np.array(_mapped(self.folder / "noise.npy")[k], float)
        return Case(surface, surface + sigma * unit, sigma)


@lru_cache(maxsize=4)
def _mapped(path: Path) -> np.ndarray:
    return np.load(path, mmap_mode="r", allow_pickle=False)


def written(folder: Path, name: str, points: Any, unit_noise: Any) -> Surfaces:
    """Write grids (n, H, W, 3) and their noise."""
    content = np.ascontiguousarray(points, np.float64)
    noise = np.ascontiguousarray(unit_noise, np.float32)
    sums = [hashlib.sha256(array.tobytes()).hexdigest() for array in (content, noise)]
    home = folder / digest([name, content.shape, *sums])
    return _completed(name, home, surface=lambda: content, noise=lambda: noise)


def _completed(name: str, home: Path, **arrays: Callable[[], Array]) -> Surfaces:
    """Write the arrays that a folder does not have yet."""
    home.mkdir(parents=True, exist_ok=True)
    for file, array in arrays.items():
        if not (home / f"{file}.npy").exists():
            with replacing(home / f"{file}.npy") as stream:
                np.save(stream, array())
    return Surfaces(name, home)


def reference(folder: Path, count: int | None = None, size: int = 64) -> Surfaces:
    """Return the 24 reference surfaces of the repository, or the first `count` of them.

    Surfaces are resampled if `size` is not 64.
    """
    points, unit = (np.stack(some[:count]) for some in harness.reference())
    if size != points.shape[1]:
        points = np.stack([resample(p, size, size) for p in points])
        unit = unit[:, :size, :size]
    return written(folder, "24 reference surfaces of another seed", points, unit)


def screened(folder: Path, split: str, store: Store, tick: Tick | None = None) -> Surfaces:
    """Draw a split of the set of the published size and seed 0."""
    recipe = Recipe()
    key = {"recipe": recipe.as_dict() | {"options": None, "labels": None}, "split": split}

    def draws() -> dict[str, np.ndarray]:
        with blas_threads(1):
            selection = select(
                recipe.n,
                recipe.splits["hard"],
                seed=recipe.seed,
                strata=recipe.strata,
                tick=tick,
            )
        every = list(tasks(recipe, selection, ()))
        return {s: np.concatenate([t.ids for t in every if t.split == s]) for s in _SCREENED}

    ids = store.arrays("surfaces/draws", key | {"split": _SCREENED}, draws)[split].tolist()
    name = f"{split} split of seed {recipe.seed}, {len(ids):,} surfaces"
    return _completed(
        name,
        folder / digest(key),
        surface=lambda: sampled(recipe, split, tuple(ids)),
        noise=lambda: noises.draw(recipe.seed, ids, recipe.size),
    )


def opened(folder: Path, path: Path, name: str = "test") -> Surfaces:
    """Read a split of an existing set: the test split with its noise, others without noise."""
    whole = dataset.open(path)
    split = whole[name]
    points = split["surface"][:]
    if name == "test" and "noise" not in split.arrays:
        raise DatasetError(f"{path}: its test split has no noise; give a set of gso dataset build")
    noise = split["noise"][:] if name == "test" else np.zeros_like(points)
    source = f"seed {whole.manifest['recipe']['seed']}" if whole.manifest else path.name
    return written(folder, f"{name} split of {source}, {len(split):,} surfaces", points, noise)
