"""Barrier against triangles that collapse or turn away from given directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.geometry import cross, dot, ops, sub
from gso.typing import Array, Ints, S, Vec

#: Translations change no area.
INVARIANT = ("translation",)


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return by how much the area seen along a direction is too small, relative to another area.

    Constants: the unit direction divided by twice the other area (3), then the least ratio.
    """
    a, b, c = points
    area = dot(cross(sub(b, a), sub(c, a)), tuple(constants[:3]))
    return (ops.minimum(area - constants[3], 0.0),)


def build(triangles: Ints, directions: Array, weights: Array, *, least: float) -> Term:
    """Build the barrier of triangles (k, 3).

    Parameters
    ----------
    triangles : ndarray of int, (k, 3)
    directions : ndarray, (k, 3)
        Unit directions divided by twice the areas that those of the triangles are compared with.
    weights : ndarray, (k,)
    least : float
        Ratio of areas below which the barrier is active.
    """
    bound = np.full((1, len(weights)), least)
    return Term(
        "facing",
        residual,
        (("surface", triangles),),
        weights=weights,
        constants=np.concatenate([directions.T, bound]),
    )
