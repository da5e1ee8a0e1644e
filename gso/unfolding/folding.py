"""Folding of flat parts: the motions of what stays rigid or is rolled, from fold to fold."""

from __future__ import annotations

import numpy as np

from gso.geometry import closest_motion
from gso.geometry.vectors import unit
from gso.mesh.topology import pair_keys
from gso.pattern import Folded
from gso.typing import Array, Ints
from gso.unfolding.dual_edges import DualEdges


def angles_at(edges: DualEdges, folded: Folded, count: int) -> Array:
    """Return the angles of folds at edges, 0 at others, for `count` vertices."""
    keys = pair_keys(folded.edges, count)
    own = pair_keys(edges.ends, count)
    if not len(keys):
        return np.zeros(len(own))
    order = np.argsort(keys)
    at = order[np.minimum(np.searchsorted(keys[order], own), len(keys) - 1)]
    return np.where(keys[at] == own, folded.angles[at], 0.0)


def frames(ends: Array, normals: Array) -> Array:
    """Return frames at edges: columns are direction, normal, and what is across both; (e, 3, 3)."""
    way = unit(ends[:, 1] - ends[:, 0])
    normal = unit(normals - np.einsum("ed,ed->e", normals, way)[:, None] * way)
    return np.stack([way, normal, np.cross(way, normal)], axis=2)


def motions(
    pairs: Ints, middle: Array, frame: Array, angle: Array, count: int
) -> tuple[Array, Array]:
    """Return rotation (g, 3, 3) and shift (g, 3) of bodies that meet at edges.

    One body of each connected set stays.

    Parameters
    ----------
    pairs : ndarray of int, (e, 2)
        The bodies on both sides of each edge, the first to the left of it.
    middle : ndarray, (e, 2, 3)
        A point of the edge as both bodies have it in their own places.
    frame : ndarray, (e, 2, 3, 3)
        Frames of the edge there, from :func:`frames`.
    angle : ndarray, (e,)
        By how much the second body turns about the edge: positive for mountain folds.
    count : int
        Number of bodies.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components
    from scipy.spatial.transform import Rotation

    a, b = pairs.T
    # Of several edges between two bodies one is enough.
    _, once = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_index=True)
    a, b, number = a[once], b[once], once + 1
    graph = coo_matrix(
        (np.r_[number, number], (np.r_[a, b], np.r_[b, a])), shape=(count, count)
    ).tocsr()
    turn, shift = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    _, label = connected_components(graph, directed=False)
    depth, above = np.zeros(count, np.int64), np.full(count, -1)
    for root in np.unique(label, return_index=True)[1].tolist():
        order, before = breadth_first_order(graph, root, directed=False)
        above[order[1:]] = before[order[1:]]
        for here in order[1:].tolist():
            depth[here] = depth[above[here]] + 1
    below = np.flatnonzero(above >= 0)
    if not len(below):
        return turn, shift
    edge = np.full(count, -1)
    edge[below] = np.asarray(graph[below, above[below]]).ravel().astype(np.int64) - 1
    for level in range(1, int(depth.max(initial=0)) + 1):
        own = np.flatnonzero(depth == level)
        e, up = edge[own], above[own]
        # Seen from the second body the fold is turned back.
        first = pairs[e, 0] == up
        here, there = np.where(first, 0, 1), np.where(first, 1, 0)
        about = np.zeros((len(own), 3))
        about[:, 0] = np.where(first, angle[e], -angle[e])
        folded = frame[e, here] @ Rotation.from_rotvec(about).as_matrix()
        local = folded @ frame[e, there].transpose(0, 2, 1)
        still = middle[e, here] - np.einsum("gij,gj->gi", local, middle[e, there])
        turn[own] = turn[up] @ local
        shift[own] = np.einsum("gij,gj->gi", turn[up], still) + shift[up]
    return turn, shift


def misfit(points: Array, design: Array, part: Ints) -> float:
    """Return how far folded parts are from a design at most, each moved onto it rigidly.

    Parameters
    ----------
    points, design : ndarray, (p, 3)
    part : ndarray of int, (p,)
    """
    far = 0.0
    for number in np.unique(part).tolist():
        ids = part == number
        turn, shift = closest_motion(points[ids], design[ids])
        away = points[ids] @ turn.T + shift - design[ids]
        far = max(far, float(np.linalg.norm(away, axis=1).max()))
    return far
