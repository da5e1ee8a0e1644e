"""Helpers shared by all readers: reading bytes, converting polygons to faces."""

from __future__ import annotations

import os
from contextlib import suppress

import numpy as np

from gso.errors import MeshError
from gso.geometry.ears import ears, in_plane
from gso.typing import AnyPath, Array, Flags, Ints

# Largest number of fan apexes tried per polygon, because the work is quadratic.
_MOST_APEXES = 64


def read_bytes(path: AnyPath) -> bytes:
    """Read a file; any failure, and an empty file, raises a MeshError.

    The message does not name the file: :func:`gso.io.load` prepends the name.
    """
    if os.path.isdir(path):
        raise MeshError("is a folder; give the name of a mesh file in it")
    try:
        with open(path, "rb") as file:
            data = file.read()
    except FileNotFoundError:
        raise MeshError("there is no such file; check the name and the folder") from None
    except (OSError, ValueError) as error:
        raise MeshError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not data.strip():
        raise MeshError("the file is empty; write it again")
    return data


def doubles(values: np.ndarray) -> Array:
    """Copy to double precision, without warnings for signalling NaNs of damaged files."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def ranges(first: Ints, count: Ints) -> Ints:
    """Return the integers ``first[i] ... first[i] + count[i] - 1``, range after range.

    >>> ranges(np.array([5, 0]), np.array([2, 3]))
    array([5, 6, 0, 1, 2])
    """
    before = np.cumsum(count) - count
    return np.repeat(first - before, count) + np.arange(int(count.sum()))


def face_table(corners: Ints, count: Ints, points: Array) -> tuple[Ints, tuple[str, ...]]:
    """Convert polygons to faces (m, 3) or (m, 4); return them and notes on changes.

    Parameters
    ----------
    corners : ndarray of int, (sum of count,)
        Vertex indices, polygon after polygon.
    count : ndarray of int, (p,)
        Corners of each polygon, at least three. A polygon with five or more corners is
        replaced by a triangle fan at its place in the sequence, or where a fan leaves it by other
        triangles inside.
    points : ndarray, (n, 3)
        The vertices. The apex of a fan is the corner that maximises the smallest triangle
        area (signed by the polygon normal), which avoids degenerate triangles at collinear
        corners.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    >>> face_table(np.array([0, 1, 2, 3, 4]), np.array([5]), points)[0]
    array([[1, 2, 3],
           [1, 3, 4],
           [1, 4, 0]])
    """
    corners = corners.astype(np.int64, copy=False)
    place, _, notes = face_corners(corners, count, points)
    return np.where(place < 0, -1, corners[place]), notes


def face_corners(corners: Ints, count: Ints, points: Array) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Convert polygons to faces as :func:`face_table` does, as positions in `corners`.

    Returns the positions (m, k) with -1 as padding, the polygon of each face (m,), and notes.
    """
    first = np.cumsum(count) - count
    many = count > 4
    apex, fan = np.zeros_like(count), np.ones(count.size, bool)
    for size in np.unique(count[many]):
        same = np.flatnonzero(count == size)
        rings = points[corners[first[same][:, None] + np.arange(size)]]
        apex[same], fan[same] = _fan_apex(rings)
    pieces = np.where(many, count - 2, 1)
    polygon = np.repeat(np.arange(count.size), pieces)
    piece = ranges(np.zeros_like(pieces), pieces)
    size = np.where(many, 3, count)[polygon]
    table = np.full((polygon.size, int(size.max(initial=3))), -1, np.int64)
    for k in range(table.shape[1]):
        inside = k < size
        p = polygon[inside]
        turn = apex[p] + (piece[inside] + k if k else 0)
        table[inside, k] = first[p] + turn % count[p]
    for p in np.flatnonzero(~fan).tolist():
        # A fan of a concave polygon would leave it.
        ring = first[p] + np.arange(count[p])
        with suppress(ValueError):
            table[polygon == p, :3] = ring[ears(in_plane(points[corners[ring]]))]
    if not many.any():
        return table, polygon, ()
    note = (
        f"{int(many.sum())} polygons with more than four corners were cut into triangles "
        f"(the first is face {int(many.argmax())})"
    )
    return table, polygon, (note,)


def _fan_apex(rings: Array) -> tuple[Ints, Flags]:
    """Return the best fan apex of each polygon (n, k, 3), and whether no triangle is inverted.

    It is the apex whose smallest triangle is largest.
    """
    with np.errstate(all="ignore"):
        p = rings - rings.mean(axis=1, keepdims=True)
        normal = np.cross(p, np.roll(p, -1, axis=1)).sum(axis=1, keepdims=True)
        best = np.full(len(p), -np.inf)
        apex = np.zeros(len(p), np.int64)
        for k in range(min(p.shape[1], _MOST_APEXES)):
            q = np.roll(p, -k, axis=1)
            area = np.cross(q[:, 1:-1] - q[:, :1], q[:, 2:] - q[:, :1])
            smallest = (area * normal).sum(axis=2).min(axis=1)
            better = smallest > best
            best[better], apex[better] = smallest[better], k
    return apex, np.isnan(best) | (best >= 0)
