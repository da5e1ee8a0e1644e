"""Grids of quads: their faces, and their recognition in a mesh."""

from __future__ import annotations

import numpy as np

from gso.mesh.topology.half_edges import HalfEdges
from gso.typing import Ints


def grid_faces(height: int, width: int) -> Ints:
    """List the quads of a grid whose vertices are numbered row by row.

    Face (i, j) is (i, j), (i+1, j), (i+1, j+1), (i, j+1). Its first diagonal, between corners
    0 and 2, is the one along which the package splits grid cells into triangles.
    """
    v = np.arange(height * width).reshape(height, width)
    corners = (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:])
    return np.stack([c.ravel() for c in corners], axis=1)


def recognise_grid(he: HalfEdges, faces: Ints) -> Ints | None:
    """Find the vertex ids (H, W) of a quad mesh that is a grid; None if it is not.

    The grid has at least 3 x 3 vertices, in any numbering. Corner (0, 0) is the grid corner
    with the smallest id. The first axis follows the half-edge of the face that starts there, so
    a grid that was written row by row is found row by row.
    """
    if faces.shape[1] != 4 or (faces[:, 3] < 0).any():
        return None
    corner = np.flatnonzero(he.face_count == 1)
    if corner.size != 4 or (he.face_count == 0).any():
        return None
    h = int(np.flatnonzero(he.origin == corner.min())[0])
    column = [h]
    while (across := he.twin[he.next[column[-1]]]) >= 0 and len(column) <= len(faces):
        column.append(int(he.next[across]))
    rows = [np.array(column)]
    while True:
        across = he.twin[he.next[he.next[rows[-1]]]]
        if (across < 0).all():
            break
        if (across < 0).any() or len(rows) * len(column) > len(faces):
            return None
        rows.append(across)
    table = np.stack(rows, axis=1)
    if table.size != len(faces) or np.unique(he.face[table]).size != len(faces):
        return None
    height, width = table.shape[0] + 1, table.shape[1] + 1
    if min(height, width) < 3:
        return None
    ids = np.empty((height, width), np.int64)
    ids[:-1, :-1] = he.origin[table]
    ids[-1, :-1] = he.dest[table[-1]]
    ids[:-1, -1] = he.origin[he.prev[table[:, -1]]]
    ids[-1, -1] = he.dest[he.next[table[-1, -1]]]
    if np.unique(ids).size != he.vertex_count:
        return None
    return ids
