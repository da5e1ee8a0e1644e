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
# Relative area of a triangle below which it is in a line.
_THIN = 1e-12


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


def face_table(corners: Ints, count: Ints, points: Array) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Convert polygons to faces (m, 3) or (m, 4).

    Corners that repeat the one before are left out, and with them polygons of fewer than three
    corners. A polygon with five or more corners is cut into triangles inside it.

    Parameters
    ----------
    corners : ndarray of int, (sum of count,)
        Vertex indices, polygon after polygon.
    count : ndarray of int, (p,)
        Corners of each polygon, at least three.
    points : ndarray, (n, 3)
        The vertices.

    Returns
    -------
    faces : ndarray of int, (m, 3) or (m, 4)
        In the sequence of the polygons.
    polygon : ndarray of int, (m,)
        The polygon of each face.
    notes : tuple of str
        What was changed.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    >>> face_table(np.array([0, 1, 2, 3, 4]), np.array([5]), points)[0]
    array([[1, 2, 3],
           [1, 3, 4],
           [1, 4, 0]])
    """
    corners = corners.astype(np.int64, copy=False)
    place, polygon, notes = face_corners(corners, count, points)
    return np.where(place < 0, -1, corners[place]), polygon, notes


def face_corners(corners: Ints, count: Ints, points: Array) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Convert polygons to faces as :func:`face_table` does, as positions in `corners`.

    Returns the positions (m, k) with -1 as padding, the polygon of each face (m,), and notes.
    """
    kept, left, notes = _distinct(corners, count)
    ring, size = corners[kept], left[left > 0]
    place, polygon = _faces(ring, size, points)
    many = (left > 4).nonzero()[0]
    if many.size:
        notes += (
            f"{many.size} polygons with more than four corners were cut into triangles "
            f"(the first is face {many[0]})",
        )
    return np.where(place < 0, -1, kept[place]), np.flatnonzero(left)[polygon], notes


def _distinct(corners: Ints, count: Ints) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Leave out the corners of polygons that repeat the one before.

    Returns the positions of the others, their number in each polygon (0 for polygons with fewer
    than three), and notes.
    """
    last = np.cumsum(count) - 1
    before = np.arange(-1, corners.size - 1)
    before[last - count + 1] = last
    good = corners != corners[before]
    if good.all():
        return np.arange(corners.size), count, ()
    polygon = np.repeat(np.arange(count.size), count)
    left = np.bincount(polygon[good], minlength=count.size)
    shorter = left < count
    notes = [
        f"{int(shorter.sum())} faces repeat a vertex; it was left out of them "
        f"(the first is face {int(shorter.argmax())})"
    ]
    gone = left < 3
    if gone.any():
        notes.append(
            f"{int(gone.sum())} faces have fewer than three different vertices and were left out "
            f"(the first is face {int(gone.argmax())})"
        )
    left[gone] = 0
    return np.flatnonzero(good & ~gone[polygon]), left, tuple(notes)


def _faces(corners: Ints, count: Ints, points: Array) -> tuple[Ints, Ints]:
    """Return the corners of faces as positions, and the polygon of each face."""
    first = np.cumsum(count) - count
    many = count > 4
    apex = np.zeros_like(count)
    clipped = []
    for k in np.unique(count[many]):
        same = np.flatnonzero(count == k)
        rings = points[corners[first[same][:, None] + np.arange(k)]]
        apex[same], whole = _fan_apex(rings)
        clipped += [(at, rings[i]) for i, at in enumerate(same) if not whole[i]]
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
    begin = np.cumsum(pieces) - pieces
    for at, ring in clipped:
        own = slice(begin[at], begin[at] + pieces[at])
        # A polygon that crosses itself stays a fan.
        with suppress(ValueError), np.errstate(all="ignore"):
            table[own, :3] = first[at] + ears(in_plane(ring))
    return table, polygon


def _fan_apex(rings: Array) -> tuple[Ints, Flags]:
    """Return the best fan apex of each polygon (n, k, 3), and whether its fan lies inside.

    The smallest triangle of the best fan is largest, signed by the normal of the polygon. This
    avoids triangles without area at corners in a line.
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
        inside = best > _THIN * (normal**2).sum(axis=(1, 2))
    return apex, inside
