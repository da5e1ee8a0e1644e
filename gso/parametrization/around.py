"""Harmonic images with positive weights: of disks, and of tubes on a cylinder that is unrolled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.geometry.polygon import perimeter
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.cut import cut, joining
from gso.typing import Array, Flags, Ints

#: Least weight of an edge in a triangle, which keeps images from being inverted.
_LEAST = 0.05
#: Largest share of inverted triangles.
_INVERTED = 0.005


class Around(NamedTuple):
    """An image on a cylinder.

    Attributes
    ----------
    mesh : Mesh
        The surface, of triangles, cut open.
    flat : ndarray, (p, 2)
        The image of its vertices; the first coordinate runs around.
    size : (float, float)
        Circumference and height of the cylinder.
    """

    mesh: Mesh
    flat: Array
    size: tuple[float, float]


def around(mesh: Mesh) -> Around | None:
    """Map a surface with two boundary loops and no handle to a cylinder, harmonically.

    The loops become its ends. Points of the ends move freely around it, so that the image
    is nearly conformal. None for other surfaces, and where too many triangles would be inverted.

    Parameters
    ----------
    mesh : Mesh
        One component.

    Examples
    --------
    >>> t = 2 * np.pi * np.arange(12) / 12
    >>> rings = np.stack([np.r_[np.cos(t), np.cos(t)], np.r_[np.sin(t), np.sin(t)]], axis=1)
    >>> k = np.arange(12); n = (k + 1) % 12
    >>> faces = np.stack([k, n, n + 12, k + 12], axis=1)
    >>> tube = Mesh(np.c_[rings, np.repeat([0.0, 2.0], 12)], faces)
    >>> [round(x, 2) for x in around(tube).size]
    [6.21, 2.0]
    """
    if len(mesh.boundary_loops) != 2 or mesh.euler_characteristic != 0:
        return None
    whole = Mesh(mesh.vertices, mesh.triangles)
    low, high = whole.boundary_loops
    opened = cut(whole, joining(whole, [low, high]))
    right = _right(opened.mesh, opened.vertex, low)
    if right is None:
        return None
    own, triangles = opened.vertex, opened.mesh.triangles
    a, b = (np.roll(triangles, -k, axis=1).ravel() for k in (1, 2))
    one, two, count = own[a], own[b], len(whole.vertices)
    wide = 0.5 * sum(perimeter(mesh.vertices[loop]) for loop in (low, high))
    area = 0.5 * float(geometry.doubled_areas(whole.vertices, whole.triangles).sum())
    size = (wide, area / wide)
    best, most = None, _INVERTED * len(triangles)
    for weight in (_weights(opened.mesh), np.ones(triangles.size)):
        step = weight * (right[a].astype(float) - right[b])
        pull = np.asarray(np.bincount(two, step, count) - np.bincount(one, step, count), float)
        # Each edge pulls at its ends by the turn around the cylinder that it takes.
        x = _harmonic(one, two, weight, low[:1], np.zeros(1), pull)
        ends, at = np.r_[low, high], np.repeat([0.0, 1.0], [len(low), len(high)])
        y = _harmonic(one, two, weight, ends, at, np.zeros(count))
        flat = np.stack([x[own] + right, y[own]], axis=1) * size
        inverted = int((geometry.signed_areas(flat, triangles) <= 0).sum())
        if inverted <= most:
            best, most = flat, inverted - 1
    return None if best is None else Around(opened.mesh, best, size)


def inside(mesh: Mesh, loop: Ints, at: Array) -> Array:
    """Return a harmonic image (n, 2) of a mesh of triangles, with given boundary.

    Where triangles would be inverted, small and negative weights are raised: with positive ones
    none is inverted if the boundary loop is mapped to a convex curve (Tutte 1963, Floater 1997).

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.5, 0.1]],
    ...               [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> inside(square, np.arange(4), np.array([[0.0, 0], [2, 0], [2, 2], [0, 2]]))[4].round(1)
    array([0.8, 1. ])
    """
    a, b = (np.roll(mesh.triangles, -k, axis=1).ravel() for k in (1, 2))
    none = np.zeros(len(mesh.vertices))
    for least in (-np.inf, _LEAST):
        weight = _weights(mesh, least)
        image = np.stack([_harmonic(a, b, weight, loop, x, none) for x in at.T], axis=1)
        if (geometry.signed_areas(image, mesh.triangles) > 0).all():
            break
    return image


def _weights(mesh: Mesh, least: float = _LEAST) -> Array:
    """Return the cotangents at the corners of triangles (3 t,), at least a number."""
    angles = geometry.corner_angles(mesh.vertices, mesh.triangles)
    cotangent = 0.5 / np.tan(np.clip(angles, 1e-6, np.pi - 1e-6))
    return np.maximum(cotangent, least).ravel()


def _right(mesh: Mesh, vertex: Ints, low: Ints) -> Flags | None:
    """Mask over vertices of a cut mesh: those on the right side of the cut, seen upright.

    None unless the cut is one line.
    """
    if len(mesh.boundary_loops) != 1:
        return None
    (loop,) = mesh.boundary_loops
    doubled = (np.bincount(vertex) > 1)[vertex[loop]]
    first = np.flatnonzero(~doubled & np.roll(doubled, 1) & np.isin(vertex[loop], low))
    if len(first) != 1:
        return None
    loop, doubled = np.roll(loop, -first[0]), np.roll(doubled, -first[0])
    # After the lower end the loop goes up along the right side.
    begin = int(doubled.argmax())
    size = int((~doubled[begin:]).argmax())
    out = np.zeros(len(vertex), bool)
    out[loop[begin : begin + size]] = True
    return out


def _harmonic(one: Ints, two: Ints, weight: Array, fixed: Ints, at: Array, pull: Array) -> Array:
    """Minimise the weighted squared differences over edges, with fixed vertices."""
    from scipy.sparse import coo_matrix

    count = len(pull)
    rows, columns = np.r_[one, two, one, two], np.r_[two, one, one, two]
    values = np.r_[-weight, -weight, weight, weight]
    matrix = coo_matrix((values, (rows, columns)), shape=(count, count)).tocsr()
    out = np.zeros(count)
    out[fixed] = at
    inner = np.setdiff1d(np.r_[one, two], fixed)
    right = pull[inner] - (matrix @ out)[inner]
    out[inner] = spd(matrix[inner][:, inner])(right)
    return out
