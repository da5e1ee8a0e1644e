"""Triangulation of simple polygons by cutting ears."""

from __future__ import annotations

import numpy as np

from gso.geometry.polygon import signed_area
from gso.typing import Array, Ints

#: Area, relative to that of the bounding box, up to which a corner is straight.
_STRAIGHT = 1e-12


def ears(polygon: Array) -> Ints:
    """Triangulate a simple polygon (k, 2), concave or not.

    Of the corners that can be cut off, the one whose triangle is the least thin comes first, so
    that points on straight sides give no triangles without area. Corners may repeat, as where a
    hole is joined to the outline by a bridge.

    Returns
    -------
    ndarray of int, (k - 2, 3)
        Corners of the triangles, with the orientation of the polygon.

    Raises
    ------
    ValueError
        The polygon crosses itself, or has no area.

    Examples
    --------
    >>> arrow = np.array([[0.0, 0], [2, 1], [0, 2], [1, 1]])
    >>> ears(arrow).tolist()
    [[3, 0, 1], [1, 2, 3]]
    """
    way = 1.0 if signed_area(polygon) > 0 else -1.0
    z = polygon @ np.array([1.0, 1j * way])
    if _crosses(z):
        raise ValueError("the polygon crosses itself")
    least = _STRAIGHT * float(np.ptp(polygon, axis=0).max()) ** 2
    ring = np.arange(len(z))
    out = []
    while len(ring) > 3:
        a, b, c = np.roll(ring, 1), ring, np.roll(ring, -1)
        area = _cross(z[b] - z[a], z[c] - z[a])
        sides = np.maximum.reduce([abs(z[b] - z[a]), abs(z[c] - z[b]), abs(z[a] - z[c])])
        thin = area / np.maximum(sides, 1e-300) ** 2
        for k in np.argsort(-thin, kind="stable"):
            if area[k] > least and _free(z, ring, a[k], b[k], c[k]):
                break
        else:
            raise ValueError("the polygon crosses itself, or has no area")
        out.append((a[k], b[k], c[k]))
        ring = np.delete(ring, k)
    return np.array([*out, tuple(ring)], np.int64)


def _crosses(z: np.ndarray) -> bool:
    """Tell whether two sides of a polygon cross each other between their ends."""
    p, q = z[:, None], np.roll(z, -1)[:, None]
    a, b = z[None], np.roll(z, -1)[None]
    one = np.sign(_cross(q - p, a - p)) * np.sign(_cross(q - p, b - p))
    other = np.sign(_cross(b - a, p - a)) * np.sign(_cross(b - a, q - a))
    return bool(((one < 0) & (other < 0)).any())


def _free(z: np.ndarray, ring: Ints, a: int, b: int, c: int) -> bool:
    """Tell whether no other corner of a ring lies in a triangle or on its sides."""
    others = z[ring]
    others = others[(others != z[a]) & (others != z[b]) & (others != z[c])]
    inside = np.ones(len(others), bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= _cross(z[q] - z[p], others - z[p]) >= 0
    return not inside.any()


def _cross(p: np.ndarray, q: np.ndarray) -> Array:
    return np.asarray((p.conj() * q).imag)
