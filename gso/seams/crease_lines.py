"""Creases of a design that are long enough to be meant: lines that seams prefer."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.seams.kinds import Creases
from gso.typing import Ints

#: Angle between faces, in degrees, from which on an edge is a crease.
_ANGLE = 35.0
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
