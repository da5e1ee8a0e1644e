"""The mirror plane of a design, as a permutation of its vertices."""

from __future__ import annotations

import numpy as np

from gso.errors import OptionError
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.typing import Array, Ints

#: How far a mirrored vertex may be from its partner, relative to the mean edge length.
_TOLERANCE = 0.25


def mirror_of(mesh: Mesh) -> Ints:
    """Find the mirror image of each vertex (n,).

    The plane goes through the centroid, along two principal axes or two coordinate axes.

    Raises
    ------
    OptionError
        No such plane maps vertices to vertices and edges to edges.
    """
    used = np.flatnonzero(mesh.used)
    points = mesh.vertices[used] - mesh.vertices[used].mean(axis=0)
    _, axes = np.linalg.eigh(points.T @ points)
    a, b = mesh.edges.T
    length = float(np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1).mean())
    worst = np.inf
    for normal in (*axes.T, *np.eye(3)):
        partner, far = _partners(points, normal)
        worst = min(worst, far / length)
        if far > _TOLERANCE * length or (partner[partner] != np.arange(len(used))).any():
            continue
        out = np.arange(len(mesh.vertices))
        out[used] = used[partner]
        n = len(out)
        if np.isin(edge_keys(out[a], out[b], n), edge_keys(a, b, n)).all():
            return out
    raise OptionError(
        "symmetric: no plane through the centroid maps the vertices and edges of the mesh to "
        f"themselves (the best misses a vertex by {worst:.2g} mean edge lengths); take a mesh "
        "that is symmetric vertex by vertex, or leave symmetric out"
    )


def _partners(points: Array, normal: Array) -> tuple[Ints, float]:
    from scipy.spatial import cKDTree

    mirrored = points - 2.0 * np.outer(points @ normal, normal)
    away, partner = cKDTree(points).query(mirrored)
    return partner.astype(np.int64), float(away.max())
