"""Self-intersections of a surface."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.faults.edge_crossings import cross_along_edges
from gso.faults.face_pairs import DEPTH, by_triangles, candidates, every, split
from gso.faults.one_to_one import simple_boundary, upright
from gso.mesh import Mesh
from gso.typing import Array, Flags, Ints


def crossings(mesh: Mesh) -> Ints:
    """Find the pairs of faces that share no vertex and intersect each other.

    Quads are split into triangles along their first diagonal. Faces that touch, are coplanar,
    or penetrate each other by less than a thousandth of their width do not intersect. An
    intersection may run along edges of one part or of both.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    ndarray of int, (p, 2)
        Faces, the smaller number first; in increasing order, none twice.

    Notes
    -----
    Two triangles intersect when each has corners on both sides of the other's plane, and the
    intervals in which they meet the common line of the planes overlap (Moeller 1997).

    Examples
    --------
    >>> wall = np.array([[-1.0, 0.1, -1], [1, 0.1, -1], [0.3, 0.1, 1]])
    >>> floor = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> crossings(Mesh(np.r_[wall, floor], [[0, 1, 2], [3, 4, 5]]))
    array([[0, 1]])
    """
    points = mesh.vertices - mesh.frame.centre
    triangles, count = split(mesh.faces)
    if _is_graph(mesh, points, every(triangles, count)):
        return np.empty((0, 2), np.int64)
    pairs, width = candidates(points, mesh.faces, touching=True)
    which, first, second, place = by_triangles(pairs, triangles, count)
    crossed = np.zeros(len(pairs), bool)
    depth = DEPTH * width[which]
    crossed[which[_cross(points[first], points[second], depth)]] = True
    # Rows of all triangles: the first ones of the faces, then the second ones.
    row = np.stack([np.arange(len(count)), len(count) + np.cumsum(count == 2) - 1], axis=1)
    number = np.stack([row[pairs[which, k], place[k]] for k in range(2)], axis=1)
    for own in (number, number[:, ::-1]):
        along = cross_along_edges(points, every(triangles, count), own, depth)
        crossed[which[along]] = True
    found = pairs[crossed]
    return found[np.lexsort(found.T[::-1])]


def crossings_at_vertices(mesh: Mesh) -> Ints:
    """Find the pairs of triangles that share one vertex and pass through each other beside it.

    Parameters
    ----------
    mesh : Mesh
        Of triangles.

    Returns
    -------
    ndarray of int, (p, 2)
        Faces, the smaller number first; in increasing order, none twice.

    Examples
    --------
    >>> points = [[0, 0, 0], [2, -1, 0], [2, 1, 0], [2, 0, -1], [2, 0, 1], [3, 9, 0]]
    >>> fan = [[0, 1, 2], [0, 2, 5], [0, 5, 4], [0, 4, 3]]
    >>> crossings_at_vertices(Mesh(points, fan))
    array([[0, 3]])
    """
    faces, count = mesh.faces, len(mesh.vertices)
    order = np.argsort(faces.ravel(), kind="stable")
    degree = np.bincount(faces.ravel(), minlength=count)
    first = np.cumsum(degree) - degree
    found = [np.empty((0, 2), np.int64)]
    for number in np.unique(degree[degree > 2]).tolist():
        star = order[first[degree == number][:, None] + np.arange(number)] // 3
        one, two = np.triu_indices(number, 1)
        found.append(np.stack([star[:, one].ravel(), star[:, two].ravel()], axis=1))
    pairs = np.concatenate(found)
    a, b = (faces[pairs[:, side]] for side in (0, 1))
    pairs = pairs[(a[:, :, None] == b[:, None, :]).sum(axis=(1, 2)) == 1]
    corner = mesh.vertices[faces]
    width = np.ptp(corner, axis=1).max(axis=1)[pairs].min(axis=1)
    crossed = _cross(corner[pairs[:, 0]], corner[pairs[:, 1]], DEPTH * width)
    return np.unique(np.sort(pairs[crossed], axis=1), axis=0)


def _is_graph(mesh: Mesh, points: Array, triangles: Ints) -> bool:
    """Tell whether the surface certainly lies over a plane without covering a point twice."""
    axis = upright(geometry.area_vectors(points, triangles))
    if axis is None:
        return False
    # Two vectors that make a right-handed frame with the axis.
    plane = np.linalg.svd(axis[None])[2][1:]
    plane[1] *= np.sign(axis @ np.cross(*plane))
    return simple_boundary(mesh, points @ plane.T)


def _cross(a: Array, b: Array, depth: Array) -> Flags:
    """Mark the pairs of triangles (t, 3, 3) that penetrate by more than a depth (t,)."""
    out = np.zeros(len(a), bool)
    at = np.arange(len(a))
    for k in range(2):
        # The first plane separates most pairs; only the rest is tested against the second.
        base, other = (a, b) if k == 0 else (b, a)
        at = at[_both_sides(_heights(base[at], other[at])[1], depth[at])]
    a, b, depth = a[at], b[at], depth[at]
    normal_a, height_b = _heights(a, b)
    normal_b, height_a = _heights(b, a)
    line = np.cross(normal_a, normal_b)
    line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-300)
    low_a, high_a = _extent(a, height_a, line)
    low_b, high_b = _extent(b, height_b, line)
    out[at] = np.minimum(high_a, high_b) - np.maximum(low_a, low_b) > depth
    return out


def _heights(base: Array, other: Array) -> tuple[Array, Array]:
    """Return unit normals of triangles, and heights (t, 3) of others' corners above them."""
    normal = np.cross(base[:, 1] - base[:, 0], base[:, 2] - base[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return normal, np.einsum("tkd,td->tk", other - base[:, :1], normal)


def _both_sides(height: Array, depth: Array) -> Flags:
    return np.asarray((height.min(axis=1) < -depth) & (height.max(axis=1) > depth))


def _extent(triangle: Array, height: Array, line: Array) -> tuple[Array, Array]:
    """Return the interval along a line in which a triangle meets a plane that it crosses."""
    above = height > 0
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    row = np.arange(len(triangle))
    along = np.einsum("tkd,td->tk", triangle, line)
    ends = []
    for k in (1, 2):
        other = (lone + k) % 3
        share = height[row, lone] / (height[row, lone] - height[row, other])
        ends.append(along[row, lone] + share * (along[row, other] - along[row, lone]))
    return np.minimum(*ends), np.maximum(*ends)
