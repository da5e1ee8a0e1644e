"""Soft position constraints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.geometry import sub
from gso.typing import Array, Ints, S, Vec

#: The targets do not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the displacement from the target position."""
    return sub(points[0], tuple(constants))


def build(ids: Ints, positions: Array, weights: Array, *, block: str = "surface") -> Term:
    """Build soft targets `positions` (k, dim) of vertices `ids` (k,), with `weights` (k,)."""
    return Term(
        "position",
        residual,
        ((block, np.asarray(ids)[:, None]),),
        weights=np.asarray(weights, float),
        constants=np.asarray(positions, float).T.copy(),
        linear=True,
    )
