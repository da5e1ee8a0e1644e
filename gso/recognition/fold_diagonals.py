"""Quads that are folded along a diagonal, such as those of a grid under the hip of a roof."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, topology
from gso.typing import Array, Flags, Ints

#: Ratio of the angles to the neighbours with both diagonals up to which a quad is folded along one;
#: least angle of a fold, in radians, and least ratio of it to the sum of those to the neighbours.
_LESS, _LEAST, _SHARPER = 0.3, np.radians(5.0), 2.0
#: The same ratios where a quad goes on from the end of a fold.
_CONTINUED, _WEAK = 1.01, 0.25
#: How often quads are divided again: beside others that are folded, too.
_ROUNDS = 8


def fold_triangles(mesh: Mesh) -> Ints:
    """Return the triangles of a mesh, with quads divided along the folds that cross them.

    A quad that is not planar may be divided along either diagonal. The mesh's own choice follows
    its other quads. Where the angles to the triangles around it are far smaller with the other
    diagonal, the surface is folded there.

    Returns
    -------
    ndarray of int, (t, 3)
        In the order of ``mesh.triangles``.

    Examples
    --------
    >>> x, y = np.mgrid[:3.0, :3.0]
    >>> hip = Mesh.from_grid(np.dstack([x, y, np.minimum(x, 2.0 - y)]))
    >>> hip.triangles[[1, 5]].tolist(), fold_triangles(hip)[[1, 5]].tolist()
    ([[1, 4, 5], [1, 5, 2]], [[4, 5, 2], [4, 2, 1]])
    """
    quad = np.flatnonzero(topology.are_quads(mesh.faces))
    if not len(quad):
        return mesh.triangles
    he, corner = mesh.half_edges, mesh.vertices[mesh.faces[quad]]
    count = np.where(topology.are_quads(mesh.faces), 4, 3)
    side = (np.cumsum(count) - count)[quad][:, None] + np.arange(4)
    twin = he.twin[side]
    normals = [_normals(corner, split) for split in (0, 1)]
    # Opposite sides are of different triangles.
    fold = np.array([_angles(n[:, 0], n[:, 2]) for n in normals])
    turned = begun = mesh.quad_splits[quad]
    at_side = np.zeros((len(he.twin), 3))
    single = ~topology.are_quads(mesh.faces)
    at_side[single[he.face]] = metrics.face_normals(mesh)[he.face[single[he.face]]]
    folded = np.full(len(quad), -1)
    for _ in range(_ROUNDS):
        at_side[side] = np.where(turned[:, None, None], normals[1], normals[0])
        bent = [np.where(twin < 0, 0.0, _angles(n, at_side[twin])).sum(axis=1) for n in normals]
        before, folded = folded, _folded(mesh.faces[quad], np.array(bent), fold, folded)
        if np.array_equal(folded, before):
            break
        turned = np.where(folded < 0, begun, folded == 1)
    if np.array_equal(turned, begun):
        return mesh.triangles
    return _divided(mesh, quad, turned)


def _folded(quads: Ints, bent: Array, fold: Array, before: Ints) -> Ints:
    """Return the diagonal that each quad (q, 4) is folded along: 0, 1, or -1 for none.

    Parameters
    ----------
    quads : ndarray of int, (q, 4)
    bent, fold : ndarray, (2, q)
        For either diagonal the sum of the angles between the quad's triangles and their
        neighbours, and the angle at the diagonal.
    before : ndarray of int, (q,)
        Those that were found before; they stay.
    """
    low, high, better = bent.min(axis=0), bent.max(axis=0), np.argmin(bent, axis=0)
    own = np.take_along_axis(fold, better[None], axis=0)[0]
    clear = (low < _LESS * high) & (own > _LEAST) & (own > _SHARPER * low)
    # Those that go on from the end of a fold.
    ends = np.stack([quads[:, [0, 2]], quads[:, [1, 3]]])
    known = np.where(before < 0, np.where(clear, better, -1), before)
    some = np.flatnonzero(known >= 0)
    near = np.isin(ends, ends[known[some], some]).any(axis=2)
    near &= (bent <= _CONTINUED * bent[::-1]) & (fold > _WEAK * bent) & (high > _LEAST)
    found = np.where(clear, better, np.where(near.any(axis=0), near.argmax(axis=0), -1))
    return np.where(before < 0, found, before)


def _divided(mesh: Mesh, quad: Ints, turned: Flags) -> Ints:
    """Divide quads along the diagonal 1-3 where they are turned, and else along 0-2."""
    splits = mesh.quad_splits.copy()
    splits[quad] = turned
    made: Ints = topology.triangulate(mesh.faces, splits)
    if mesh.grid_index is None:
        return made
    # First one triangle of each quad, then the others.
    return np.asarray(made.reshape(-1, 2, 3).transpose(1, 0, 2).reshape(-1, 3))


def _normals(corner: Array, split: int) -> Array:
    """Return the normals (q, 4, 3) of quads (q, 4, 3) at their sides, as they are divided.

    With ``split=1`` it is along the diagonal 1-3.
    """
    a, b, c, d = np.roll(corner, -split, axis=1).transpose(1, 0, 2)
    one, other = unit(np.cross(b - a, c - a)), unit(np.cross(c - a, d - a))
    return np.roll(np.stack([one, one, other, other], axis=1), split, axis=1)


def _angles(one: Array, other: Array) -> Array:
    """Return the angles between unit vectors, along the last axis."""
    cosine = np.einsum("...d,...d->...", one, other)
    return np.asarray(np.arctan2(lengths(np.cross(one, other)), cosine))
