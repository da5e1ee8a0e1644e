"""The mirror plane of a design, as a permutation of its vertices."""

from __future__ import annotations

import numpy as np

from gso.errors import OptionError
from gso.geometry.plane import Plane
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.typing import Array, Ints

#: How far a mirrored vertex may be from its partner, relative to the mean edge length.
_TOLERANCE = 0.25


_DIAGONALS = ((1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))
_PAIRS = tuple((i, j, s) for i, j in ((0, 1), (0, 2), (1, 2)) for s in (1.0, -1.0))


def directions(axes: Array) -> list[Array]:
    """Return normals of planes to try: principal axes (columns), coordinate axes, diagonals."""
    # Diagonal planes matter where two principal axes are equal, as on a square.
    diagonals = [np.array(d) / np.sqrt(2.0) for d in _DIAGONALS]
    principal = [(axes.T[i] + s * axes.T[j]) / np.sqrt(2.0) for i, j, s in _PAIRS]
    return [*axes.T, *np.eye(3), *diagonals, *principal]


def mirror_of(mesh: Mesh) -> Ints:
    """Find the mirror image of each vertex (n,).

    The plane goes through the centroid; its normal is a principal axis, a coordinate axis, or a
    diagonal of two of them.

    Raises
    ------
    OptionError
        No such plane maps vertices to vertices and edges to edges.
    """
    used = np.flatnonzero(mesh.used)
    points = mesh.vertices[used] - mesh.vertices[used].mean(axis=0)
    _, axes = np.linalg.eigh(points.T @ points)
    (a, b), length = mesh.edges.T, float(mesh.edge_lengths.mean())
    worst, crossed = np.inf, False
    for normal in directions(axes):
        partner, far = _partners(points, normal)
        worst = min(worst, far / length)
        if far > _TOLERANCE * length or (partner[partner] != np.arange(len(used))).any():
            continue
        out = np.arange(len(mesh.vertices))
        out[used] = used[partner]
        n = len(out)
        if np.isin(edge_keys(out[a], out[b], n), edge_keys(a, b, n)).all():
            return out
        crossed = True
    why = (
        "one maps the vertices to themselves, but not the edges: triangulate both sides alike"
        if crossed
        else f"the best misses a vertex by {worst:.2g} mean edge lengths"
    )
    raise OptionError(
        "symmetric: no plane of symmetry was found among those through the centroid along "
        f"principal axes, coordinate axes and their diagonals ({why}); take a mesh that is "
        "symmetric vertex by vertex, or leave symmetric out"
    )


def _partners(points: Array, normal: Array) -> tuple[Ints, float]:
    from scipy.spatial import cKDTree

    away, partner = cKDTree(points).query(Plane(normal, 0.0).image(points))
    return partner.astype(np.int64), float(away.max())
