"""Points of triangles near reference points, such as nearest points of another surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy import proximity
from gso.energy.base import Term
from gso.typing import Array, Ints, S, Vec

#: The references do not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the proximity of a point of a triangle.

    Constants: its three barycentric coordinates, then those of :func:`proximity.residual`.
    """
    a, b, c = constants[:3]
    place = tuple(a * p + b * q + c * r for p, q, r in zip(*points, strict=True))
    return proximity.residual((place,), constants[3:])


def build(
    triangles: Ints,
    shares: Array,
    targets: Array,
    normals: Array,
    weights: Array,
    *,
    tangential: float = 0.0,
) -> Term:
    """Build the proximity of points of triangles to reference points.

    Parameters
    ----------
    triangles : ndarray of int, (k, 3)
        Corners of the triangle of each point.
    shares : ndarray, (k, 3)
        Barycentric coordinates.
    targets, normals : ndarray, (k, 3)
        Reference points, and unit normals there.
    weights : ndarray, (k,)
    tangential : float
        Factor on the tangential part of the displacement.
    """
    factor = np.full((1, len(weights)), tangential)
    return Term(
        "barycentric",
        residual,
        (("surface", triangles),),
        weights=weights,
        constants=np.concatenate([shares.T, targets.T, normals.T, factor]),
        linear=True,
    )
