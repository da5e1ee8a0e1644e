"""Triangulation of simple polygons by cutting ears."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.geometry.polygon import area_vector, signed_area
from gso.geometry.vectors import cross, unit
from gso.typing import Array, Ints

#: Area, relative to that of the bounding box, up to which a corner is straight.
_STRAIGHT = 1e-12


def divided(rings: Sequence[Ints], points: Array) -> tuple[Ints, Ints]:
    """Divide nearly planar polygons into triangles; they may cross themselves.

    Parameters
    ----------
    rings : sequence of ndarray of int
        Corners in order; a polygon with n corners has n - 2 triangles.
    points : ndarray, (n, 3)

    Returns
    -------
    triangles : ndarray of int, (t, 3)
    owner : ndarray of int, (t,)
        The polygon of each triangle, in order.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [0.4, 0.4, 0], [0, 2, 0]])
    >>> divided([np.arange(4)], corners)[0].tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    size = np.array([len(ring) for ring in rings])
    owner = [np.flatnonzero(size == 3)]
    out = [np.array([rings[k] for k in owner[0].tolist()], np.int64).reshape(-1, 3)]
    four = np.flatnonzero(size == 4)
    if len(four):
        owner.append(np.repeat(four, 2))
        out.append(_halves(np.array([rings[k] for k in four.tolist()]), points).reshape(-1, 3))
    for k in np.flatnonzero(size > 4).tolist():
        out.append(rings[k][ears(in_plane(points[rings[k]]), simple=False)])
        owner.append(np.full(size[k] - 2, k))
    every = np.concatenate(owner)
    order = np.argsort(every, kind="stable")
    return np.concatenate(out)[order], every[order]


def _halves(quads: Ints, points: Array) -> Ints:
    """Return the triangles of quads (k, 2 x 3) on both sides of the better diagonal."""
    corner = points[quads]
    normal = unit(cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]))
    ways = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])
    a, b, c = np.moveaxis(corner[:, ways], 3, 0)
    area = np.einsum("kwtd,kd->kwt", cross(b - a, c - a), normal)
    sides = sum(((x - y) ** 2).sum(axis=3) for x, y in ((a, b), (b, c), (c, a)))
    thin = (area / np.maximum(sides, 1e-300)).min(axis=2)
    best = ways[thin.argmax(axis=1)].reshape(len(quads), 6)
    return np.take_along_axis(quads, best, axis=1)


def ears(polygon: Array, *, simple: bool = True) -> Ints:
    """Triangulate a simple polygon (k, 2), concave or not.

    Of the corners that can be cut off, the one whose triangle is the least thin comes first, so
    that points on straight sides give no triangles without area. Corners may repeat, as where a
    hole is joined to the outline by a bridge. Polygons that cross themselves are divided, too, if
    `simple` is false; some of their triangles are then inverted.

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
    least = _STRAIGHT * float(np.ptp(polygon, axis=0).max()) ** 2
    if simple and _crosses(z, least):
        raise ValueError("the polygon crosses itself")
    ring = np.arange(len(z))
    out = []
    while len(ring) > 3:
        a, b, c = np.roll(ring, 1), ring, np.roll(ring, -1)
        area = _cross(z[b] - z[a], z[c] - z[a])
        sides = np.maximum.reduce([abs(z[b] - z[a]), abs(z[c] - z[b]), abs(z[a] - z[c])])
        thin = area / np.maximum(sides, 1e-150) ** 2
        best = np.argsort(-thin, kind="stable")
        best = best[area[best] > least].tolist()
        # Points on the sides of an ear are in the way only if there is another one.
        ways = ((k, x) for x in (-least, least) for k in best)
        found = (k for k, x in ways if _free(z, ring, (a[k], b[k], c[k]), x))
        k = next(found, int(np.abs(area).argmin()))
        if simple and area[k] < -least:
            raise ValueError("the polygon crosses itself, or has no area")
        out.append((a[k], b[k], c[k]))
        ring = np.delete(ring, k)
    table = np.array([*out, tuple(ring)], np.int64)
    for _ in range(4 * len(table)):
        area = _cross(z[table[:, 1]] - z[table[:, 0]], z[table[:, 2]] - z[table[:, 0]])
        if area.min() > least or not simple:
            return table
        _turn_side(z, table, int(area.argmin()))
    raise ValueError("the polygon crosses itself, or has no area")


def in_plane(polygon: Array) -> Array:
    """Return a polygon (k, 3) in its plane, (k, 2), from the side where it is anticlockwise.

    Raises
    ------
    ValueError
        It has no area.
    """
    p = polygon - polygon.mean(axis=0)
    normal = area_vector(polygon)
    size = float(np.linalg.norm(normal))
    if size == 0.0:
        raise ValueError("it has no area")
    normal /= size
    x = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    x /= np.linalg.norm(x)
    return np.stack([p @ x, p @ np.cross(normal, x)], axis=1)


def _free(z: np.ndarray, ring: Ints, ear: tuple[int, int, int], depth: float) -> bool:
    """Tell whether no other corner of a ring lies in a triangle, deeper than a doubled area."""
    corners = z[list(ear)]
    others = z[ring]
    others = others[~np.isin(others, corners)]
    inside = np.ones(len(others), bool)
    for p, q in zip(corners, np.roll(corners, -1), strict=True):
        inside &= _cross(q - p, others - p) > depth
    return not inside.any()


def _turn_side(z: np.ndarray, table: Ints, at: int) -> None:
    """Turn the longest side of a triangle without area into the other diagonal of its quad."""
    k = int(np.abs(z[table[at]] - z[np.roll(table[at], -1)]).argmax())
    a, c, b = np.roll(table[at], -k).tolist()
    for number, row in enumerate(table.tolist()):
        for j in range(3):
            if (row[j], row[(j + 1) % 3]) == (c, a):
                d = row[(j + 2) % 3]
                table[at], table[number] = (b, d, c), (b, a, d)
                return
    raise ValueError("the polygon crosses itself, or has no area")


def _crosses(z: np.ndarray, least: float) -> bool:
    """Tell whether two sides of a polygon cross each other between their ends."""
    p, q = z[:, None], np.roll(z, -1)[:, None]
    a, b = z[None], np.roll(z, -1)[None]
    sides = (
        (_cross(q - p, a - p), _cross(q - p, b - p)),
        (_cross(b - a, p - a), _cross(b - a, q - a)),
    )
    apart = [((x > least) & (y < -least)) | ((x < -least) & (y > least)) for x, y in sides]
    return bool((apart[0] & apart[1]).any())


def _cross(p: np.ndarray, q: np.ndarray) -> Array:
    return np.asarray((p.conj() * q).imag)
