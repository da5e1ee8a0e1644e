"""Smoothness of curves on the surface: their second derivatives."""

from __future__ import annotations

import numpy as np

from gso.energy import fairness
from gso.energy.base import Term
from gso.typing import Array, Ints

#: Translations cancel, as the coefficients sum to zero; rotations turn the vector of residuals.
INVARIANT = ("translation",)

residual = fairness.residual


def build(triples: Ints, steps: Array, *, block: str = "surface", weight: float = 1.0) -> Term:
    """Build the mean squared second derivative of curves through vertices.

    Parameters
    ----------
    triples : ndarray of int, (t, 3)
        Consecutive vertices of the curves.
    steps : ndarray, (t, 2)
        Distances from the middle vertex to the one before and to the one after it.
    block : str
        Block of the vertices.
    weight : float
        Factor on the mean.
    """
    before, after = steps.T
    # Second divided difference: exact on quadratic functions of the arc length.
    scale = 2.0 / (before + after)
    coefficients = scale * np.stack([1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after])
    dim = 2 if block == "flat" else 3
    return Term(
        "smooth_curve",
        residual,
        ((block, triples),),
        weights=np.full(len(triples), weight / max(len(triples), 1)),
        constants=np.concatenate([coefficients, np.zeros((dim, len(triples)))]),
        linear=True,
    )
