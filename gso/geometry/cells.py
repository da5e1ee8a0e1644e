"""Quantities of one face: quads with corners v0 v1 v2 v3 in cyclic order, and triangles."""

from __future__ import annotations

from gso.geometry.vector import cross, dot, norm, norm2, sub
from gso.typing import S, Vec


def diagonals(v0: Vec[S], v1: Vec[S], v2: Vec[S], v3: Vec[S]) -> tuple[Vec[S], Vec[S]]:
    """Return the diagonals ``a = v0 - v2`` and ``b = v1 - v3`` (Jiang et al. 2020)."""
    return sub(v0, v2), sub(v1, v3)


def diagonal_distance(v0: Vec[S], v1: Vec[S], v2: Vec[S], v3: Vec[S]) -> S:
    """Return the signed distance between the lines of a quad's diagonals; zero if it is planar.

    >>> corners = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.0, 1.0, 0.0)
    >>> float(diagonal_distance(*corners))
    -1.0
    """
    a, b = diagonals(v0, v1, v2, v3)
    normal = cross(a, b)
    return dot(normal, sub(v1, v0)) / norm(normal)


def face_products(*corners: Vec[S]) -> tuple[S, S, S]:
    """Return the invariants of a face under isometries (Jiang et al. 2020).

    For a quad the squared diagonals and their inner product, which determine the parallelogram
    of edge midpoints. For a triangle the squared sides 01, 12, 20.
    """
    if len(corners) == 4:
        a, b = diagonals(*corners)
        return norm2(a), norm2(b), dot(a, b)
    p, q, r = corners
    return norm2(sub(q, p)), norm2(sub(r, q)), norm2(sub(p, r))


def isometry_defect(a: Vec[S], b: Vec[S], a2: Vec[S], b2: Vec[S]) -> tuple[S, S, S]:
    """Return the isometry defect of two quad cells with diagonals (a, b) and (a2, b2).

    The differences of the diagonals' *lengths* and of their dot product, as in the
    metric ``loss_iso-cell`` of Wang et al. 2024. When all are zero, the parallelograms of
    edge midpoints are congruent.
    """
    return norm(a) - norm(a2), norm(b) - norm(b2), dot(a, b) - dot(a2, b2)


def corner_area2(p: Vec[S], q: Vec[S], r: Vec[S]) -> S:
    """Return the doubled signed area of the plane triangle p q r; positive when anticlockwise."""
    a, b = sub(q, p), sub(r, p)
    return a[0] * b[1] - a[1] * b[0]
