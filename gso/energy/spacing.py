"""Least spacing of points that follow each other along given directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.geometry import dot, ops, sub
from gso.typing import Array, Ints, S, Vec

#: Translations move both points.
INVARIANT = ("translation",)


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return by how much the way between two points is too short.

    Constants: a direction divided by a length (3), then the least way in units of that length.
    """
    way = dot(sub(points[1], points[0]), tuple(constants[:3]))
    return (ops.minimum(way - constants[3], 0.0),)


def build(edges: Ints, directions: Array, weights: Array, *, least: float) -> Term:
    """Build the least spacing of the ends of edges (k, 2).

    Parameters
    ----------
    edges : ndarray of int, (k, 2)
    directions : ndarray, (k, 3)
        Unit directions divided by lengths.
    weights : ndarray, (k,)
    least : float
        Least way along the direction, in units of that length.
    """
    bound = np.full((1, len(weights)), least)
    return Term(
        "spacing",
        residual,
        (("surface", edges),),
        weights=weights,
        constants=np.concatenate([directions.T, bound]),
    )
