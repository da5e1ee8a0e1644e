"""Differences along polylines."""

from __future__ import annotations

from gso.typing import S, Vec


def second_difference(a: Vec[S], b: Vec[S], c: Vec[S]) -> Vec[S]:
    """Return the second difference ``a - 2 b + c`` of three consecutive polyline vertices.

    The fairness of Jiang et al. 2020 is the sum of its squares over a mesh's polylines.

    >>> second_difference((0., 0.), (1., 1.), (2., 4.))
    (0.0, 2.0)
    """
    return tuple(p - 2.0 * q + r for p, q, r in zip(a, b, c, strict=True))
