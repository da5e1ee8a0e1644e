"""How far figures spread: of means by bootstrap over surfaces, of times by repeated runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.typing import Array

#: Resamples of the surfaces, and the percentiles that bound 95 % of their means.
_RESAMPLES, _BOUNDS = 1000, (2.5, 97.5)

Interval = tuple[float, float]


def of_means(values: Array) -> list[Interval]:
    """Return the 95 % interval of the mean of each column of values (surfaces, metrics).

    The surfaces are drawn again with replacement, in the same way for all columns.

    >>> low, high = of_means(np.random.default_rng(0).normal(1.0, 0.5, (400, 1)))[0]
    >>> 0.9 < low < 1.0 < high < 1.1
    True
    """
    count = len(values)
    rng = np.random.default_rng(0)
    times = rng.multinomial(count, np.full(count, 1.0 / count), _RESAMPLES)
    low, high = np.percentile(times @ values / count, _BOUNDS, axis=0)
    return [(float(a), float(b)) for a, b in zip(low, high, strict=True)]


def of_runs(runs: Sequence[Sequence[float]]) -> Interval | None:
    """Return the smallest and largest median time of several runs over the same surfaces.

    `runs` has the times of each surface, one for each run; None where there was one run only.

    >>> of_runs([[1.0, 1.5], [3.0, 3.0], [2.0, 2.5]])
    (2.0, 2.5)
    """
    if not runs or min(map(len, runs)) < 2:
        return None
    medians = np.median(np.array([times[: min(map(len, runs))] for times in runs]), axis=0)
    return float(medians.min()), float(medians.max())
