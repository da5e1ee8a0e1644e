"""Prices of chords of the flat image: how much the normal of the design varies along them."""

from __future__ import annotations

import numpy as np

from gso.ruled.domain import Domain
from gso.typing import Array

#: Samples along a chord.
_SAMPLES = 9
#: Price of the share of a chord outside an outline whose slots no chord crosses.
_OUTSIDE = 100.0


def prices(domain: Domain, outline: Array, *, slots: bool = True) -> tuple[Array, Array]:
    """Measure the chords between points (n, 2) of the outline.

    Parameters
    ----------
    domain : Domain
    outline : ndarray, (n, 2)
    slots : bool
        Whether holes and narrow slots are inside.

    Returns
    -------
    price : ndarray, (n, n)
        The variance of the design's normal along the chord times the squared length of the
        chord, plus that square times the share of the chord outside the outline, with a large
        factor where slots are not inside.
    normal : ndarray, (n, n, 3)
        The mean normals along the chords.
    """
    n = len(outline)
    first, second = np.triu_indices(n, 1)
    price, normal = np.zeros((n, n)), np.zeros((n, n, 3))
    ends = outline[first], outline[second]
    price[first, second], normal[first, second] = along(domain, *ends, slots=slots)
    return price + price.T, normal + normal.transpose(1, 0, 2)


def along(domain: Domain, one: Array, other: Array, *, slots: bool = True) -> tuple[Array, Array]:
    """Return the prices (k,) and mean normals (k, 3) of chords with ends (k, 2), (k, 2)."""
    t = ((np.arange(_SAMPLES) + 0.5) / _SAMPLES)[:, None]
    places = (one[:, None] * (1.0 - t) + other[:, None] * t).reshape(-1, 2)
    normals, feet = domain.sample(domain.normals, places)
    normals = normals.reshape(len(one), _SAMPLES, 3)
    mean = normals.mean(axis=1)
    varying = ((normals - mean[:, None]) ** 2).sum(axis=2).mean(axis=1)
    gap = np.linalg.norm(feet - places, axis=1).reshape(len(one), _SAMPLES)
    outside = gap > 1e-6 * domain.margin
    if slots:
        outside[outside] = ~domain.encloses(places.reshape(*outside.shape, 2)[outside])
    share = (1.0 if slots else _OUTSIDE) * outside.mean(axis=1)
    return np.asarray((varying + share) * ((one - other) ** 2).sum(axis=1)), mean
