"""The broad set: random surfaces of several families, on uneven grids of many sizes.

Surfaces are drawn as their users' grids, with 32 to 256 vertices along a side, sides of a ratio
up to 4, sheared and unevenly spaced, some of them with noise, and then resampled to the size of
the set as :func:`gso.net.predict` resamples its input.
"""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.dataset import screen
from gso.dataset.bezier import normalise
from gso.dataset.broad.families import FAMILIES, Surface
from gso.dataset.seeds import RNG, Stream, generator
from gso.errors import DatasetError
from gso.hierarchy import resample
from gso.typing import Array

#: Splits, and the number of each in the seeds.
SPLITS = ("train", "validation", "test")
#: Least and largest number of vertices along a side of a grid.
SMALLEST, LARGEST = 32, 256
#: Largest mean |K| in the unit ball: twice the recipe's.
CURVED = 2.0 * screen.CURVATURE[-1]
#: Share of surfaces with noise, and its least and largest standard deviation over the shortest
#: distance of rows or columns.
_NOISY, _NOISE = 0.08, (1e-4, 2e-2)
#: Largest shear, and largest relative change of the spacing along a side.
_SHEAR, _UNEVEN = 0.4, 0.5
#: Draws after which a family is given up.
_TRIES = 200


def families(split: str) -> list[str]:
    """Return the families of a split.

    >>> families("test")
    ['constant_mean_curvature', 'grid_shell']
    """
    return [name for name, one in FAMILIES.items() if one.split == split]


def family(split: str, number: int) -> str:
    """Return the family of a surface of a split; they alternate.

    >>> family("train", 0), family("test", 1)
    ('b_spline', 'grid_shell')
    """
    names = families(split)
    return names[number % len(names)]


def draw(split: str, number: int, *, seed: int, size: int = 64) -> Array:
    """Draw a surface (size, size, 3) of a split, in the unit ball.

    It depends on nothing but these arguments.

    Parameters
    ----------
    split : {"train", "validation", "test"}
    number : int
        Position in the split, which may be of any length.
    seed : int
        Seed of the set.
    size : int
        Samples along each side.

    Raises
    ------
    DatasetError
        The family gave no sound surface within many draws.

    Examples
    --------
    >>> draw("test", 0, seed=0, size=16).shape
    (16, 16, 3)
    """
    name = family(split, number)
    rng = generator(seed, Stream.BROAD, SPLITS.index(split), number)
    for _ in range(_TRIES):
        grid = normalise(_as_drawn(FAMILIES[name].draw(rng), rng))
        noisy = rng.random() < _NOISY
        # Whether a surface is taken does not depend on the size that is asked for.
        seen = normalise(resample(grid, screen.SIZE, screen.SIZE))
        if not np.isfinite(seen).all() or not screen.sound(seen[None])[0]:
            continue
        if metrics.loss_gc_worst(seen, scale=1.0) > CURVED:
            continue
        points = seen if size == screen.SIZE else normalise(resample(grid, size, size))
        if noisy:
            step = min(np.linalg.norm(np.diff(seen, axis=k), axis=-1).mean() for k in (0, 1))
            sigma = step * np.exp(rng.uniform(*np.log(_NOISE)))
            points = normalise(points + sigma * rng.standard_normal(points.shape))
        return points
    raise DatasetError(f"{_TRIES} draws of the family {name!r} gave no sound surface")


def _as_drawn(surface: Surface, rng: RNG) -> Array:
    """Sample a surface on a sheared, uneven grid of a random size."""
    h, w = (int(n) for n in np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST + 1), 2)))
    s, t = (_uneven(np.linspace(-1.0, 1.0, n), rng) for n in (h, w))
    u, v = np.meshgrid(s, t, indexing="ij")
    shear = rng.uniform(-_SHEAR, _SHEAR, 2) * (rng.random() < 0.5)
    # The sheared square is scaled to fit into the domain.
    most = 1.0 + np.abs(shear)
    return surface((u + shear[0] * v) / most[0], (v + shear[1] * u) / most[1])


def _uneven(t: Array, rng: RNG) -> Array:
    """Change the spacing of parameters in [-1, 1], smoothly and by a random amount."""
    amount = rng.uniform(-_UNEVEN, _UNEVEN) * (rng.random() < 0.5)
    if rng.random() < 0.5:
        return np.asarray(t + amount * np.sin(np.pi * t) / np.pi)
    return np.asarray(t + 0.5 * amount * (t * t - 1.0))
