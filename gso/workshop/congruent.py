"""Designs that are copies of each other: moved and turned, but not mirrored."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.mesh import Mesh

#: Largest distance between copies, relative to the diagonal.
_SAME = 1e-6


def origins(meshes: Sequence[Mesh]) -> list[int]:
    """Return for each mesh the number of the first one that it is a copy of, or its own.

    Copies have the same faces in the same order.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]])
    >>> turned = points[:, [1, 0, 2]] * [1, -1, 1]
    >>> one, two = (Mesh(p, [[0, 1, 2]]) for p in (points, turned + 5.0))
    >>> origins([one, two, Mesh(2 * points, [[0, 1, 2]])])
    [0, 0, 2]
    """
    known: dict[bytes, list[int]] = {}
    out = []
    for k, mesh in enumerate(meshes):
        same = known.setdefault(mesh.faces.tobytes(), [])
        like = next((j for j in same if congruent(meshes[j], mesh)), None)
        if like is None:
            same.append(k)
        out.append(k if like is None else like)
    return out


def congruent(one: Mesh, two: Mesh) -> bool:
    """Tell whether a motion without mirroring maps one mesh to another, vertex by vertex.

    Source: Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    if one.vertices.shape != two.vertices.shape:
        return False
    a, b = (m.vertices - m.vertices.mean(axis=0) for m in (one, two))
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return bool(np.linalg.norm(a @ turn - b, axis=1).max() <= _SAME * one.diagonal)
