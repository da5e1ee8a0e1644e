"""Creases of a design that are long enough to be meant: lines that seams prefer."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.seams.cutting import cut
from gso.seams.kinds import Creases, Edges, edges_between
from gso.typing import Ints

#: Angle between faces, in degrees, from which on an edge is a crease, and from which on it may be
#: a part of one: where a mesh does not follow a crease, two rows of edges share its angle.
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


def feature_edges(mesh: Mesh) -> tuple[Ints, int]:
    """Return the edges (k, 2) of creases that enclose features, and the number of these.

    A feature is a part of the surface, such as a nose, that creases divide from the others. The
    mesh need not follow them: a watershed by the angles between faces closes what they leave open.

    Examples
    --------
    >>> y, x = np.mgrid[:3.0, :5.0]
    >>> roof = Mesh.from_grid(np.dstack([x, y, -np.abs(x - 2.0)]))
    >>> edges, count = feature_edges(Mesh(roof.vertices, roof.triangles))
    >>> edges.tolist(), count
    ([[2, 7], [7, 12]], 1)
    """
    he, angle = mesh.half_edges, metrics.dihedral_angles(mesh)
    k = he.interior
    one, two, weak = he.face[k], he.face[he.twin[k]], angle > _WEAK
    line = label_components(len(mesh.vertices), he.origin[k[weak]], he.dest[k[weak]])
    # Weak ones that go on a strong one.
    crossed = weak & np.isin(line[he.origin[k]], line[crease_lines(mesh, 0.0)])
    part = label_components(len(mesh.faces), one[~crossed], two[~crossed])
    area = metrics.face_areas(mesh)
    large = np.bincount(part, area) >= _FEATURE * area.sum()
    part = np.where(large[part], part, -1)
    f, g, turn = np.r_[one, two], np.r_[two, one], np.r_[angle, angle]
    while True:
        front = np.flatnonzero((part[f] >= 0) & (part[g] < 0))
        if not len(front):
            break
        front = front[np.lexsort([turn[front], g[front]])]
        first = np.r_[True, np.diff(g[front]) > 0]
        part[g[front[first]]] = part[f[front[first]]]
    edges = np.sort(edges_between(mesh, part), axis=1)
    bodies = len(np.unique(mesh.components[mesh.used]))
    return edges[np.lexsort(edges.T[::-1])], max(int(large.sum()) - bodies, 0)


def faces_between(mesh: Mesh, kept: Ints | None = None, most: float = np.inf) -> Pieces | None:
    """Cut a mesh along the creases that enclose features, and along kept edges (k, 2).

    None if there are no such creases, or more features than `most`, or if a piece is no disk.
    """
    edges, count = feature_edges(mesh)
    if not 0 < count <= most:
        return None
    pieces = cut(mesh, Edges(edges if kept is None else np.concatenate([kept, edges])))
    return pieces if all(piece.is_disk for piece in pieces) else None
