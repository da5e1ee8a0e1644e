"""Gaussian curvature by the Gauss image: the area that normals sweep on the unit sphere."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from gso.geometry import ops
from gso.geometry.vector import cross, dot, norm, sub
from gso.typing import S, Vec

#: Share of the quads around a vertex that the six triangles of a grid's star have.
STAR = 0.75


def solid_angle(a: Vec[S], b: Vec[S], c: Vec[S]) -> S:
    """Return the signed area of a spherical triangle with unit vectors as corners.

    Van Oosterom and Strackee, The solid angle of a plane triangle (1983), Eq. 8.

    >>> round(float(solid_angle((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))), 6)
    1.570796
    """
    return 2.0 * ops.atan2(dot(a, cross(b, c)), 1.0 + dot(a, b) + dot(b, c) + dot(c, a))


def image_curvature(centre: Vec[S], corners: Sequence[Vec[S]]) -> S:
    """Return the Gaussian curvature of a vertex among quads by their normals, 1 / length^2.

    It is the signed area of the spherical polygon of the normals, over three quarters of the area
    of the quads, which is the area of the star that :func:`gaussian_curvature` divides by. The
    normal of a quad is that of its diagonals, so bending a quad along one of them does not
    change its curvature, as it does that of a triangulation.

    Parameters
    ----------
    centre : tuple of 3 numbers
        The vertex.
    corners : sequence of tuples of 3 numbers
        Of each quad around it, anticlockwise, the next corner and the opposite one. A triangle's
        opposite corner is its last one.

    Examples
    --------
    The apex of a pyramid on a square has four thirds of the curvature of a star of triangles.

    >>> ring = [(1., 1., 0.), (-1., 1., 0.), (-1., -1., 0.), (1., -1., 0.)]
    >>> both = [p for k in range(4) for p in (ring[k], ring[(k + 1) % 4])]
    >>> round(float(image_curvature((0., 0., 1.), both)), 6)
    0.320401
    """
    normals: list[Vec[S]] = []
    areas: list[S] = []
    for k in range(0, len(corners), 2):
        following = corners[(k + 2) % len(corners)]
        normal = cross(sub(corners[k + 1], centre), sub(following, corners[k]))
        size = norm(normal)
        normals.append(tuple(x / size for x in normal))
        areas.append(size)
    angles = [solid_angle(normals[0], a, b) for a, b in itertools.pairwise(normals[1:])]
    return _sum(angles) / (0.5 * STAR * _sum(areas))


def _sum(values: Sequence[S]) -> S:
    total, *others = values
    for value in others:
        total = total + value
    return total
