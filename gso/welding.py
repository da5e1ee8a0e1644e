"""Merge vertices that lie on each other, and what becomes of faces and edges then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gso.status import MeshError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# More pairs than this for each vertex: the tolerance is no longer one, but a size.
_MOST_PAIRS = 50


def equal(points: Array) -> Ints:
    """For each point (n, 3) the first one with the same coordinates.

    >>> equal(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]))
    array([0, 1, 0])
    """
    order = np.lexsort(points.T)
    fresh = np.ones(len(points), bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    # lexsort is stable: the first of each run is the one that occurs first.
    out = np.empty(len(points), np.int64)
    out[order] = order[fresh][np.cumsum(fresh) - 1]
    return out


def near(points: Array, tolerance: float, names: Ints | None = None) -> Ints:
    """For each point (n, 3) the first one of those that it is merged with.

    Points within the tolerance of each other are merged, and so are those that chains of
    such pairs connect, as long as what is merged stays small. Messages call the points by
    their `names`, or by their places.

    Raises
    ------
    MeshError
        A chain reaches farther than twice the tolerance, so that a part of the surface
        would shrink to a point.
    """
    first = equal(points)
    if not tolerance > 0:
        return first
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    kept, index = np.unique(first, return_inverse=True)
    # Squares of lengths must stay within double precision, and not vanish either; a power of
    # two changes no digit.
    size = 2.0 ** float(np.floor(np.log2(np.ptp(points, axis=0).max() or 1.0)))
    apart, weld, tolerance = points[kept] / size, tolerance, min(tolerance / size, 4.0)
    tree = cKDTree(apart)
    if tree.count_neighbors(tree, tolerance) > (1 + 2 * _MOST_PAIRS) * len(apart):
        raise MeshError(
            f"weld={weld:.3g} would merge most vertices with dozens of others; "
            "give a length well below that of the edges"
        )
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    shape = (len(apart), len(apart))
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=shape)
    label = connected_components(links, directed=False)[1]
    order = np.argsort(label, kind="stable")
    begin = np.flatnonzero(np.diff(label[order], prepend=-1))
    low = np.minimum.reduceat(apart[order], begin)
    wide = np.linalg.norm(np.maximum.reduceat(apart[order], begin) - low, axis=1)
    if wide.max() > 2 * tolerance:
        group = int(wide.argmax())
        members = order[np.flatnonzero(label[order] == group)]
        first_one = kept[members.min()]
        raise MeshError(
            f"weld={weld:.3g} would merge a chain of {members.size} vertices that is "
            f"{size * wide[group]:.3g} wide (the first is vertex "
            f"{first_one if names is None else names[first_one]}); give a length "
            "well below that of the edges"
        )
    return kept[order[begin]][label][index]


@dataclass(frozen=True)
class Collapsed:
    """Faces after vertices were merged.

    Attributes
    ----------
    faces : ndarray, (p, 3) or (p, 4)
        Those that are left; a quad with one edge gone is a triangle that ends in -1.
    kept : ndarray, (p,)
        Which of the faces they were.
    turns : ndarray, (p, 3) or (p, 4)
        Which of its corners each corner was; -1 for none.
    """

    faces: Ints
    kept: Ints
    turns: Ints


def collapse(faces: Ints, target: Ints) -> Collapsed:
    """Put `target[v]` in the place of every vertex v; leave out faces without area.

    Those are triangles with two equal corners, and quads with two opposite corners or two
    edges gone.

    Examples
    --------
    >>> quads = np.array([[0, 1, 2, 3], [3, 2, 4, 5], [5, 4, 6, 7]])
    >>> done = collapse(quads, np.array([0, 1, 2, 3, 4, 4, 4, 7]))
    >>> done.faces, done.kept
    (array([[ 0,  1,  2,  3],
           [ 4,  3,  2, -1]]), array([0, 1]))
    """
    table = np.where(faces < 0, -1, target[faces])
    after = np.roll(table, -1, axis=1)
    quad = np.zeros(len(table), bool)
    if table.shape[1] == 4:
        quad = table[:, 3] >= 0
        after[~quad, 2] = table[~quad, 0]
    gone = table == after
    gone[~quad, 3:] = False
    lost = gone.sum(axis=1)
    good = lost <= quad
    if table.shape[1] == 4:
        good &= ~(quad & ((table[:, 0] == table[:, 2]) | (table[:, 1] == table[:, 3])))
    turns = np.broadcast_to(np.arange(table.shape[1]), table.shape).copy()
    turns[~quad, 3:] = -1
    cut = np.flatnonzero(good & (lost == 1))
    if cut.size:
        at = gone[cut].argmax(axis=1)
        turns[cut, :3] = (at[:, None] + 1 + np.arange(3)) % 4
        turns[cut, 3] = -1
    kept = np.flatnonzero(good)
    turns = turns[kept]
    left = np.where(turns < 0, -1, np.take_along_axis(table[kept], turns, axis=1))
    return Collapsed(left, kept, turns)


def seams(points: Array, origin: Ints, dest: Ints) -> NDArray[np.bool_]:
    """Which of some edges (from vertex `origin` to `dest`) lie on another one of them."""
    ends, index = np.unique(np.r_[origin, dest], return_inverse=True)
    place = equal(points[ends])[index.ravel()]
    a, b = place[: len(origin)], place[len(origin) :]
    keys = np.minimum(a, b) * np.int64(len(ends)) + np.maximum(a, b)
    _, which, count = np.unique(keys, return_inverse=True, return_counts=True)
    return count[which.ravel()] > 1
