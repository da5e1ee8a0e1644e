"""Seams as chains of vertices."""

from __future__ import annotations

import numpy as np

from gso.typing import Ints


def chains(edges: Ints, sides: Ints) -> list[tuple[tuple[int, int], Ints]]:
    """Divide cut edges into chains between junctions, each between the same two pieces.

    Parameters
    ----------
    edges : ndarray of int, (s, 2)
    sides : ndarray of int, (s, 2)
        The pieces on both sides of each.

    Returns
    -------
    list of (pair of int, ndarray of int)
        The two pieces, the smaller number first, and the vertices along the chain. A closed
        chain has its first vertex again at the end.

    Examples
    --------
    >>> chains(np.array([[0, 1], [2, 1], [3, 2]]), np.array([[0, 1], [1, 0], [0, 1]]))
    [((0, 1), array([0, 1, 2, 3]))]
    """
    pair = np.sort(sides, axis=1)
    _, kind = np.unique(pair, axis=0, return_inverse=True)
    kind = kind.ravel()
    touching: dict[int, list[int]] = {}
    for k, (a, b) in enumerate(edges.tolist()):
        touching.setdefault(a, []).append(k)
        touching.setdefault(b, []).append(k)

    def passes(vertex: int) -> bool:
        near = touching[vertex]
        return len(near) == 2 and bool(kind[near[0]] == kind[near[1]])

    left, out = set(range(len(edges))), []
    begin = [v for v in sorted(touching) if not passes(v)]
    for start in [*begin, *sorted(touching)]:
        for first in touching[start]:
            if first not in left:
                continue
            line, k = [start], first
            while True:
                left.discard(k)
                a, b = edges[k].tolist()
                line.append(b if a == line[-1] else a)
                if not passes(line[-1]) or line[-1] == start:
                    break
                one, two = touching[line[-1]]
                k = two if one == k else one
                if k not in left:
                    break
            a, b = pair[first].tolist()
            out.append(((a, b), np.array(line)))
    return out
