"""What the readers of all formats share: bytes in, polygons to faces, equal vertices."""

from __future__ import annotations

import os
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from gso.status import MeshError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def read_bytes(path: str | PathLike[str]) -> bytes:
    """Content of a regular file; whatever is wrong with it is a MeshError.

    The message does not name the file: :func:`gso.io.load` puts the name before it.
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
    """A copy in double precision; signalling NaNs of damaged files do so in silence."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def ranges(first: Ints, count: Ints) -> Ints:
    """The integers ``first[i] ... first[i] + count[i] - 1``, one range after the other.

    >>> ranges(np.array([5, 0]), np.array([2, 3]))
    array([5, 6, 0, 1, 2])
    """
    before = np.cumsum(count) - count
    return np.repeat(first - before, count) + np.arange(int(count.sum()))


def face_table(corners: Ints, count: Ints) -> tuple[Ints, tuple[str, ...]]:
    """Faces (m, 3) or (m, 4) from polygons, and what was done to them.

    Parameters
    ----------
    corners : ndarray of int, (sum of count,)
        Vertex indices, polygon after polygon.
    count : ndarray of int, (p,)
        Corners of each polygon, at least three. Polygons with five and more are cut into
        triangles that share their first corner, in place.

    Examples
    --------
    >>> face_table(np.arange(8), np.array([3, 5]))[0]
    array([[0, 1, 2],
           [3, 4, 5],
           [3, 5, 6],
           [3, 6, 7]])
    """
    corners = corners.astype(np.int64, copy=False)
    first = np.cumsum(count) - count
    many = count > 4
    pieces = np.where(many, count - 2, 1)
    polygon = np.repeat(np.arange(count.size), pieces)
    piece = ranges(np.zeros_like(pieces), pieces)
    size = np.where(many, 3, count)[polygon]
    table = np.full((polygon.size, int(size.max(initial=3))), -1, np.int64)
    table[:, 0] = corners[first[polygon]]
    for k in range(1, table.shape[1]):
        inside = k < size
        table[inside, k] = corners[first[polygon[inside]] + piece[inside] + k]
    if not many.any():
        return table, ()
    note = (
        f"{int(many.sum())} polygons with more than four corners were cut into triangles "
        f"(the first is face {int(many.argmax())})"
    )
    return table, (note,)


def weld(points: Array, faces: Ints) -> tuple[Array, Ints, tuple[str, ...]]:
    """Merge vertices with equal coordinates; triangles that collapse are left out.

    Vertices keep the order in which they first occur.
    """
    order = np.lexsort(points.T)
    fresh = np.ones(len(points), bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    # lexsort is stable: the first of each run is the one that occurs first.
    run = np.cumsum(fresh) - 1
    kept, rank = np.unique(order[fresh], return_inverse=True)
    ids = np.empty(len(points), np.int64)
    ids[order] = rank[run]
    table = ids[faces]
    flat = (table == np.roll(table, -1, axis=1)).any(axis=1)
    if not flat.any():
        return points[kept], table, ()
    note = f"{int(flat.sum())} triangles with two equal corners were left out"
    return points[kept], table[~flat], (note,)
