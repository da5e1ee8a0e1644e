"""Planarity of quads: the distance between their diagonals, and its derivatives."""

from __future__ import annotations

import numpy as np

from gso.geometry.vectors import cross, lengths
from gso.typing import Array


def planarity(corners: Array) -> tuple[Array, Array]:
    """Return the signed distances (q,) between the diagonals of quads, and derivatives.

    The derivatives (q, 4, 3) by the corners leave out the change of the length by which the
    volume is divided, which is exact for planar quads.

    Parameters
    ----------
    corners : ndarray, (q, 4, 3)
        Both ends of a ruling, then both ends of the next one.
    """
    p, q, p1, q1 = corners.transpose(1, 0, 2)
    first, second, edge = q1 - p, q - p1, p1 - p
    normal = cross(first, second)
    size = np.maximum(lengths(normal), 1e-300)[:, None]
    by_edge = normal / size
    by_first, by_second = cross(second, edge) / size, cross(edge, first) / size
    slope = [-by_edge - by_first, by_second, by_edge - by_second, by_first]
    return np.einsum("qd,qd->q", edge, by_edge), np.stack(slope, axis=1)
