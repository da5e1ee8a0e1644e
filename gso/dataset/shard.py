"""One file of the set: some surfaces of a split with their labels, as HDF5.

The bytes are a function of the recipe and the file's place in it alone, so that it does
not matter when, where or in what company they were made.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gso.dataset import bezier, labels, noise, screen, shapes
from gso.dataset.hdf import pack
from gso.dataset.recipe import Recipe, versions
from gso.status import DatasetError
from gso.tno.linear import blas_threads

Array = NDArray[np.float64]

#: Surfaces in a file: a few seconds of work.
LENGTH = 32
#: The part of a file's name that says what it holds, for the files with the labels.
LABELS = "labels"

# BLAS threads and warning filters belong to the process: one file at a time in each.
_alone = threading.Lock()


@dataclass(frozen=True)
class Task:
    """A file to be made.

    Attributes
    ----------
    split : str
        Split it belongs to.
    number : int
        Its place in the split.
    ids : tuple of int
        Its surfaces: numbers of draws, or places in a named split.
    part : str
        "labels", or the name of a reference.
    """

    split: str
    number: int
    ids: tuple[int, ...]
    part: str = LABELS

    @property
    def name(self) -> str:
        """Path in the set's folder."""
        suffix = "" if self.part == LABELS else f".{self.part}"
        return f"{self.split}/{self.number:05d}{suffix}.h5"


def make(recipe: Recipe, expected: dict[str, str], task: Task) -> bytes:
    """Content of a file.

    Parameters
    ----------
    recipe : Recipe
        What the set is made of.
    expected : dict
        Versions of the set's other files (:func:`gso.dataset.recipe.versions`).
    task : Task
        Which file.

    Raises
    ------
    DatasetError
        The packages here have other versions.
    """
    here = versions()
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
            return pack(_labelled(task.part, points))
        screened = points
        if recipe.size != screen.SIZE:
            screened = surfaces(recipe, task.split, task.ids, screen.SIZE)
        arrays: dict[str, np.ndarray] = {
            "id": np.array(task.ids, np.int64),
            "surface": points,
            "features": screen.features(screened),
        }
        if task.split == noise.SPLIT:
            arrays["noise"] = noise.draw(recipe.seed, task.ids, recipe.size)
        for kind in recipe.labels:
            arrays |= _labelled(kind, points)
        return pack(arrays)


def surfaces(recipe: Recipe, split: str, ids: tuple[int, ...], size: int | None = None) -> Array:
    """Grids (b, size, size, 3) of a split in the unit ball, made anew from the seed."""
    size = recipe.size if size is None else size
    if split in shapes.NAMES:
        return shapes.sample(split, seed=recipe.seed, size=size)[list(ids)]
    return bezier.sample_many([screen.surface(recipe.seed, k) for k in ids], size)


def _labelled(kind: str, points: Array) -> dict[str, np.ndarray]:
    """Arrays, metrics and statuses of a kind of label, over the surfaces of a file."""
    found = [labels.solve(kind, p) for p in points]
    # Single precision changes no metric of the labels by more than a thousandth, but does
    # those of a reference, whose surface and flat image are isometric to a few parts in 1e6.
    dtype = np.float64 if kind in labels.REFERENCES else np.float32
    arrays = {
        name: np.stack([label.arrays[name] for label in found]).astype(dtype)
        for name in found[0].arrays
    }
    for name in labels.KINDS[kind].metrics:
        arrays[f"metrics/{kind}/{name}"] = np.array([label.metrics[name] for label in found])
    arrays[f"status/{kind}"] = np.array([label.status for label in found], "S16")
    return arrays
