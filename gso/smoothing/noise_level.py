"""The standard deviation of a grid's noise, from its differences alone."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from gso.smoothing.base import checked_grid

#: Order of the differences in each direction.
_ORDER = 3
#: Median of the squared length of vectors of three independent standard normal numbers, that is
#: ``2 gammaincinv(3/2, 1/2)``. Written out, as scipy.special takes a tenth of a second to load.
_MEDIAN = 2.3659738843753377


def estimate_sigma(points: ArrayLike) -> float:
    """Estimate the standard deviation of a grid's noise, per coordinate.

    The estimate uses mixed differences, of third order in both directions at once; Immerkaer
    (1996) uses second differences of images. They nearly cancel surfaces with wavelengths above
    ten vertices, and creases along the grid. Their median (Donoho and Johnstone 1994) is robust
    to the few large differences at other creases and steps. Noise that is correlated between
    neighbours is underestimated. At 64 x 64 the estimate scatters by 1.8 %, more than twice as
    much as that of :func:`smooth_grid`, which takes over ten times as long.

    Parameters
    ----------
    points : array_like, (H, W, 3)
        Noisy surface in any unit of length and any position, at least 3 x 3. The noise is
        assumed to be independent and of equal variance in every coordinate. Orders are lowered
        to H - 1 and W - 1 on smaller grids.

    Returns
    -------
    float
        In the unit of the input.

    Raises
    ------
    MeshError
        Not an (H, W, 3) array of finite numbers with at least 3 rows and columns.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(0, 1, 40), np.linspace(0, 1, 30), indexing="ij")
    >>> clean = np.stack([u, v, np.sin(9 * u) * np.sin(9 * v)], axis=-1)
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal(clean.shape)
    >>> bool(abs(estimate_sigma(clean + noise) - 0.01) < 0.0005)
    True
    """
    rest = checked_grid(points)
    size = float(np.abs(rest).max()) or 1.0
    rest, gain = rest / size, 1
    for axis in (0, 1):
        order = min(_ORDER, rest.shape[axis] - 1)
        rest = np.diff(rest, order, axis=axis)
        # Variances grow by the sum of the squared binomial coefficients.
        gain *= comb(2 * order, order)
    return size * float(np.sqrt(np.median((rest**2).sum(axis=-1)) / (gain * _MEDIAN)))
