"""Parallel generation of many random surfaces: of the recipe, and of the broad set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.dataset import bezier, broad
from gso.errors import DatasetError
from gso.executors import open_executor
from gso.executors.base import processors

#: Smallest number of surfaces for which starting worker processes pays off.
_MANY = 4096
#: Number of surfaces of the broad set that a process draws at a time.
_BLOCK = 64


def draw_many(
    pieces: Sequence[tuple[int, int]], size: int, tick: Callable[[int], None] | None = None
) -> NDArray[np.float32]:
    """Draw surfaces (n, size, size, 3) in the unit ball, from a sequence of counts and seeds.

    The result does not depend on the number of processors.

    Parameters
    ----------
    pieces : sequence of (int, int)
        Number of surfaces and seed of each piece; their surfaces are concatenated.
    size : int
        Samples along each side.
    tick : callable, optional
        Progress callback, called with the number of surfaces drawn.

    Raises
    ------
    DatasetError
        A worker process failed.

    Examples
    --------
    >>> draw_many([(2, 7), (1, 8)], 16).shape
    (3, 16, 16, 3)
    """
    counts = [count for count, _ in pieces]
    return _drawn(partial(_sampled, size=size), pieces, counts, size, tick)


def draw_broad(
    split: str, count: int, *, seed: int, size: int, tick: Callable[[int], None] | None = None
) -> NDArray[np.float32]:
    """Draw the first surfaces (count, size, size, 3) of a split of the broad set.

    The result does not depend on the number of processors, and neither on the count but for its
    length.

    Parameters
    ----------
    split : {"train", "validation", "test"}
    count, seed, size : int
        As for :func:`gso.dataset.broad.draw`.
    tick : callable, optional
        Progress callback, called with the number of surfaces drawn.

    Raises
    ------
    DatasetError
        A worker process failed.

    Examples
    --------
    >>> draw_broad("test", 2, seed=0, size=16).shape
    (2, 16, 16, 3)
    """
    blocks = [range(k, min(k + _BLOCK, count)) for k in range(0, count, _BLOCK)]
    work = partial(_of_split, split, seed, size)
    return _drawn(work, blocks, [len(block) for block in blocks], size, tick)


def _drawn(
    work: Callable[[Any], NDArray[np.float32]],
    items: Sequence[Any],
    counts: Sequence[int],
    size: int,
    tick: Callable[[int], None] | None,
) -> NDArray[np.float32]:
    """Draw the surfaces of some items, of which each has so many, in parallel."""
    ends = np.cumsum(counts, dtype=int)
    drawn = np.empty((sum(counts), size, size, 3), np.float32)
    workers = 0 if len(drawn) < _MANY else processors()
    ready = 0
    with open_executor(workers) as executor:
        for done in executor.as_completed(work, items):
            if done.error is not None:
                raise DatasetError(f"surfaces of {items[done.index]}: {done.error}")
            drawn[ends[done.index] - counts[done.index] : ends[done.index]] = done.result
            ready += counts[done.index]
            if tick is not None:
                tick(ready)
    return drawn


def _of_split(split: str, seed: int, size: int, numbers: range) -> NDArray[np.float32]:
    grids = [broad.draw(split, number, seed=seed, size=size) for number in numbers]
    return np.stack(grids).astype(np.float32)


def _sampled(piece: tuple[int, int], size: int) -> NDArray[np.float32]:
    count, seed = piece
    return bezier.sample_many(bezier.generate(count, seed=seed), size).astype(np.float32)
