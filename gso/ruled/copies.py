"""Copies of vertices, so that faces are joined by edges only."""

from __future__ import annotations

import numpy as np

from gso.mesh.topology import label_components
from gso.typing import Array, Ints


def copies(faces: Ints, part: Ints) -> tuple[Ints, Ints]:
    """Number copies of vertices: corners have the same one if edges of one part join their faces.

    Parameters
    ----------
    faces : ndarray of int, (m, 4)
        Vertices; -1 as the fourth of a triangle.
    part : ndarray of int, (m,)
        The part of each face; edges between parts are cut.

    Returns
    -------
    vertex : ndarray of int, (n,)
        The vertex that each copy is of; in the order of the parts, and of the vertices in each.
    table : ndarray of int, (m, 4)
        The faces as copies.
    """
    face, corner = np.nonzero(faces >= 0)
    ids = faces[face, corner]
    number = np.full(faces.shape, -1)
    number[face, corner] = np.arange(len(ids))
    size = (faces >= 0).sum(axis=1)
    after = number[face, (corner + 1) % size[face]]
    # Sides of faces as corners (s, 2), the smaller vertex first, side by side with their twins.
    sides = np.stack([number[face, corner], after], axis=1)
    turned = ids[sides[:, 0]] > ids[sides[:, 1]]
    sides[turned] = sides[turned][:, ::-1]
    order = np.lexsort((ids[sides[:, 1]], ids[sides[:, 0]], part[face]))
    sides = sides[order]
    same = (ids[sides[1:]] == ids[sides[:-1]]).all(axis=1)
    same &= part[face][order][1:] == part[face][order][:-1]
    i, j = sides[:-1][same].ravel(), sides[1:][same].ravel()
    which = label_components(len(ids), i, j)
    _, first = np.unique(which, return_index=True)
    order = np.lexsort((ids[first], part[face][first]))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    table = np.full_like(faces, -1)
    table[face, corner] = rank[which]
    return ids[first[order]], table


def with_copies(points: Array, faces: Ints) -> tuple[Array, Ints]:
    """Give each part of a surface that only touches others in a point its own vertex there."""
    vertex, table = copies(faces, np.zeros(len(faces), np.int64))
    return points[vertex], table
