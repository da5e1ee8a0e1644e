"""Overlaps of a flat pattern with itself."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.faults.face_pairs import DEPTH, by_triangles, candidates, every, split
from gso.faults.one_to_one import simple_boundary
from gso.mesh import Mesh
from gso.mesh.topology import are_quads
from gso.typing import Array, Flags, Ints

#: Sum of the angles around a vertex above which its faces overlap: 2 pi and a tolerance.
_TURN = 2.0 * np.pi + 1e-2


def overlaps(mesh: Mesh, flat: Array) -> Ints:
    """Find the faces that overlap others in a flat image, also those of other components.

    Faces without a common vertex overlap if they penetrate each other by more than a thousandth
    of their width. The faces around a vertex overlap if their angles sum to more than a full
    turn. Inverted faces are not detected as such: see :func:`gso.metrics.flipped_faces`.

    Parameters
    ----------
    mesh : Mesh
        The surface; only its connectivity is used.
    flat : ndarray, (n, 2)
        Its flat image.

    Returns
    -------
    ndarray of int, (f,)
        Overlapping faces, in increasing order.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> tiles = Mesh(np.r_[square, square + 2.0], [[0, 1, 2, 3], [4, 5, 6, 7]])
    >>> overlaps(tiles, np.r_[square, square + 0.5][:, :2])
    array([0, 1])
    >>> overlaps(tiles, np.r_[square, square + [1, 0, 0]][:, :2])
    array([], dtype=int64)
    """
    points = flat - flat[mesh.used].mean(axis=0)
    triangles, count = _split(points, mesh.faces)
    if _covers_once(mesh, points, every(triangles, count)):
        return np.empty(0, np.int64)
    wound = _wound(points, mesh.faces, triangles, count)
    pairs = _overlapping(mesh, points, triangles, count)
    return np.unique(np.r_[pairs.ravel(), wound])


def overlapping(mesh: Mesh, flat: Array) -> Ints:
    """Find the pairs of faces (p, 2) without a common vertex that overlap, as :func:`overlaps`."""
    points = flat - flat[mesh.used].mean(axis=0)
    triangles, count = _split(points, mesh.faces)
    if _covers_once(mesh, points, every(triangles, count)):
        return np.empty((0, 2), np.int64)
    return _overlapping(mesh, points, triangles, count)


def _covers_once(mesh: Mesh, points: Array, triangles: Ints) -> bool:
    """Tell whether triangles (t, 3) certainly cover no point of the plane twice."""
    sound = bool((geometry.signed_areas(points, triangles) > 0).all())
    return sound and simple_boundary(mesh, points)


def _overlapping(mesh: Mesh, points: Array, triangles: Ints, count: Ints) -> Ints:
    """Find the pairs of faces by testing all that are close, split into given triangles."""
    pairs, width = candidates(points, mesh.faces)
    which, first, second, _ = by_triangles(pairs, triangles, count)
    met = _meet(points[first], points[second], DEPTH * width[which])
    return np.unique(pairs[which[met]], axis=0)


def _split(points: Array, faces: Ints) -> tuple[Ints, Ints]:
    """Split faces as :func:`split`; along the other diagonal where the first one inverts any."""
    triangles, count = split(faces)
    areas = geometry.signed_areas(points, triangles.reshape(-1, 3)).reshape(-1, 2)
    other = are_quads(faces) & (areas.min(axis=1) <= 0)
    return split(faces, other) if other.any() else (triangles, count)


def _meet(a: Array, b: Array, depth: Array) -> Flags:
    """Mark the pairs of triangles (t, 3, 2) that overlap by more than a depth (t,).

    By the separating-axis test: if a line separates two triangles, one of their sides does.
    """
    met = np.ones(len(a), bool)
    for base in (a, b):
        for k in range(3):
            side = base[:, (k + 1) % 3] - base[:, k]
            normal = np.stack([-side[:, 1], side[:, 0]], axis=1)
            length = np.linalg.norm(side, axis=1)
            here, there = (np.einsum("tkd,td->tk", x, normal) for x in (a, b))
            reach = np.minimum(
                here.max(axis=1) - there.min(axis=1), there.max(axis=1) - here.min(axis=1)
            )
            met &= reach > depth * length
    return met


def _wound(points: Array, faces: Ints, triangles: Ints, count: Ints) -> Ints:
    """Find the faces at vertices whose face angles sum to more than a full turn."""
    each = every(triangles, count)
    face = np.r_[np.arange(len(faces)), np.flatnonzero(count == 2)]
    angles = geometry.corner_angles(points, each)
    turn = np.bincount(each.ravel(), angles.ravel(), minlength=len(points))
    return np.asarray(face[(turn[each] > _TURN).any(axis=1)])
