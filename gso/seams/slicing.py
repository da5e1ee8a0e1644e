"""Insertion of vertices where a plane crosses a triangle mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.typing import Array, Ints


def sliced(mesh: Mesh, height: Array) -> Mesh:
    """Divide the triangles that a plane crosses, so that it runs along edges.

    Labels of faces are kept; texture coordinates are not.

    Parameters
    ----------
    mesh : Mesh
        A triangle mesh.
    height : ndarray, (n,)
        Signed distances of its vertices from the plane; zero on it.
    """
    v, f = mesh.vertices, mesh.faces[:, :3]
    n = len(v)
    after = np.roll(f, -1, axis=1)
    crossed = height[f] * height[after] < 0
    if not crossed.any():
        return mesh
    key = edge_keys(f[crossed], after[crossed], n)
    known, first = np.unique(key, return_index=True)
    a, b = f[crossed][first], after[crossed][first]
    # The same point from both sides, to the last bit.
    a, b = np.minimum(a, b), np.maximum(a, b)
    share = (height[a] / (height[a] - height[b]))[:, None]
    points = np.concatenate([v, v[a] + share * (v[b] - v[a])])
    middle = np.full(f.shape, -1)
    middle[crossed] = n + np.searchsorted(known, key)
    count = crossed.sum(axis=1)
    new, parent = [f[count == 0]], [np.flatnonzero(count == 0)]
    # One side is crossed: the plane goes through the opposite corner.
    rows = np.flatnonzero(count == 1)
    if rows.size:
        i, j, k, m = _turned(f, middle, rows, crossed[rows].argmax(axis=1))
        new += [np.stack([i, m, k], axis=1), np.stack([m, j, k], axis=1)]
        parent += [rows, rows]
    # Two sides are crossed: a triangle at their common corner, and a quad, cut in two.
    rows = np.flatnonzero(count == 2)
    if rows.size:
        i, j, k, m = _turned(f, middle, rows, ((~crossed[rows]).argmax(axis=1) + 1) % 3)
        # Sides i j and j k are crossed.
        other = _turned(f, middle, rows, ((~crossed[rows]).argmax(axis=1) + 2) % 3)[3]
        new += [
            np.stack([m, j, other], axis=1),
            np.stack([i, m, other], axis=1),
            np.stack([i, other, k], axis=1),
        ]
        parent += [rows] * 3
    faces, owner = np.concatenate(new), np.concatenate(parent)
    order = np.argsort(owner, kind="stable")
    said = mesh.attributes
    if said is not None:
        said = replace(said, texture=None, texture_corners=None).taken(owner[order])
    return Mesh(points, faces[order], attributes=said)


def _turned(f: Ints, middle: Ints, rows: Ints, first: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Return the corners of triangles from a given one on, and the middle of the first side."""
    i, j, k = (f[rows, (first + d) % 3] for d in range(3))
    return i, j, k, middle[rows, first]
