"""Surfaces of polygons with any number of corners."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.io.source import face_table
from gso.mesh.validation import checked_vertices
from gso.typing import Ints


def are_polygons(faces: Any) -> bool:
    """Tell whether faces are sequences that no array (m, 3) or (m, 4) holds.

    >>> are_polygons([[0, 1, 2], [0, 2, 3, 4]]), are_polygons([[0, 1, 2], [0, 2, 3]])
    (True, False)
    """
    if not isinstance(faces, list | tuple):
        return False
    sizes = {len(row) for row in faces if isinstance(row, list | tuple | np.ndarray)}
    return len(sizes) > 1 or max(sizes, default=0) > 4


def of_polygons(vertices: ArrayLike, polygons: Sequence[Sequence[int]]) -> Surface:
    """Make a surface of polygons; those with five or more corners are cut into triangles.

    Parameters
    ----------
    vertices : array_like, (n, 3)
    polygons : sequence of sequences of int
        The vertices of each face, three or more.

    Raises
    ------
    MeshError
        A face has fewer corners, or one that is no number of a vertex. The message names it.

    Examples
    --------
    >>> house = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 2, 0], [0, 1, 0]]
    >>> of_polygons(house, [[0, 1, 2, 3, 4]]).mesh()
    Mesh(5 vertices, 3 faces, triangles)
    """
    points = checked_vertices(vertices)
    corners, count = _rows(polygons, len(points))
    faces, polygon, notes = face_table(corners, count, points)
    return Surface(points, faces, notes, polygon=polygon)


def face_rows(faces: Ints) -> list[list[int]]:
    """Return faces (m, k) as lists, without the -1 of those with fewer corners.

    >>> face_rows(np.array([[0, 1, 2, -1], [0, 2, 3, 4]]))
    [[0, 1, 2], [0, 2, 3, 4]]
    """
    return [[corner for corner in row if corner >= 0] for row in faces.tolist()]


def _rows(polygons: Sequence[Sequence[int]], vertices: int) -> tuple[Ints, Ints]:
    """Return the corners of all polygons, one after another, and the number of each."""
    try:
        rows = [[index(corner) for corner in row] for row in polygons]
    except TypeError as error:
        raise MeshError(f"faces must be rows of vertex numbers: {error}") from None
    count = np.array([len(row) for row in rows], np.int64)
    if (count < 3).any():
        face = int((count < 3).argmax())
        raise MeshError(f"face {face} = {rows[face]} has fewer than three corners; leave it out")
    corners = np.fromiter((corner for row in rows for corner in row), np.int64, count.sum())
    outside = (corners < 0) | (corners >= vertices)
    if outside.any():
        face = int(np.repeat(np.arange(len(rows)), count)[outside.argmax()])
        raise MeshError(
            f"face {face} = {rows[face]} names a vertex that is not there: they are numbered from "
            f"0 to {vertices - 1}"
        )
    return corners, count
