"""Pairs of faces that may intersect: without common vertices, and close in space."""

from __future__ import annotations

import numpy as np

from gso.faults.boxes import overlapping
from gso.mesh.topology import four_corners
from gso.typing import Array, Flags, Ints

#: Smallest penetration depth of an intersection, relative to the width of the smaller face; less
#: counts as touching.
DEPTH = 1e-3


def candidates(points: Array, faces: Ints, *, touching: bool = False) -> tuple[Ints, Array]:
    """Find the pairs of faces without a common vertex that two simple tests do not separate.

    The tests compare their bounding boxes, and their extents along the line through their
    centres, which separates most of the nearby faces of a smooth surface.

    Parameters
    ----------
    points : ndarray, (n, 2) or (n, 3)
        Vertices.
    faces : ndarray of int, (m, 3) or (m, 4)
        Faces; a triangle among quads ends in -1.
    touching : bool
        Whether to keep pairs that only touch.

    Returns
    -------
    pairs : ndarray of int, (p, 2)
    widths : ndarray, (p,)
        Longest side of the smaller bounding box of each pair.
    """
    ids = np.ascontiguousarray(four_corners(faces).T)
    corners = np.ascontiguousarray(points.T)[:, ids]
    low, high = np.minimum.reduce(corners, axis=1), np.maximum.reduce(corners, axis=1)
    pairs = overlapping(low.T, high.T)
    first, second = pairs.T
    apart = np.ones(len(pairs), bool)
    for i in ids:
        for j in ids:
            apart &= i[first] != j[second]
    first, second = first[apart], second[apart]
    width = np.minimum(*((high - low).max(axis=0)[k] for k in (first, second)))
    centre = corners.mean(axis=1)
    axis = centre[:, second] - centre[:, first]
    length = np.sqrt((axis**2).sum(axis=0))
    here, there = (np.einsum("dkp,dp->kp", corners[:, :, k], axis) for k in (first, second))
    least = -DEPTH if touching else DEPTH
    met = np.maximum.reduce(here) - np.minimum.reduce(there) > least * width * length
    # Faces with the same centre cannot be separated along that line.
    met |= length <= DEPTH * width
    return np.stack([first, second], axis=1)[met], width[met]


def split(faces: Ints, other: Flags | None = None) -> tuple[Ints, Ints]:
    """Split faces into two triangles each (m, 2, 3), with the number of valid ones (m,): 1 or 2.

    Quads are split along corners 0-2, or 1-3 where `other` is set. The first triangle of a
    triangular face is the face itself.
    """
    ids = four_corners(faces)
    if other is not None:
        ids = np.where(other[:, None], np.roll(ids, -1, axis=1), ids)
    count = np.where(faces[:, 3] < 0, 1, 2) if faces.shape[1] == 4 else np.ones(len(faces), int)
    triangles = np.stack([ids[:, [0, 1, 2]], ids[:, [0, 2, 3]]], axis=1)
    # Triangular faces ignore `other`.
    single = count == 1
    triangles[single, 0] = faces[single, :3]
    return triangles, count


def every(triangles: Ints, count: Ints) -> Ints:
    """List the valid triangles (t, 3) of :func:`split`, the first ones of all faces first."""
    return np.concatenate([triangles[:, 0], triangles[count == 2, 1]])


def by_triangles(pairs: Ints, triangles: Ints, count: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Expand pairs of faces into pairs of their triangles.

    Returns
    -------
    which : ndarray of int, (t,)
        Index of the pair of faces of each pair of triangles.
    first, second : ndarray of int, (t, 3)
        Corners of the triangles.
    place : ndarray of int, (2, t)
        Which triangle of its face each is, 0 or 1.
    """
    which, first, second, place = [], [], [], []
    for i in range(2):
        for j in range(2):
            there = np.flatnonzero((count[pairs[:, 0]] > i) & (count[pairs[:, 1]] > j))
            which.append(there)
            first.append(triangles[pairs[there, 0], i])
            second.append(triangles[pairs[there, 1], j])
            place.append(np.repeat([[i], [j]], len(there), axis=1))
    each, one, two = (np.concatenate(x) for x in (which, first, second))
    return each, one, two, np.concatenate(place, axis=1)
