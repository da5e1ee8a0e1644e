"""Edges that are arcs of circles in the flat image, so that neighbouring faces agree in length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.mesh import topology
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Ints


def arc_angles(
    points: Array,
    triangles: Ints,
    face: Ints,
    surfaces: Sequence[RoundSurface | None],
    normals: Sequence[Array | None],
    tolerance: float,
) -> Array:
    """Return the angle of the arc that each edge on a circle is in the flat image.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
    face : ndarray of int, (t,)
        Face of each triangle.
    surfaces : sequence of RoundSurface or None
        Equation of each face.
    normals : sequence of (3,) or None
        Normal of each face that is a plane.
    tolerance : float
        Difference of heights along the axis up to which the ends of an edge are on a circle.

    Returns
    -------
    ndarray, (t, 3)
        Of the edge from corner k to corner k + 1, in radians, positive where the arc runs
        anticlockwise; 0 for straight edges.
    """
    he = topology.half_edges(triangles, len(points))
    angle = np.zeros(len(he.origin))
    edge = (he.twin < 0) | (face[he.face] != face[he.face[he.twin]])
    for k, surface in enumerate(surfaces):
        if surface is None:
            continue
        mine = np.flatnonzero(edge & (face[he.face] == k))
        p, q = points[he.origin[mine]], points[he.dest[mine]]
        (a, rho, h), (b, _, g) = surface.coordinates(p), surface.coordinates(q)
        turn = b - a
        turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
        level = (np.abs(h - g) <= 2 * tolerance) & (rho * np.abs(turn) > 4 * tolerance)
        mine, p, q, turn, h = mine[level], p[level], q[level], np.abs(turn[level]), h[level]
        if surface.apex is not None:
            inward = np.asarray(surface.apex - p)
            angle[mine] = np.sin(surface.half_angle) * turn * _side(points, he, mine, inward)
        other = he.twin[mine]
        for j in np.unique(face[he.face[other[other >= 0]]]):
            normal = normals[j]
            if normal is None or abs(float(normal @ surface.axis)) < 1 - 1e-6:
                continue
            there = (other >= 0) & (face[he.face[other]] == j)
            centre = surface.centre + h[there, None] * surface.axis
            angle[other[there]] = turn[there] * _side(
                points, he, other[there], centre - points[he.origin[other[there]]]
            )
    return angle.reshape(-1, 3)


def _side(points: Array, he: topology.HalfEdges, edges: Ints, toward: Array) -> Array:
    """1 where a direction points to the left of half-edges, in their triangles, otherwise -1."""
    p, q = points[he.origin[edges]], points[he.dest[edges]]
    r = points[he.dest[he.next[edges]]]
    normal = np.cross(q - p, r - p)
    return np.asarray(np.sign(np.einsum("ed,ed->e", np.cross(q - p, toward), normal)))
