"""Faces that are folded onto their neighbours, and edges that have collapsed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.mesh import Mesh
from gso.topology import are_quads, four_corners

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Cosine of the angle between neighbouring normals below which a face lies folded on the next.
SHARP = -0.9
#: Share of its length below which an edge has collapsed.
SHORT = 0.02
#: Share of a triangle's longest side, as its height, below which it has no direction.
_FLAT = 1e-6


def folded(mesh: Mesh, *, below: float = SHARP) -> Ints:
    """Faces that are folded onto a neighbour, or onto themselves, in both triangulations.

    The normals of two triangles at an edge are then almost opposite: a face is turned over, or
    the surface has a sharp crease. Quads count as the triangles along both diagonals. A quad
    is folded onto itself when the two triangles along a diagonal are; where the mesh is no
    grid, along both diagonals, since an arrow-shaped one is not.

    Parameters
    ----------
    mesh : Mesh
    below : float
        Cosine of the angle between normals from which on it is a fold.

    Returns
    -------
    ndarray of int, (f,)
        Faces on both sides of the folds, in increasing order.

    Examples
    --------
    A strip of three squares, the last of which lies on the one before:

    >>> x = np.array([0.0, 1.0, 2.0, 1.0])
    >>> strip = np.stack([np.stack([x, 0 * x + y, 0 * x], axis=1) for y in (0, 1)], axis=1)
    >>> faces = [[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5]]
    >>> folded(Mesh(strip.reshape(-1, 3), faces))
    array([1, 2])
    """
    he, points = mesh.half_edges, mesh.vertices - mesh.frame.centre
    quad = are_quads(mesh.faces)
    hinge, sound = _own_folds(points, mesh.faces, quad, below)
    broken = hinge.all(axis=1) if mesh.grid_index is None else hinge.any(axis=1)
    bad = [np.flatnonzero(broken & quad)]
    h = np.flatnonzero(he.twin > np.arange(he.twin.size))
    both = [_beside(points, mesh, side, sound) for side in (h, he.twin[h])]
    for n in both[0]:
        for m in both[1]:
            # The edge runs the other way on the other side, and normals agree all the same.
            fold = h[np.einsum("ed,ed->e", n, m) < below]
            bad += [he.face[fold], he.face[he.twin[fold]]]
    return np.unique(np.concatenate(bad))


def _own_folds(
    points: Array, faces: Ints, quad: NDArray[np.bool_], below: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which quads fold along each diagonal (m, 2), and which splits are sound (m, 2)."""
    ids = four_corners(faces)
    fold = np.zeros((len(faces), 2), bool)
    for k in range(2):
        a, b, c, d = (points[ids[:, (k + j) % 4]] for j in range(4))
        fold[:, k] = np.einsum("fd,fd->f", _normals(a, b, c), _normals(a, c, d)) < below
    fold &= quad[:, None]
    return fold, ~fold


def _beside(
    points: Array, mesh: Mesh, side: Ints, sound: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Unit normals of the two triangles that may lie along half-edges; zero where none does."""
    he = mesh.half_edges
    a, b = points[he.origin[side]], points[he.dest[side]]
    ahead, behind = he.dest[he.next[side]], he.origin[he.prev[side]]
    # Corner of the face that the half-edge starts from.
    first = np.searchsorted(he.face, he.face[side])
    local = (side - first) % 2
    good = sound[he.face[side]]
    row = np.arange(len(side))
    # The triangle with the next corner lies along the diagonal from this one.
    with_next = _normals(a, b, points[ahead]) * good[row, local][:, None]
    with_last = _normals(a, b, points[behind]) * good[row, 1 - local][:, None]
    return with_next, with_last


def _normals(a: Array, b: Array, c: Array) -> Array:
    """Unit normals of triangles, zero where they are almost lines."""
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    longest = np.max([((x - y) ** 2).sum(axis=1) for x, y in ((a, b), (b, c), (c, a))], axis=0)
    thick = length > _FLAT * longest
    return normal * np.divide(1.0, length, out=np.zeros_like(length), where=thick)[:, None]


def collapsed(before: Mesh, after: Array, *, share: float = SHORT) -> Ints:
    """Edges of a mesh that are a small share of what they were.

    Parameters
    ----------
    before : Mesh
        The design, or the surface of a pattern.
    after : ndarray, (n, 2) or (n, 3)
        Vertices of the result, or of the pattern.
    share : float
        Of an edge's length before, below which it has collapsed. At a fiftieth no face of
        common shape is left, and what is measured on it means nothing; sound results seldom
        fall below a third.

    Returns
    -------
    ndarray of int, (e, 2)
        Ends of those edges.

    Examples
    --------
    >>> mesh = Mesh(np.eye(3), [[0, 1, 2]])
    >>> collapsed(mesh, np.array([[1.0, 0, 0], [0.99, 0, 0], [0, 0, 1]]))
    array([[0, 1]])
    """
    a, b = before.edges.T
    was = np.linalg.norm(before.vertices[a] - before.vertices[b], axis=1)
    now = np.linalg.norm(after[a] - after[b], axis=1)
    return before.edges[now < share * was]
