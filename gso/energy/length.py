"""Prescribed distances between vertices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.typing import Array, Ints, S, Vec

#: Rigid motions change no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``(l'^2 - l^2) / 2l``: about ``l' - l`` near zero, and smooth at ``l' = 0``.

    Constants: the target length l, and a shift, 0 for a soft term.
    """
    length, shift = constants
    square = geometry.norm2(geometry.sub(points[1], points[0]))
    return ((square / length - length) * 0.5 + shift,)


def build(pairs: Ints, lengths: Array, *, block: str = "surface", weight: float = 1.0) -> Term:
    """Build target `lengths` (k,) between pairs (k, 2) of vertices of a block, equal weights."""
    return Term(
        "length",
        residual,
        ((block, pairs),),
        weights=np.full(len(pairs), weight),
        constants=np.stack([lengths, np.zeros(len(pairs))]),
    )
