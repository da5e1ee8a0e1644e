"""The pattern of trimmed strips: their faces in the plane, cut along creases."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.parametrization import beside, upright
from gso.pattern import Pattern
from gso.ruled.unroll import Unrolled
from gso.typing import Ints


def unrolled_pattern(mesh: Mesh, owner: Ints, part: Ints, unrolled: Unrolled) -> Pattern:
    """Return the pattern of a mesh whose faces have `owner` in the untrimmed strips."""
    faces = mesh.faces
    face, corner = np.nonzero(faces >= 0)
    ids = faces[face, corner]
    first, which = _copies(mesh, part)
    table = np.full_like(faces, -1)
    table[face, corner] = which
    flat = unrolled.flat(owner[face[first]], mesh.vertices[ids[first]])
    label = part[face[first]]
    pieces = [upright(flat[label == k])[:, ::-1] * [1.0, -1.0] for k in range(int(part.max()) + 1)]
    for k, piece in enumerate(beside(pieces)):
        flat[label == k] = piece
    return Pattern(flat, table, ids[first], _seams(mesh, table))


def _copies(mesh: Mesh, part: Ints) -> tuple[Ints, Ints]:
    """Number copies of the vertices: corners have the same one if inner edges join their faces.

    Returns
    -------
    first, which : ndarray of int, (n,), (c,)
        A corner of each copy, and the copy of each corner; corners are in the order of the faces.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces = mesh.faces
    number = np.full(faces.shape, -1)
    number[faces >= 0] = np.arange(int((faces >= 0).sum()))

    def corners(face: Ints, vertex: Ints) -> Ints:
        at = (faces[face] == vertex[:, None]).argmax(axis=1)
        return np.asarray(number[face, at])

    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    one, two = he.face[k], he.face[he.twin[k]]
    same = part[one] == part[two]
    k, one, two = k[same], one[same], two[same]
    ends = [(corners(one, v), corners(two, v)) for v in (he.origin[k], he.dest[k])]
    i, j = (np.concatenate(x) for x in zip(*ends, strict=True))
    size = int(number.max()) + 1
    graph = coo_matrix((np.ones(len(i)), (i, j)), shape=(size, size))
    _, which = connected_components(graph, directed=False)
    _, first = np.unique(which, return_index=True)
    # In the order of the parts, and of the vertices in each.
    face, corner = np.nonzero(faces >= 0)
    order = np.lexsort((faces[face, corner][first], part[face][first]))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[which]


def _seams(mesh: Mesh, table: Ints) -> Ints:
    """Return the pairs of pattern edges that are one edge of the surface."""
    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    ends = []
    for half in (k, he.twin[k]):
        rows, own = mesh.faces[he.face[half]], table[he.face[half]]
        ends.append(
            [
                np.take_along_axis(own, (rows == v[:, None]).argmax(axis=1)[:, None], 1)[:, 0]
                for v in (he.origin[k], he.dest[k])
            ]
        )
    pairs = np.stack([np.stack(e, axis=1) for e in ends], axis=1)
    return pairs[(pairs[:, 0] != pairs[:, 1]).any(axis=1)]
