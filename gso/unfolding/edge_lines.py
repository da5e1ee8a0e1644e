"""Edges of a mesh that lines in space run along."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gso.mesh.topology import pair_keys
from gso.typing import Array, Flags, Ints

#: Distance of an edge from a line that runs along it, relative to the diagonal.
_NEAR = 1e-6


def edges_along(points: Array, edges: Ints, lines: Sequence[Array]) -> tuple[Ints, list[str]]:
    """Find the edges that lines run along; a segment may be several edges long.

    Parameters
    ----------
    points : ndarray, (n, 3)
    edges : ndarray of int, (m, 2)
    lines : sequence of ndarray, (k, 3)
        Points of each line.

    Returns
    -------
    edges : ndarray of int, (e, 2)
        All copies of edges that lie on each other.
    notes : list of str
        Names of lines that leave the edges, with the first place; only their other parts count.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> line = np.array([[0.0, 0, 0], [1, 1, 0], [0, 0.5, 0]])
    >>> along, notes = edges_along(points, np.array([[0, 1], [2, 0], [2, 3]]), [line])
    >>> along.tolist(), notes[0][:43]
    ([[2, 0]], 'polyline 1 does not run along edges between')
    """
    segments = [(k, *ends) for k, line in enumerate(lines) for ends in pairwise(line)]
    found, notes = [np.empty((0, 2), np.int64)], list[str]()
    if not segments:
        return found[0], notes
    # An import that few files need.
    from scipy.spatial import cKDTree

    a, b = points[edges].transpose(1, 0, 2)
    near = _NEAR * float(np.linalg.norm(np.ptp(np.concatenate([a, b]), axis=0)))
    tree, long = cKDTree(0.5 * (a + b)), 0.5 * float(np.linalg.norm(b - a, axis=1).max())
    named: set[int] = set()
    for number, start, end in segments:
        size = float(np.linalg.norm(end - start))
        close = tree.query_ball_point(0.5 * (start + end), 0.5 * size + long + near)
        own = np.array(close, np.int64)
        on, along = _on(a[own], b[own], start, end, near)
        if _covered(along[on], size, near):
            found.append(edges[own[on]])
        elif number not in named:
            named.add(number)
            places = " and ".join(f"({', '.join(f'{x:.6g}' for x in p)})" for p in (start, end))
            notes.append(
                f"polyline {number + 1} does not run along edges between {places}, and is no cut "
                "there"
            )
    every = np.concatenate(found)
    _, first = np.unique(pair_keys(every, len(points)), return_index=True)
    return every[first], notes


def _on(a: Array, b: Array, start: Array, end: Array, near: float) -> tuple[Flags, Array]:
    """Tell which edges are on a segment, and where their ends are along it, (e, 2)."""
    size = float(np.linalg.norm(end - start))
    way = (end - start) / max(size, 1e-300)
    ends = np.stack([a, b], axis=1) - start
    along = ends @ way
    off = np.linalg.norm(ends - along[..., None] * way, axis=2).max(axis=1, initial=0.0)
    along.sort(axis=1)
    return (off < near) & (along[:, 0] > -near) & (along[:, 1] < size + near), along


def _covered(parts: Array, size: float, near: float) -> bool:
    """Tell whether intervals (e, 2) cover all from 0 to a size."""
    parts = parts[np.argsort(parts[:, 0])]
    reach = np.maximum.accumulate(np.r_[0.0, parts[:, 1]])
    return bool((parts[:, 0] < reach[:-1] + near).all() and reach[-1] > size - near)
