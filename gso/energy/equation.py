"""Linear equations between coordinates as soft constraints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.geometry import dot
from gso.typing import Array, Ints, S, Vec

#: The equations do not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``sum of a_k . p_k - b``. Constants: the components of every a_k, then b."""
    dim = len(points[0])
    total = -constants[-1]
    for k, point in enumerate(points):
        total = total + dot(tuple(constants[dim * k : dim * (k + 1)]), point)
    return (total,)


def build(index: Ints, rows: Array, *, block: str = "surface") -> Term:
    """Build linear equations of vertices as soft constraints.

    Parameters
    ----------
    index : ndarray of int, (e, k)
        Vertices of each equation.
    rows : ndarray, (e, k dim + 1)
        Coefficients of their coordinates, and the right-hand side.
    block : str
        Block of the vertices.
    """
    return Term(
        "equation",
        residual,
        ((block, index),),
        weights=np.ones(len(index)),
        constants=rows.T.copy(),
        linear=True,
    )
