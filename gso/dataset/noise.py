"""Noise for the denoising task: one sample per surface, scaled to each level."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gso.dataset.seeds import Stream, generator

#: The split with noise, and the standard deviations of the noise for surfaces whose farthest
#: vertex from the centroid has distance 1 (Wang et al. 2024, Table 3).
SPLIT = "test"
LEVELS = (0.001, 0.005, 0.010, 0.015)


def draw(seed: int, numbers: Sequence[int], size: int) -> NDArray[np.float32]:
    """Return standard normal noise (b, size, size, 3) for the draws `numbers` of a seed.

    >>> bool((draw(0, [7, 8], 16)[1] == draw(0, [8], 16)[0]).all())
    True
    """
    streams = (generator(seed, Stream.NOISE, number) for number in numbers)
    return np.stack([rng.standard_normal((size, size, 3)) for rng in streams]).astype(np.float32)
