"""Strips as a plane graph: parameters in which each face is a polygon and no two overlap."""

from __future__ import annotations

import numpy as np

from gso.parametrization.embedding import centred
from gso.ruled.strip_layout import Strips
from gso.typing import Array, Ints


def border(triangles: Ints) -> Ints:
    """Return the vertices of the border of a disk of triangles (t, 3), in their orientation."""
    start = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()
    size = int(triangles.max()) + 1
    inner = np.isin(start * size + end, end * size + start)
    follow = dict(zip(start[~inner].tolist(), end[~inner].tolist(), strict=True))
    first = next(iter(follow))
    out = [first]
    while (at := follow[out[-1]]) != first:
        out.append(at)
    return np.array(out)


def plane(strips: Strips, triangles: Ints) -> Array:
    """Return parameters (n, 2) of the vertices of strips in triangles (t, 3): Tutte's embedding.

    The border is on a circle, and all other vertices are the means of their neighbours, so that
    no face is inverted.
    """
    loop = border(triangles)
    angle = 2.0 * np.pi * np.arange(len(loop)) / len(loop)
    at = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    a, b = np.unique(np.sort(sides, axis=1), axis=0).T
    return centred(strips.size, a, b, loop, at)
