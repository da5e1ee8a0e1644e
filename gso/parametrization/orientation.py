"""Step limits of the line search that keep iterates away from inverted triangles."""

from __future__ import annotations

import numpy as np

from gso.energy import Limit
from gso.typing import Array, Ints
from gso.unknowns import Layout

#: Largest step, as a fraction of the step at which a triangle degenerates.
SAFETY = 0.9


def orientation(triangles: Ints, layout: Layout) -> Limit:
    """Limit steps so that no triangle of the block "flat" collapses or inverts.

    Along a step the signed area of a triangle is quadratic in the step length. The step is
    limited to :data:`SAFETY` times the smallest positive root over all triangles (Smith and
    Schaefer 2015, Bijective parameterization with free boundaries, section 3.3).
    Triangles that are inverted already are ignored.

    Parameters
    ----------
    triangles : ndarray of int, (t, 3)
        Corners, anticlockwise where the triangle is not inverted.
    layout : Layout
        Layout of the coordinate vector.
    """
    start, count, _ = layout.where("flat")
    part = slice(start, start + 2 * count)
    corners = np.ascontiguousarray(triangles.T)

    def limit(coordinates: Array, direction: Array) -> float:
        e, f = _edges(coordinates[part], corners)
        de, df = _edges(direction[part], corners)
        c = _cross(e, f)
        b = _cross(e, df) + _cross(de, f)
        a = _cross(de, df)
        # 2c / (sqrt(b^2 - 4ac) - b) is the smallest positive root, if there is one.
        with np.errstate(invalid="ignore"):
            steepness = np.sqrt(b * b - 4.0 * a * c) - b
        falling = (steepness > 0) & (c > 0)
        if not falling.any():
            return 1.0
        return float(min(1.0, SAFETY * (2.0 * c[falling] / steepness[falling]).min()))

    return limit


def _edges(flat: Array, corners: Ints) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    x, y = np.ascontiguousarray(flat.reshape(-1, 2).T)
    px, py = x[corners[0]], y[corners[0]]
    return (x[corners[1]] - px, y[corners[1]] - py), (x[corners[2]] - px, y[corners[2]] - py)


def _cross(a: tuple[Array, Array], b: tuple[Array, Array]) -> Array:
    return a[0] * b[1] - a[1] * b[0]
