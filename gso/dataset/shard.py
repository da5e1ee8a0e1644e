"""One HDF5 file of a dataset: some surfaces of a split with their labels.

The bytes depend only on the recipe and the file's place in it. They do not depend on when or
where the file was made, or on the other files.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from gso.dataset import bezier, broad, labels, noise, screen, shapes
from gso.dataset.hdf import pack
from gso.dataset.recipe import Recipe, versions
from gso.errors import DatasetError
from gso.linalg import blas_threads
from gso.typing import Array

#: Number of surfaces in a file: a few seconds of work.
LENGTH = 32
#: Value of :attr:`Task.part` for files with surfaces and labels (not a reference).
LABELS = "labels"

# BLAS threads and warning filters are global in a process: make one file at a time.
_alone = threading.Lock()


@dataclass(frozen=True)
class Task:
    """A file to be made.

    Attributes
    ----------
    split : str
        Split that the file belongs to.
    number : int
        Position of the file in the split.
    ids : tuple of int
        Surfaces of the file: numbers of draws, or positions in a named split.
    part : str
        "labels", or the name of a reference.
    """

    split: str
    number: int
    ids: tuple[int, ...]
    part: str = LABELS

    @property
    def name(self) -> str:
        """Path of the file in the dataset's folder."""
        suffix = "" if self.part == LABELS else f".{self.part}"
        return f"{self.split}/{self.number:05d}{suffix}.h5"


def make(
    recipe: Recipe,
    expected: dict[str, str],
    task: Task,
    *,
    device: str | None = None,
    elsewhere: bool = False,
) -> bytes:
    """Make the content of a file.

    Parameters
    ----------
    recipe : Recipe
        Definition of the dataset.
    expected : dict
        Versions with which the dataset was begun (:func:`gso.dataset.recipe.versions`).
    task : Task
        The file to make.
    device : str, optional
        Where to solve its surfaces in batches; one by one when not given.
    elsewhere : bool
        Whether another process minimises there for this one.

    Raises
    ------
    DatasetError
        The versions in this process differ from `expected`.
    """
    here = versions(device)
    differing = [
        f"{k} {here.get(k)} instead of {v}" for k, v in expected.items() if here.get(k) != v
    ]
    if differing:
        raise DatasetError(
            f"{task.name} would be made by {', '.join(differing)}; install the same everywhere"
        )
    with _alone, blas_threads(1):
        points = surfaces(recipe, task.split, task.ids)
        if task.part != LABELS:
            return pack(_labelled(task.part, points, device, elsewhere))
        screened = points
        if recipe.size != screen.SIZE:
            screened = surfaces(recipe, task.split, task.ids, screen.SIZE)
        arrays: dict[str, np.ndarray] = {
            "id": np.array(task.ids, np.int64),
            "surface": points,
            "features": screen.features(screened),
        }
        if recipe.broad:
            arrays["family"] = np.array([broad.family(task.split, k) for k in task.ids], "S32")
        if task.split == noise.SPLIT:
            arrays["noise"] = noise.draw(recipe.seed, task.ids, recipe.size)
        for kind in recipe.labels:
            arrays |= _labelled(kind, points, device, elsewhere)
        return pack(arrays)


def surfaces(recipe: Recipe, split: str, ids: tuple[int, ...], size: int | None = None) -> Array:
    """Regenerate grids (b, size, size, 3) of a split, in the unit ball, from the seed."""
    size = recipe.size if size is None else size
    if recipe.broad:
        return np.stack([broad.draw(split, k, seed=recipe.seed, size=size) for k in ids])
    if split in shapes.NAMES:
        return shapes.sample(split, seed=recipe.seed, size=size)[list(ids)]
    return bezier.sample_many([screen.surface(recipe.seed, k) for k in ids], size)


def _labelled(
    kind: str, points: Array, device: str | None, elsewhere: bool
) -> dict[str, np.ndarray]:
    """Label the surfaces of a file; return arrays, metrics and statuses of a kind of label."""
    found = labels.solve_many(kind, points, device, elsewhere)
    # Single precision changes no metric of the labels by more than a thousandth. References
    # need double precision: their surface and flat image are isometric to a few parts in 1e6.
    dtype = np.float64 if kind in labels.REFERENCES else np.float32
    arrays = {
        name: np.stack([label.arrays[name] for label in found]).astype(dtype)
        for name in found[0].arrays
    }
    for name in labels.KINDS[kind].metrics:
        arrays[f"metrics/{kind}/{name}"] = np.array([label.metrics[name] for label in found])
    arrays[f"status/{kind}"] = np.array([label.status for label in found], "S16")
    return arrays
