"""Independent random streams, derived from one seed, for every surface, noise and shuffle."""

from __future__ import annotations

import enum

import numpy as np

#: A random generator.
RNG = np.random.Generator


class Stream(enum.IntEnum):
    """Purposes of random numbers; the values are part of the recipe."""

    DRAWS = 0
    NOISE = 1
    SPLIT = 2
    SHAPES = 3
    BROAD = 4


def generator(seed: int, stream: Stream, *key: int) -> np.random.Generator:
    """Return the generator of one item of a stream, independent of all others.

    >>> a, b = (generator(0, Stream.DRAWS, k).random() for k in (7, 8))
    >>> a == generator(0, Stream.DRAWS, 7).random(), a == b
    (True, False)
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stream), *key)))
