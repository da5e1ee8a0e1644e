"""Faces that are folded onto their neighbours, and edges that have collapsed."""

from __future__ import annotations

import numpy as np

from gso.geometry import corners, cross, dot, norm, norm2, sub
from gso.mesh import Mesh
from gso.mesh.topology import are_quads, four_corners
from gso.typing import Array, Flags, Ints

#: Cosine of the angle between neighbouring normals below which a face is folded onto the next:
#: the angle is more than 120 degrees. Valid results almost always stay above 0.
SHARP = -0.5
#: Ratio of lengths, result over design, below which an edge has collapsed.
SHORT = 0.02
#: Size of a pleat in degrees beyond which strips are pleated; see :func:`gso.ruled.pleats`.
PLEATED = 20.0
#: Ratio of a corner triangle's height to its longer side below which it has no normal.
_FLAT = 1e-6


def folded(mesh: Mesh, *, below: float = SHARP) -> Ints:
    """Find the faces that are folded onto a neighbour or onto themselves.

    At a fold the normals of two triangles at an edge differ by more than 120 degrees: a face is
    inverted, or the surface has a sharp crease. Quads are tested with the triangles of both
    diagonals. A quad of a grid is folded onto itself if the two triangles along either
    diagonal are. In other meshes quads may be concave, so both diagonals must fold.

    Parameters
    ----------
    mesh : Mesh
    below : float
        Cosine of the angle between normals below which an edge is a fold.

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
    he, points = mesh.half_edges, tuple((mesh.vertices - mesh.frame.centre).T.copy())
    quad = are_quads(mesh.faces)
    normals, fold = _corner_normals(points, mesh.faces, quad, below)
    broken = fold.all(axis=0) if mesh.grid_index is None else fold.any(axis=0)
    bad = [np.flatnonzero(broken & quad)]
    # Triangles of a diagonal along which the quad folds are not tested against neighbours.
    sound = ~fold
    h = he.interior
    h = h[_sharp(normals, he.face[h], he.face[he.twin[h]], below)]
    sides = (h, he.twin[h])
    local = [s - np.searchsorted(he.face, he.face[s]) for s in sides]
    size = np.where(quad, 4, 3)
    for k in range(2):
        for j in range(2):
            # On each side, the corner triangle at one of the two ends of the edge.
            here, there = (
                (he.face[s], (own + turn) % size[he.face[s]])
                for s, own, turn in zip(sides, local, (k, j), strict=True)
            )
            cosine = dot(*(tuple(n[c, f] for n in normals) for f, c in (here, there)))
            both = sound[(here[1] + 1) % 2, here[0]] & sound[(there[1] + 1) % 2, there[0]]
            found = h[(cosine < below) & both]
            bad += [he.face[found], he.face[he.twin[found]]]
    return np.unique(np.concatenate(bad))


def _sharp(normals: tuple[Array, ...], left: Ints, right: Ints, below: float) -> Flags:
    """Mark the edges between two faces (e,) of which some corner triangles may make a fold.

    The angle between two of them is at most that between the faces' mean normals and, on each
    side, the largest angle between mean and corners.
    """
    mean = [x.sum(axis=0) for x in normals]
    scale = np.maximum(norm(tuple(mean)), 1e-300)
    mean = [x / scale for x in mean]
    cosine = dot(tuple(mean), normals)
    # A degenerate triangle makes no fold.
    cosine[norm2(normals) == 0.0] = 1.0
    spread = np.arccos(np.clip(cosine.min(axis=0), -1.0, 1.0))
    between = dot(tuple(x[left] for x in mean), tuple(x[right] for x in mean))
    most = np.arccos(np.clip(between, -1.0, 1.0)) + spread[left] + spread[right]
    return np.asarray(~(most < np.arccos(below) - 1e-6))


def _corner_normals(
    points: tuple[Array, ...], faces: Ints, quad: Flags, below: float
) -> tuple[tuple[Array, ...], Flags]:
    """Return corner triangles' unit normals (4, m), and quads that fold along a diagonal (2, m).

    Corner triangle k is cut off by the diagonal between corners k - 1 and k + 1. For a
    triangular face all four have its normal.
    """
    ids = four_corners(faces).T
    corners = [tuple(x[i] for x in points) for i in ids]
    sides = [sub(corners[(k + 1) % 4], corners[k]) for k in range(4)]
    out = []
    for k in range(4):
        normal = cross(sides[k], sides[k - 1])
        area, longest = norm(normal), np.maximum(norm2(sides[k]), norm2(sides[k - 1]))
        # A degenerate triangle has no normal.
        scale = np.divide(-1.0, area, out=np.zeros_like(area), where=area > _FLAT * longest)
        out.append([x * scale for x in normal])
    normals = [np.stack(x) for x in zip(*out, strict=True)]
    for x in normals:
        x[:, ~quad] = x[1, ~quad]
    # The diagonal of corners 0-2 cuts off 1 and 3.
    pairs = ((1, 3), (0, 2))
    fold = [dot(*(tuple(x[k] for x in normals) for k in pair)) < below for pair in pairs]
    return tuple(normals), np.stack(fold) & quad


def collapsed(before: Mesh, after: Array, *, share: float = SHORT) -> Ints:
    """Find the edges of a mesh that have shrunk to a small fraction of their length.

    Parameters
    ----------
    before : Mesh
        The design, or the surface of a pattern.
    after : ndarray, (n, 2) or (n, 3)
        Vertices of the result, or of the pattern.
    share : float
        Ratio of lengths, after over before, below which an edge has collapsed. At 1/50 the
        faces are so distorted that metrics on them are meaningless; valid results seldom fall
        below 1/3.

    Returns
    -------
    ndarray of int, (e, 2)
        Vertices of the collapsed edges, the smaller number first.

    Examples
    --------
    >>> mesh = Mesh(np.eye(3), [[0, 1, 2]])
    >>> collapsed(mesh, np.array([[1.0, 0, 0], [0.99, 0, 0], [0, 0, 1]]))
    array([[0, 1]])
    """
    was, now = (norm(sub(*corners(x, before.edges))) for x in (before.vertices, after))
    return np.sort(before.edges[now < share * was], axis=1)
