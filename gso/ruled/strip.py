"""Strips of quads between successive rulings: places on them, and their planarity.

A strip is an array of the ends of its rulings, (m, 2, 3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gso.mesh.closest_point import Nearest
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Distance between diagonals that counts as zero, for strips of diameter one.
_PLANAR = 1e-15
#: Parameters below this are on the border.
_EDGE = 1e-9
#: Largest number of Newton steps of :func:`planarised`.
_STEPS = 8


class Places(NamedTuple):
    """Places on a strip: number of the quad, and the parameters along and across it, (k,) each.

    `s` goes from a ruling to the next, `t` from the first to the second end of a ruling.
    """

    quad: Ints
    s: Array
    t: Array


def corners(ends: Array, quad: Ints) -> tuple[Array, Array, Array, Array]:
    """Return the corners of quads: both ends of a ruling, then both of the next."""
    return ends[quad, 0], ends[quad, 1], ends[quad + 1, 0], ends[quad + 1, 1]


def surface(ends: Array, at: Places) -> tuple[Array, Array, Array]:
    """Return points of the bilinear patches and their derivatives by s and t, (k, 3) each."""
    p, q, p1, q1 = corners(ends, at.quad)
    s, t = at.s[:, None], at.t[:, None]
    here, ahead = (1 - t) * p + t * q, (1 - t) * p1 + t * q1
    return (1 - s) * here + s * ahead, ahead - here, (1 - s) * (q - p) + s * (q1 - p1)


def triangles(count: int) -> Ints:
    """Return triangles of a strip of `count` rulings, whose ends are numbered in turn."""
    k = 2 * np.arange(count - 1)[:, None]
    return np.concatenate([k + np.array([0, 1, 3]), k + np.array([0, 3, 2])])


def _tree(ends: Array) -> Nearest:
    return Nearest.of(ends.reshape(-1, 3), triangles(len(ends)))


def nearest_distances(ends: Array, points: Array) -> Array:
    """Return the distances of points (k, 3) from a strip, split into triangles."""
    return _tree(ends).distances(points)


def nearest(ends: Array, points: Array) -> tuple[Places, Array]:
    """Find the places on a strip nearest to points (k, 3), and which are on its border."""
    count = len(ends) - 1
    which, shares, _ = _tree(ends).locate(points)
    lower = which < count
    s = np.where(lower, shares[:, 2], shares[:, 1] + shares[:, 2])
    t = np.where(lower, shares[:, 1] + shares[:, 2], shares[:, 1])
    at = Places(which % count, s, t)
    position = at.quad + s
    border = (np.minimum(t, 1 - t) < _EDGE) | (np.minimum(position, count - position) < _EDGE)
    inner = np.flatnonzero(~border)
    own = Places(at.quad[inner], at.s[inner], at.t[inner])
    # The triangles are close to the bilinear patches: two Gauss-Newton steps suffice.
    for _ in range(2):
        own = _closer(ends, points[inner], own)
    for whole, part in zip(at, own, strict=True):
        whole[inner] = part
    return at, border


def _closer(ends: Array, points: Array, at: Places) -> Places:
    """Move places by a Gauss-Newton step towards the feet of points."""
    last = len(ends) - 1
    x, along, across = surface(ends, at)
    away = points - x
    a, b, c = ((u * v).sum(axis=1) for u, v in ((along, along), (along, across), (across, across)))
    e, f = (along * away).sum(axis=1), (across * away).sum(axis=1)
    det = np.maximum(a * c - b * b, 1e-12 * a * c + 1e-300)
    position = at.quad + at.s + np.clip((c * e - b * f) / det, -1.0, 1.0)
    position = np.clip(position, 0.0, last)
    quad = np.minimum(position.astype(np.int64), last - 1)
    t = np.clip(at.t + np.clip((a * f - b * e) / det, -0.5, 0.5), 0.0, 1.0)
    return Places(quad, position - quad, t)


def planarity(ends: Array) -> tuple[Array, csr_matrix]:
    """Return the distances (m - 1,) between the diagonals of the quads, and their Jacobian.

    The Jacobian leaves out the change of the length by which the volume is divided, which is
    exact for planar quads.
    """
    p, q, p1, q1 = corners(ends, np.arange(len(ends) - 1))
    first, second, edge = q1 - p, q - p1, p1 - p
    normal = np.cross(first, second)
    size = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    by_edge = normal / size
    by_first, by_second = np.cross(second, edge) / size, np.cross(edge, first) / size
    slope = [-by_edge - by_first, by_second, by_edge - by_second, by_first]
    return (edge * by_edge).sum(axis=1), rows(np.arange(len(p)), np.stack(slope, axis=1), len(ends))


def rows(quad: Ints, slope: Array, count: int) -> csr_matrix:
    """Return rows of a Jacobian from derivatives (k, 4, 3) by the corners of quads."""
    from scipy.sparse import csr_matrix

    column = 6 * quad[:, None] + np.arange(12)
    start = 12 * np.arange(len(quad) + 1)
    return csr_matrix((slope.ravel(), column.ravel(), start), (len(quad), 6 * count))


def planarised(ends: Array) -> Array:
    """Make the quads planar by Newton steps of least norm."""
    for _ in range(_STEPS):
        value, slope = planarity(ends)
        if np.abs(value).max() <= _PLANAR:
            break
        gram = (slope @ slope.T).toarray()
        step = np.linalg.lstsq(gram, value, rcond=1e-14)[0]
        ends = ends - (slope.T @ step).reshape(ends.shape)
    return ends


def gaps(ends: Array, up: Array) -> tuple[Array, Array]:
    """Return the signed distances (m - 1, 2) between successive rulings at both ends.

    They are measured across the rulings, in directions (m - 1, 3) that are also returned. A
    negative gap is a crossing.

    Parameters
    ----------
    ends : ndarray, (m, 2, 3)
        The strip.
    up : ndarray, (m, 3)
        Normals of the design at the rulings.
    """
    side = np.cross(ends[:, 1] - ends[:, 0], up)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
    side = 0.5 * (side[:-1] + side[1:])
    return np.einsum("ked,kd->ke", np.diff(ends, axis=0), side), side
