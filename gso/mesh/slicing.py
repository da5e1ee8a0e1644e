"""Insertion of vertices on the edges of a triangle mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import edge_keys, pair_keys
from gso.typing import Array, Ints


def sliced(mesh: Mesh, height: Array) -> tuple[Mesh, Ints]:
    """Divide the triangles that a plane crosses, so that it runs along edges.

    Parameters
    ----------
    mesh : Mesh
        A triangle mesh.
    height : ndarray, (n,)
        Signed distances of its vertices from the plane; zero on it.

    Returns
    -------
    mesh, edges
        As for :func:`divided`.
    """
    ends = mesh.edges
    a, b = height[ends].T
    crossed = a * b < 0
    return divided(mesh, ends[crossed], (a / np.where(crossed, a - b, 1.0))[crossed])


def divided(mesh: Mesh, edges: Ints, shares: Array) -> tuple[Mesh, Ints]:
    """Insert a vertex on each of some edges of a triangle mesh.

    Two new vertices of a triangle are joined by an edge. Labels of faces are kept; texture
    coordinates are not.

    Parameters
    ----------
    mesh : Mesh
    edges : ndarray of int, (k, 2)
        Edges, each once.
    shares : ndarray, (k,)
        Place of the new vertex between both ends, 0 to 1.

    Returns
    -------
    mesh : Mesh
        The new vertices come after the others, in the order of `edges`.
    edges : ndarray of int, (k, 2)
        The edges.

    Examples
    --------
    >>> triangle = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> finer, _ = divided(triangle, np.array([[0, 1], [0, 2]]), np.array([0.5, 0.5]))
    >>> finer.faces.tolist()
    [[4, 0, 3], [2, 4, 3], [2, 3, 1]]
    """
    return parts_of(mesh, edges, shares)[0], edges


def parts_of(mesh: Mesh, edges: Ints, shares: Array) -> tuple[Mesh, Ints]:
    """Insert vertices as :func:`divided` does; return the face that each one is a part of, too."""
    if not len(edges):
        return mesh, np.arange(len(mesh.faces))
    v = mesh.vertices
    faces, owner = subdivided(mesh.faces[:, :3], len(v), edges)
    said = mesh.attributes
    if said is not None:
        said = replace(said, texture=None, texture_corners=None).taken(owner)
    return Mesh(with_points(v, edges, shares), faces, attributes=said), owner


def with_points(points: Array, edges: Ints, shares: Array) -> Array:
    """Return points (n + k, 3) with one on each of some edges (k, 2) between them."""
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    return np.concatenate([points, a + shares[:, None] * (b - a)])


def subdivided(f: Ints, n: int, edges: Ints) -> tuple[Ints, Ints]:
    """Divide triangles (t, 3) of n vertices by a new vertex on each of some edges (k, 2).

    Returns
    -------
    faces : ndarray of int, (u, 3)
        Vertex n + i is that of edge i. The parts of a triangle are in its place.
    owner : ndarray of int, (u,)
        The triangle that each is a part of.
    """
    key = pair_keys(edges, n)
    order = np.argsort(key)
    sides = edge_keys(f, np.roll(f, -1, axis=1), n)
    place = np.minimum(np.searchsorted(key[order], sides), len(key) - 1)
    crossed = key[order][place] == sides
    middle = np.where(crossed, n + order[place], -1)
    count = crossed.sum(axis=1)
    new, parent = [f[count == 0]], [np.flatnonzero(count == 0)]
    rows = np.flatnonzero(count == 1)
    if rows.size:
        i, j, k, m = _turned(f, middle, rows, crossed[rows].argmax(axis=1))
        new += [np.stack([i, m, k], axis=1), np.stack([m, j, k], axis=1)]
        parent += [rows, rows]
    rows = np.flatnonzero(count == 2)
    if rows.size:
        # Sides i j and j k are divided: a triangle at j, and a quad, cut in two.
        first = ((~crossed[rows]).argmax(axis=1) + 1) % 3
        i, j, k, m = _turned(f, middle, rows, first)
        other = _turned(f, middle, rows, (first + 1) % 3)[3]
        new += [
            np.stack([m, j, other], axis=1),
            np.stack([i, m, other], axis=1),
            np.stack([i, other, k], axis=1),
        ]
        parent += [rows] * 3
    rows = np.flatnonzero(count == 3)
    if rows.size:
        i, j, k, m = _turned(f, middle, rows, np.zeros(len(rows), np.int64))
        p, q = middle[rows, 1], middle[rows, 2]
        new += [np.stack(corner, axis=1) for corner in ((i, m, q), (m, j, p), (q, p, k), (m, p, q))]
        parent += [rows] * 4
    faces, owner = np.concatenate(new), np.concatenate(parent)
    rank = np.argsort(owner, kind="stable")
    return faces[rank], owner[rank]


def followed(seam: Ints, inserted: Ints, count: int) -> Ints:
    """Replace the edges (e, 2) of a seam that were divided by their parts.

    Parameters
    ----------
    seam : ndarray of int, (e, 2)
    inserted : ndarray of int, (k, 2)
        The ends of the edge on which each new vertex lies, in the order of insertion.
    count : int
        Number of vertices before.
    """
    kept = {(min(a, b), max(a, b)) for a, b in seam.tolist()}
    for new, (a, b) in enumerate(inserted.tolist(), start=count):
        edge = (min(a, b), max(a, b))
        if edge in kept:
            kept.remove(edge)
            kept.update({(edge[0], new), (edge[1], new)})
    return np.array(sorted(kept), np.int64).reshape(-1, 2)


def _turned(f: Ints, middle: Ints, rows: Ints, first: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Return the corners of triangles from a given one on, and the middle of the first side."""
    i, j, k = (f[rows, (first + d) % 3] for d in range(3))
    return i, j, k, middle[rows, first]
