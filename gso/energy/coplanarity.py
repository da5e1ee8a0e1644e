"""Coplanarity of points with three others: planar polygons with any number of corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.typing import Ints, S, Vec

#: Rigid motions do not change coplanarity.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the distance of the fourth point from the plane of the others, plus a shift."""
    a, b, c, p = points
    normal = geometry.cross(geometry.sub(b, a), geometry.sub(c, a))
    return (geometry.dot(normal, geometry.sub(p, a)) / geometry.norm(normal) + constants[0],)


def build(points: Ints, *, weight: float = 1.0) -> Term:
    """Build the coplanarity of four points (k, 4), each with the same weight."""
    return Term(
        "coplanarity",
        residual,
        (("surface", points),),
        weights=np.full(len(points), weight),
        constants=np.zeros((1, len(points))),
    )
