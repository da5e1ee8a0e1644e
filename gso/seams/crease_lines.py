"""Creases of a design that are long enough to be meant: lines that seams prefer."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import dijkstra

from gso.geometry import area_vectors
from gso.mesh import Mesh
from gso.mesh.topology import edge_graph, edge_keys, label_components, pair_keys
from gso.seams.kinds import Creases
from gso.typing import Ints

#: Angle between faces, in degrees, from which on an edge is a crease, and from which on it may
#: bridge a gap: where a mesh does not follow a crease, two rows of edges share its angle.
_ANGLE, _WEAK = 35.0, 15.0
#: Area over the whole from which on what creases enclose is a feature.
_FEATURE = 0.01
#: Share of the length of all edges from which on creases are the facets of a coarse mesh, or noise.
_MOST = 0.15


def crease_lines(mesh: Mesh, shortest: float) -> Ints:
    """Return the edges (k, 2) of creases; none where they are noise or facets.

    Parameters
    ----------
    mesh : Mesh
    shortest : float
        Length that the edges of a connected crease have together at least.

    Examples
    --------
    >>> y, x = np.mgrid[:3.0, :5.0]
    >>> roof = Mesh.from_grid(np.dstack([x, y, -np.abs(x - 2.0)]))
    >>> crease_lines(Mesh(roof.vertices, roof.triangles), 1.0).tolist()
    [[2, 7], [7, 12]]
    """
    ends = np.sort(Creases(_ANGLE).edges(mesh), axis=1)
    length = np.linalg.norm(np.diff(mesh.vertices[ends], axis=1)[:, 0], axis=1)
    if length.sum() > _MOST * mesh.edge_lengths[~mesh.boundary_edges].sum():
        return np.empty((0, 2), np.int64)
    label = label_components(len(mesh.vertices), ends[:, 0], ends[:, 1])[ends[:, 0]]
    long = np.bincount(label, length)[label] >= shortest
    return np.asarray(ends[long][np.lexsort(ends[long].T[::-1])])


def feature_edges(mesh: Mesh, longest: float) -> tuple[Ints, int]:
    """Return the edges (k, 2) of creases that enclose features, and the number of these.

    A feature is a part of the surface, such as a nose, that creases divide from the others. Gaps in
    creases up to the `longest` length are closed.

    Examples
    --------
    >>> y, x = np.mgrid[:3.0, :5.0]
    >>> roof = Mesh.from_grid(np.dstack([x, y, -np.abs(x - 2.0)]))
    >>> edges, count = feature_edges(Mesh(roof.vertices, roof.triangles), 1.0)
    >>> edges.tolist(), count
    ([[2, 7], [7, 12]], 1)
    """
    creases = crease_lines(mesh, 0.0)
    creases = np.concatenate([creases, _bridges(mesh, creases, longest)])
    he, n = mesh.half_edges, len(mesh.vertices)
    k = he.interior
    one, two = he.face[k], he.face[he.twin[k]]
    crossed = np.isin(edge_keys(he.origin[k], he.dest[k], n), pair_keys(creases, n))
    part = label_components(len(mesh.faces), one[~crossed], two[~crossed])
    area = np.linalg.norm(area_vectors(mesh.vertices, mesh.triangles), axis=1)
    share = np.bincount(part, area) / area.sum()
    large = share >= _FEATURE
    between = crossed & (part[one] != part[two]) & large[part[one]] & large[part[two]]
    edges = np.sort(np.stack([he.origin[k[between]], he.dest[k[between]]], axis=1), axis=1)
    bodies = len(np.unique(mesh.components[mesh.used]))
    return edges[np.lexsort(edges.T[::-1])], int(large.sum()) - bodies


def _bridges(mesh: Mesh, creases: Ints, longest: float) -> Ints:
    """Return weaker edges (k, 2) that join the ends of two creases (c, 2) by the shortest way."""
    n = len(mesh.vertices)
    ends = np.flatnonzero(np.bincount(creases.ravel(), minlength=n) == 1)
    weak = np.sort(Creases(_WEAK).edges(mesh), axis=1)
    weak = weak[~np.isin(pair_keys(weak, n), pair_keys(creases, n))]
    if len(ends) < 2 or not len(weak):
        return np.empty((0, 2), np.int64)
    length = np.linalg.norm(np.diff(mesh.vertices[weak], axis=1)[:, 0], axis=1)
    graph = edge_graph(n, weak[:, 0], weak[:, 1], length)
    away, before = dijkstra(
        graph, directed=False, indices=ends, limit=longest, return_predecessors=True
    )
    between = away[:, ends]
    np.fill_diagonal(between, np.inf)
    other = between.argmin(axis=1)
    # Both are the nearest end of the other.
    row = np.flatnonzero(np.isfinite(between.min(axis=1)) & (other[other] == np.arange(len(ends))))
    at, found = ends[other[row]], []
    while len(row):
        last = before[row, at]
        found.append(np.stack([last, at], axis=1))
        goes_on = last != ends[row]
        row, at = row[goes_on], last[goes_on]
    steps = np.concatenate(found) if found else np.empty((0, 2), np.int64)
    return np.unique(np.sort(steps, axis=1), axis=0)
