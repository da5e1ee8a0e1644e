"""Seams of a triangle mesh, straightened by vertices that are inserted where they cross edges."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gso.cut_pieces import Pieces
from gso.mesh import Mesh
from gso.mesh.slicing import divided
from gso.mesh.topology import edge_keys, pair_keys
from gso.seams.chains import chains
from gso.seams.walking import Walker
from gso.typing import Array, Ints

#: Largest distance of a seam from the straight one, in mean edge lengths.
_NEAR = 0.8
#: Largest number of edges that a straight part replaces: long ones bend with the surface.
_LONGEST = 12


def straight_seams(pieces: Pieces, kept: Ints) -> tuple[Mesh, Ints]:
    """Replace zigzags of seams along edges by straight lines through triangles.

    The shape does not change: new vertices lie on edges of the design.

    Parameters
    ----------
    pieces : Pieces
        Of a triangle mesh.
    kept : ndarray of int, (k, 2)
        Edges of seams that stay.

    Returns
    -------
    mesh : Mesh
        The design with the new vertices after its own.
    edges : ndarray of int, (e, 2)
        Its seams.
    """
    mesh, n = pieces.design, len(pieces.design.vertices)
    step = float(pieces.lengths.mean()) if len(pieces.edges) else 0.0
    walker = Walker(mesh)
    seam = set(pair_keys(pieces.edges, n).tolist())
    kept = kept.reshape(-1, 2)
    fixed = set(pair_keys(kept, n).tolist())
    on_seam = set(np.unique(pieces.edges).tolist())
    taken: set[int] = set()
    divided_keys: set[int] = set()
    crossed: list[tuple[int, int]] = []
    shares: list[float] = []
    lines: list[list[int]] = []
    for _, chain in chains(pieces.edges, pieces.sides):
        keys = edge_keys(chain[:-1], chain[1:], n).tolist()
        if fixed.intersection(keys):
            lines.append(chain.tolist())
            continue
        some = stops(mesh.vertices[chain], _NEAR * step, _LONGEST)
        for a, b in pairwise(some):
            part = chain[a : b + 1].tolist()
            found = walker.walk(part[0], part[-1]) if b - a > 1 else None
            if found is None:
                lines.append(part)
                continue
            ends = np.array(found.edges, np.int64).reshape(-1, 2)
            own = pair_keys(ends, n).tolist()
            along = [
                int(edge_keys(np.array(one), np.array(two), n))
                for one, two in pairwise(found.stops)
                if one >= 0 and two >= 0
            ]
            through = set(found.vertices[1:-1])
            free = not (taken & found.faces) and not (seam - set(keys[a:b])).intersection(own)
            # Vertices of other seams, or of other parts of this one, are in the way; so are edges
            # that another line divides.
            free = free and not (through & (on_seam - set(part)))
            free = free and not divided_keys.intersection(along)
            if not free:
                lines.append(part)
                continue
            taken |= found.faces
            divided_keys.update(own)
            seam.update(along)
            on_seam |= through
            first = len(crossed)
            crossed += found.edges
            shares += found.shares
            lines.append([s if s >= 0 else n + first - 1 - s for s in found.stops])
    finer, _ = divided(mesh, np.array(crossed, np.int64).reshape(-1, 2), np.array(shares))
    edges = [np.stack([line[:-1], line[1:]], axis=1) for line in map(np.array, lines)]
    return finer, np.concatenate([np.empty((0, 2), np.int64), *edges])


def stops(points: Array, near: float, longest: int) -> list[int]:
    """Choose points of a line (k, d) so that the straight lines between them are near to it.

    Parameters
    ----------
    points : ndarray, (k, d)
    near : float
        Largest distance of a point from the straight line that replaces it.
    longest : int
        Largest number of steps of the line that one straight line replaces.

    Returns
    -------
    list of int
        Numbers of the points, with the first and the last one.

    Source: Douglas and Peucker 1973.

    >>> stops(np.array([[0.0, 0], [1, 0.1], [2, 0], [2, 2]]), 0.2, 10)
    [0, 2, 3]
    """
    keep, todo = {0, len(points) - 1}, [(0, len(points) - 1)]
    while todo:
        a, b = todo.pop()
        if b - a < 2:
            continue
        way = points[b] - points[a]
        away = points[a + 1 : b] - points[a]
        along = np.clip(away @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        far = np.linalg.norm(away - along[:, None] * way, axis=1)
        k = int(far.argmax()) + a + 1
        if far.max() > near or b - a > longest:
            k = k if far.max() > near else (a + b) // 2
            keep.add(k)
            todo += [(a, k), (k, b)]
    return sorted(keep)
