"""Self-intersections that run along edges, on which no triangle has corners on both sides."""

from __future__ import annotations

import numpy as np

from gso.geometry import area_vectors
from gso.geometry.vectors import cross, unit
from gso.mesh.topology import half_edges
from gso.typing import Array, Flags, Ints

#: Angle in radians by which sheets that touch along a line must differ to cross there.
_ANGLE = 1e-2


def cross_along_edges(points: Array, triangles: Ints, pairs: Ints, depth: Array) -> Flags:
    """Mark the pairs of triangles where an edge of the first lies in the second, and sheets cross.

    Around the line on which they meet, the two triangles of each sheet are four rays. The sheets
    cross if the rays of one are apart on both sides of those of the other. Sheets that end at the
    line do not cross.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
    pairs : ndarray of int, (p, 2)
        Triangles.
    depth : ndarray, (p,)
        Distance within which an edge lies in a triangle.
    """
    out = np.zeros(len(pairs), bool)
    corner = points[triangles]
    normal = unit(area_vectors(points, triangles))
    one, two = pairs.T
    height = np.einsum("pkd,pd->pk", corner[one] - corner[two, :1], normal[two])
    on = np.abs(height) <= depth[:, None]
    at = np.flatnonzero(on.sum(axis=1) == 2)
    if not at.size:
        return out
    lone = (~on[at]).argmax(axis=1)
    one, two, depth = one[at], two[at], depth[at]
    he = half_edges(triangles, len(points))
    edge = (lone + 1) % 3
    twin = he.twin[3 * one + edge]
    inner = twin >= 0
    at, one, two, depth, lone, edge, twin = (
        x[inner] for x in (at, one, two, depth, lone, edge, twin)
    )
    start, end = corner[one, edge], corner[one, (edge + 1) % 3]
    border, long = _met(start, end, corner[two], normal[two], depth)
    axis = unit(end - start)
    first = points[triangles[one, lone]] - start
    second = points[he.dest[he.next[twin]]] - start
    # In a triangle the other sheet goes on in its plane, at its border in the next triangle.
    third = np.cross(normal[two], axis)
    fourth = -third
    side = np.flatnonzero(border >= 0)
    beyond = he.twin[3 * two[side] + border[side]]
    third[side] = points[triangles[two[side], (border[side] + 2) % 3]] - start[side]
    fourth[side] = points[he.dest[he.next[beyond]]] - start[side]
    long[side[beyond < 0]] = False
    out[at] = long & _interleaved(axis, first, second, third, fourth)
    return out


def _met(start: Array, end: Array, other: Array, normal: Array, depth: Array) -> tuple[Ints, Flags]:
    """Clip segments (p, 3) in the planes of triangles (p, 3, 3) by these.

    Returns the side along which each segment runs, -1 for none, and whether they have more than
    a point in common.
    """
    low, high = np.zeros(len(start)), np.ones(len(start))
    border = np.full(len(start), -1)
    for k in range(3):
        p, q = other[:, k], other[:, (k + 1) % 3]
        inwards = unit(cross(normal, q - p))
        a, b = (((x - p) * inwards).sum(axis=1) for x in (start, end))
        border[np.maximum(np.abs(a), np.abs(b)) <= 2.0 * depth] = k
        slope = b - a
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.where(slope == 0, 0.0, (-depth - a) / slope)
        low = np.where(slope > 0, np.maximum(low, root), low)
        high = np.where(slope < 0, np.minimum(high, root), high)
        high = np.where((slope == 0) & (a < -depth), -1.0, high)
    size = np.linalg.norm(end - start, axis=1)
    return border, (high - low) * size > 4.0 * depth


def _interleaved(axis: Array, a: Array, b: Array, c: Array, d: Array) -> Flags:
    """Tell whether exactly one of the rays c, d is between a and b, seen along an axis."""
    x = a - (a * axis).sum(axis=1, keepdims=True) * axis
    y = np.cross(axis, x)

    def angle(ray: Array) -> Array:
        return np.asarray(np.arctan2((ray * y).sum(axis=1), (ray * x).sum(axis=1)) % (2.0 * np.pi))

    turn, rays = angle(b), (angle(c), angle(d))
    between = [ray < turn for ray in rays]
    clear = np.ones(len(axis), bool)
    for ray in rays:
        for other in (0.0 * turn, turn, 0.0 * turn + 2.0 * np.pi):
            clear &= np.abs(ray - other) > _ANGLE
    return np.asarray(clear & (between[0] != between[1]))
