"""Shorter and straighter seams between pieces: shortest paths between the same junctions."""

from __future__ import annotations

import numpy as np

from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.seams.chains import chains
from gso.seams.merging import Merging
from gso.seams.tree import Ground
from gso.typing import Flags, Ints

#: Number of passes over all seams, and number of edges that are straightened together.
_PASSES, _WINDOW = 3, 12
#: Ratio of the estimated strain to its bound up to which a seam is straightened.
_EXCESS = 1.03


def straightened(ground: Ground, merging: Merging) -> Ints:
    """Replace seams between two pieces by shortest paths, where the estimated strain allows it.

    On quads the paths follow edge rows.

    Returns
    -------
    ndarray of int, (m,)
        The piece of each face.
    """
    mesh = ground.mesh
    label: Ints = merging.label.copy()
    kept = np.zeros(len(mesh.vertices), bool)
    kept[ground.kept] = True
    for number in range(_PASSES):
        ends, sides = merging.between(label)
        for (a, b), line in chains(ends, sides):
            if a == b or kept[line[1:-1]].any():
                continue
            for first, last in _windows(line, number):
                # The seam may have moved since the chains were listed.
                if not _still(merging, label, a, b, line):
                    break
                part = _shorter(ground, label, (a, b), line, first, last)
                if part is None:
                    continue
                new = np.r_[line[:first], part, line[last + 1 :]]
                if _relabelled(ground, merging, label, (a, b), new):
                    line = new
                    if first == 0 and last == len(line) - 1:
                        break
    return label


def _windows(line: Ints, number: int) -> list[tuple[int, int]]:
    """List parts of a chain to straighten: all of it, then windows, shifted from pass to pass."""
    count = len(line)
    out = [(0, count - 1)] if line[0] != line[-1] else []
    begin = number * _WINDOW // _PASSES
    windows = [(k, k + _WINDOW) for k in range(begin, count - 1, _WINDOW // 2)]
    # From the end, so that places before a window keep their numbers.
    return out + [(k, min(stop, count - 1)) for k, stop in windows[::-1] if count - k > 3]


def _still(merging: Merging, label: Ints, a: int, b: int, line: Ints) -> bool:
    """Tell whether a chain still divides the same two pieces."""
    ends, sides = merging.between(label)
    pair = np.sort(sides, axis=1)
    own = ends[(pair[:, 0] == min(a, b)) & (pair[:, 1] == max(a, b))]
    n = int(max(own.max(initial=0), line.max())) + 1
    keys = edge_keys(line[:-1], line[1:], n)
    return bool(np.isin(keys, pair_keys(own, n)).all())


def _shorter(
    ground: Ground, label: Ints, pair: tuple[int, int], line: Ints, first: int, last: int
) -> Ints | None:
    """Find a shorter path between two vertices of a chain, inside the two pieces."""
    last = min(last, len(line) - 1)
    if last - first < 2:
        return None
    closed = np.ones(len(ground.mesh.vertices), bool)
    closed[_inside(ground, label, *pair)] = False
    closed[line] = True
    closed[line[first : last + 1]] = False
    goal = np.zeros(len(closed), bool)
    goal[line[last]] = True
    even = np.ones(len(ground.paths.ends))
    before = line[first : last + 1]
    limit = (1.0 + 1e-9) * _cost(ground, before) if ground.mesh.has_triangles else np.inf
    path = ground.paths.cheapest(int(line[first]), goal, even, closed, limit)
    if path[-1] != line[last] or len(path) < 2 or np.array_equal(path, before):
        return None
    return path if _cost(ground, path) <= (1.0 + 1e-9) * _cost(ground, before) else None


def _relabelled(
    ground: Ground, merging: Merging, label: Ints, pair: tuple[int, int], line: Ints
) -> bool:
    """Divide two pieces along a new chain, if the estimated strain allows it."""
    a, b = pair
    faces = np.flatnonzero((label == a) | (label == b))
    new = _divided(ground, faces, line)
    if new is None:
        return False
    one, two = faces[new], faces[~new]
    if (label[one] == a).sum() + (label[two] == b).sum() < 0.5 * len(faces):
        one, two = two, one
    strains = [merging.estimate(some) for some in (one, two)]
    if any(s is None or s > _EXCESS * merging.strain for s in strains):
        return False
    label[one], label[two] = a, b
    return True


def _cost(ground: Ground, line: Ints) -> float:
    """Return the length of a chain, times the factors of its edges."""
    step = np.linalg.norm(np.diff(ground.mesh.vertices[line], axis=0), axis=1)
    factor = ground.factor_of(np.stack([line[:-1], line[1:]], axis=1))
    return float(step.sum() if factor is None else step @ factor)


def _inside(ground: Ground, label: Ints, a: int, b: int) -> Ints:
    """Return the vertices all of whose faces belong to two pieces, and none on the boundary."""
    mesh = ground.mesh
    real = mesh.faces >= 0
    own = ((label == a) | (label == b))[:, None] & real
    there = np.bincount(mesh.faces[own], minlength=len(mesh.vertices))
    every = np.bincount(mesh.faces[real], minlength=len(mesh.vertices))
    return np.flatnonzero((there == every) & (every > 0) & ~mesh.half_edges.boundary_vertex)


def _divided(ground: Ground, faces: Ints, path: Ints) -> Flags | None:
    """Divide faces along a path: mark those on one side; None unless there are two sides."""
    mesh, he = ground.mesh, ground.mesh.half_edges
    local = np.full(len(mesh.faces), -1)
    local[faces] = np.arange(len(faces))
    k = he.interior
    f, g = local[he.face[k]], local[he.face[he.twin[k]]]
    cut = he.on(np.stack([path[:-1], path[1:]], axis=1))[k]
    keep = (f >= 0) & (g >= 0) & ~cut
    side = label_components(len(faces), f[keep], g[keep])
    return side == 0 if side.max(initial=0) == 1 else None
