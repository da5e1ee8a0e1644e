"""Parallel generation of many random surfaces of the recipe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gso import parallel
from gso.dataset import bezier
from gso.errors import DatasetError

#: Smallest number of surfaces for which starting worker processes pays off.
_MANY = 4096


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
    ends = np.cumsum(counts, dtype=int)
    drawn = np.empty((sum(counts), size, size, 3), np.float32)
    workers = 0 if len(drawn) < _MANY else parallel.processors()
    ready = 0
    work = partial(_sampled, size=size)
    with closing(parallel.spread(work, pieces, workers=workers)) as results:
        for done in results:
            if done.error is not None:
                raise DatasetError(f"surfaces of seed {pieces[done.index][1]}: {done.error}")
            drawn[ends[done.index] - counts[done.index] : ends[done.index]] = done.value
            ready += counts[done.index]
            if tick is not None:
                tick(ready)
    return drawn


def _sampled(piece: tuple[int, int], size: int) -> NDArray[np.float32]:
    count, seed = piece
    return bezier.sample_many(bezier.generate(count, seed=seed), size).astype(np.float32)
