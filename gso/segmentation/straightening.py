"""Shorter and straighter seams between pieces: shortest paths between the same junctions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from gso.mesh.topology import edge_keys
from gso.seams.chains import chains
from gso.segmentation.merging import Merging
from gso.segmentation.tree import Ground
from gso.typing import Ints

#: Number of passes over all seams.
_PASSES = 2


def straightened(ground: Ground, merging: Merging) -> Ints:
    """Replace seams between two pieces by shortest paths, where the estimated strain allows it.

    On quads the paths follow edge rows.

    Returns
    -------
    ndarray of int, (m,)
        The piece of each face.
    """
    mesh, paths = ground.mesh, ground.paths
    label = merging.label.copy()
    even = np.ones(len(paths.ends))
    kept = np.zeros(len(mesh.vertices), bool)
    kept[ground.kept] = True
    for _ in range(_PASSES):
        changed = False
        ends, sides = merging.between(label)
        for (a, b), line in chains(ends, sides):
            if a == b or line[0] == line[-1] or kept[line[1:-1]].any():
                continue
            faces = np.flatnonzero((label == a) | (label == b))
            closed = np.ones(len(mesh.vertices), bool)
            closed[_inside(ground, label, a, b)] = False
            closed[line[[0, -1]]] = False
            goal = np.zeros(len(closed), bool)
            goal[line[-1]] = True
            path = paths.cheapest(int(line[0]), goal, even, closed)
            if path[-1] != line[-1] or len(path) < 2 or np.array_equal(path, line):
                continue
            if _length(ground, path) > (1.0 + 1e-9) * _length(ground, line):
                continue
            new = _divided(ground, faces, path)
            if new is None:
                continue
            one, two = faces[new], faces[~new]
            if (label[one] == a).sum() + (label[two] == b).sum() < 0.5 * len(faces):
                one, two = two, one
            strains = [merging.estimate(some) for some in (one, two)]
            if any(s is None or s > merging.strain for s in strains):
                continue
            label[one], label[two] = a, b
            changed = True
        if not changed:
            break
    return label


def _length(ground: Ground, line: Ints) -> float:
    return float(np.linalg.norm(np.diff(ground.mesh.vertices[line], axis=0), axis=1).sum())


def _inside(ground: Ground, label: Ints, a: int, b: int) -> Ints:
    """Return the vertices all of whose faces belong to two pieces, and none on the boundary."""
    mesh = ground.mesh
    real = mesh.faces >= 0
    own = ((label == a) | (label == b))[:, None] & real
    there = np.bincount(mesh.faces[own], minlength=len(mesh.vertices))
    every = np.bincount(mesh.faces[real], minlength=len(mesh.vertices))
    return np.flatnonzero((there == every) & (every > 0) & ~mesh.half_edges.boundary_vertex)


def _divided(ground: Ground, faces: Ints, path: Ints) -> NDArray[np.bool_] | None:
    """Divide faces along a path: mark those on one side; None unless there are two sides."""
    mesh, n = ground.mesh, len(ground.mesh.vertices)
    he = mesh.half_edges
    local = np.full(len(mesh.faces), -1)
    local[faces] = np.arange(len(faces))
    k = np.flatnonzero(he.twin > np.arange(he.twin.size))
    f, g = local[he.face[k]], local[he.face[he.twin[k]]]
    cut = np.isin(edge_keys(he.origin[k], he.dest[k], n), edge_keys(path[:-1], path[1:], n))
    keep = (f >= 0) & (g >= 0) & ~cut
    graph = coo_matrix((np.ones(int(keep.sum())), (f[keep], g[keep])), (len(faces),) * 2)
    count, side = connected_components(graph, directed=False)
    return side == 0 if count == 2 else None
