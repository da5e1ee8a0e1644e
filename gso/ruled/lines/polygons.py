"""Polygons that are to become planar, with the lines between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gso.geometry.vectors import cross, lengths
from gso.mesh import topology
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Polygons:
    """Polygons between rulings and creases, with vertices of a mesh as corners.

    Attributes
    ----------
    rings : list of ndarray of int
        The corners of each, anticlockwise.
    strip : ndarray of int, (p,)
        The strip of each.
    rulings : ndarray of int, (r, 2)
        Edges between polygons of one strip.
    creases : ndarray of int, (c, 2)
        Edges between strips.
    lines : ndarray of int, (t, 3)
        Vertices that follow each other straight on along creases and the outline.
    across : ndarray of int, (t, 3)
        Ends of rulings that run on across creases.
    """

    rings: list[Ints]
    strip: Ints
    rulings: Ints
    creases: Ints
    lines: Ints
    across: Ints

    def with_rulings(self, rings: list[Ints], strip: Ints, rulings: Ints) -> Polygons:
        """Return other polygons between the same creases."""
        none = np.empty((0, 3), np.int64)
        return replace(self, rings=rings, strip=strip, rulings=rulings, across=none)

    def planes(self, points: Array) -> Ints:
        """Return three corners and another one (e, 4) for each condition that polygons are planar.

        Parameters
        ----------
        points : ndarray, (n, 3)
            Positions of the mesh's vertices, from which three corners far apart are chosen.
        """
        size = np.array([len(ring) for ring in self.rings])
        out = [
            _base(points, np.array([self.rings[i] for i in np.flatnonzero(size == n)]))
            for n in np.unique(size[size > 3])
        ]
        return np.concatenate(out) if out else np.empty((0, 4), np.int64)


def _base(points: Array, ids: Ints) -> Ints:
    """Return the conditions (e, 4) of polygons (p, n) with the same number of corners."""
    count, n = ids.shape
    corner = points[ids]
    rows = np.arange(count)
    # The longest diagonal or side, and the corner farthest from it.
    square = ((corner[:, :, None] - corner[:, None]) ** 2).sum(axis=3).reshape(count, -1)
    a, b = np.divmod(square.argmax(axis=1), n)
    way = corner[rows, b] - corner[rows, a]
    away = corner - corner[rows, a][:, None]
    c = lengths(cross(np.broadcast_to(way[:, None], corner.shape), away)).argmax(axis=1)
    other = np.ones((count, n), bool)
    for k in (a, b, c):
        other[rows, k] = False
    p, at = np.nonzero(other)
    base = np.stack([ids[rows, k] for k in (a, b, c)], axis=1)
    return np.column_stack([base[p], ids[p, at]])


def sides(rings: list[Ints]) -> tuple[Ints, Ints]:
    """Return the sides (s, 2) of polygons, one polygon after the other, and the polygon of each."""
    after = np.concatenate([np.roll(ring, -1) for ring in rings])
    owner = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    return np.stack([np.concatenate(rings), after], axis=1), owner


def inner_edges(rings: list[Ints]) -> Ints:
    """Return the edges between polygons, (e, 4): the polygons on both sides, and the two ends."""
    every, owner = sides(rings)
    key = topology.pair_keys(every, int(every.max()) + 1)
    order = np.argsort(key, kind="stable")
    i = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[i], order[i + 1]
    return np.column_stack([owner[one], owner[two], every[one]])


def middles(rings: list[Ints], points: Array) -> Array:
    """Return the means (p, 3) of the corners of polygons."""
    size = np.array([len(ring) for ring in rings])
    owner = np.repeat(np.arange(len(rings)), size)
    return np.asarray(_summed(owner, points[np.concatenate(rings)], len(rings)) / size[:, None])


def area_vectors(rings: list[Ints], points: Array) -> Array:
    """Return the doubled area vectors (p, 3) of polygons."""
    every, owner = sides(rings)
    p, q = (points[every] - middles(rings, points)[owner][:, None]).transpose(1, 0, 2)
    return _summed(owner, cross(p, q), len(rings))


def _summed(owner: Ints, values: Array, count: int) -> Array:
    return np.stack([np.bincount(owner, column, count) for column in values.T], axis=1)
