"""Merging of coincident vertices, and its effect on faces and edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.errors import MeshError
from gso.mesh.topology.graph import label_components
from gso.mesh.topology.half_edges import edge_keys
from gso.typing import Array, Flags, Ints

# With more pairs per vertex than this the tolerance is larger than the edges.
_MOST_PAIRS = 50


def equal(points: Array) -> Ints:
    """Find for each point (n, 3) the first one with the same coordinates.

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
    """Find for each point (n, 3) the first point of the cluster that it is merged into.

    A cluster is connected by pairs of points within the tolerance. Error messages identify
    points by their `names`, or by their indices.

    Raises
    ------
    MeshError
        A cluster is wider than twice the tolerance, so that a part of the surface would shrink
        to a point; or most points have dozens of others within the tolerance.
    """
    first = equal(points)
    if not tolerance > 0:
        return first
    from scipy.spatial import cKDTree

    kept, index = np.unique(first, return_inverse=True)
    # Squares of lengths must neither overflow nor underflow. Scaling by a power of two is
    # exact.
    size = 2.0 ** float(np.floor(np.log2(np.ptp(points, axis=0).max() or 1.0)))
    apart, weld, tolerance = points[kept] / size, tolerance, min(tolerance / size, 4.0)
    tree = cKDTree(apart)
    if tree.count_neighbors(tree, tolerance) > (1 + 2 * _MOST_PAIRS) * len(apart):
        raise MeshError(
            f"weld={weld:.3g} would merge most vertices with dozens of others; "
            "give a length well below that of the edges"
        )
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    label = label_components(len(apart), *pairs.T)
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
    return np.asarray(kept[order[begin]][label][index])


@dataclass(frozen=True)
class Collapsed:
    """Faces after vertices were merged.

    Attributes
    ----------
    faces : ndarray, (p, 3) or (p, 4)
        Remaining faces; a quad with one collapsed edge becomes a triangle that ends in -1.
    kept : ndarray, (p,)
        Their indices among the original faces.
    turns : ndarray, (p, 3) or (p, 4)
        For each corner, the column of the original corner; -1 for none.
    """

    faces: Ints
    kept: Ints
    turns: Ints


def collapse(faces: Ints, target: Ints) -> Collapsed:
    """Replace every vertex v by `target[v]` in the faces, and drop degenerate faces.

    These are triangles with two equal corners, and quads with two equal opposite corners or
    two collapsed edges.

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


def seams(points: Array, origin: Ints, dest: Ints) -> Flags:
    """Mark the edges (from vertex `origin` to `dest`) that coincide with another of them."""
    ends, index = np.unique(np.r_[origin, dest], return_inverse=True)
    place = equal(points[ends])[index.ravel()]
    a, b = place[: len(origin)], place[len(origin) :]
    _, which, count = np.unique(edge_keys(a, b, len(ends)), return_inverse=True, return_counts=True)
    return count[which.ravel()] > 1
