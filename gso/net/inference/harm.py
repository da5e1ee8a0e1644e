"""Results that are moved back where they would do harm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso.typing import Array

#: Factors on displacements that are tried, where the whole ones would do harm.
_FACTORS = (1.0, 0.5, 0.25)


def harmless(before: Array, after: Array, harm: Callable[[Array], tuple[float, ...]]) -> Array:
    """Return points after a net, moved less far where they would do harm.

    Parameters
    ----------
    before, after : ndarray
        Points of the input and of the result, of one shape.
    harm : callable
        Of such points: numbers that no result may raise.
    """
    allowed = harm(before)
    for factor in _FACTORS:
        moved = after if factor == 1.0 else before + factor * (after - before)
        if all(new <= old for new, old in zip(harm(moved), allowed, strict=True)):
            return moved
    return np.array(before, dtype=np.float64)
