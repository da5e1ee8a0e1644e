"""Offsets along the vertex normals of a reference surface: one unknown per vertex."""

from __future__ import annotations

import numpy as np

from gso.typing import Array
from gso.unknowns.base import Layout, Variables


def normal_offsets(layout: Layout, points: Array, normals: Array) -> Variables:
    """Make vertices = points + unknowns * normals, on the block "surface".

    Parameters
    ----------
    points, normals : ndarray, (n, 3)
        Points at zero offset, and unit normals.
    """
    from scipy.sparse import csr_matrix

    n = len(points)
    basis = csr_matrix(
        (normals.ravel(), np.repeat(np.arange(n), 3), np.arange(3 * n + 1)), shape=(3 * n, n)
    )
    return Variables(layout, basis, layout.pack({"surface": points}))
