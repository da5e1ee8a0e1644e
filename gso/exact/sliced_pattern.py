"""A cut pattern whose triangles are divided along lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.mesh.slicing import subdivided
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.recognition import Recognised
from gso.typing import Array, Ints
from gso.unfolding import Joined

#: Space between parts, relative to the size.
_APART = 0.02


@dataclass(eq=False)
class SlicedPattern:
    """A cut pattern of a shape, whose triangles can be divided.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices of the surface.
    flat : ndarray, (p, 2)
    vertex : ndarray of int, (p,)
        Vertex of the surface of each vertex of the pattern.
    faces : ndarray of int, (t, 3)
    label : ndarray of int, (t,)
        Number of the shape's face of each triangle.
    seams : ndarray of int, (s, 2, 2)
    """

    points: Array
    flat: Array
    vertex: Ints
    faces: Ints
    label: Ints
    seams: Ints

    @classmethod
    def of(cls, shape: Recognised, joined: Joined) -> SlicedPattern:
        """Join the corners of triangles across edges that are not cut; parts stand in a row."""
        edges, whole = joined.edges, joined.whole
        one, other = edges.corners()
        count = 3 * len(shape.triangles)
        names = label_components(count, one[whole].ravel(), other[whole].ravel())
        _, first, label = np.unique(names, return_index=True, return_inverse=True)
        corner = label.ravel()
        often = np.bincount(corner)
        flat = np.stack(
            [np.bincount(corner, joined.flat[..., d].ravel()) / often for d in (0, 1)], axis=1
        )
        part = np.repeat(joined.part, 3)[first]
        flat[:, 0] += _row(flat, part, _APART * shape_size(shape))[part]
        return cls(
            shape.vertices,
            flat,
            shape.triangles.ravel()[first],
            corner.reshape(-1, 3),
            shape.face,
            np.stack([corner[one[~whole]], corner[other[~whole]]], axis=1),
        )

    def insert(self, edges: Ints, shares: Array) -> None:
        """Insert a vertex on each of some edges of the pattern, and on their copies at seams."""
        count, n = len(self.flat), len(self.points)
        copy = self._copies(edges)
        seamed = copy[:, 0] >= 0
        both = np.concatenate([edges, copy[seamed]])
        every = np.concatenate([shares, shares[seamed]])
        number = n + np.concatenate([np.arange(len(edges)), np.flatnonzero(seamed)])
        _, once = np.unique(pair_keys(both, count), return_index=True)
        once.sort()
        both, every, number = both[once], every[once], number[once]
        a, b = self.vertex[edges].T
        new = self.points[a] + shares[:, None] * (self.points[b] - self.points[a])
        p, q = self.flat[both].transpose(1, 0, 2)
        self.faces, owner = subdivided(self.faces, count, both)
        self.seams = self._halved(both, count)
        self.points = np.concatenate([self.points, new])
        self.flat = np.concatenate([self.flat, p + every[:, None] * (q - p)])
        self.vertex = np.concatenate([self.vertex, number])
        self.label = self.label[owner]

    def _copies(self, edges: Ints) -> Ints:
        """Return the other copy (k, 2) of edges at seams, in their direction; -1 for others."""
        count, out = len(self.flat), np.full((len(edges), 2), -1)
        if not len(self.seams):
            return out
        sides = self.seams.transpose(1, 0, 2).reshape(-1, 2)
        others = self.seams[:, ::-1].transpose(1, 0, 2).reshape(-1, 2)
        place = _places(pair_keys(sides, count), pair_keys(edges, count))
        hit = place >= 0
        same = sides[place[hit], 0] == edges[hit, 0]
        out[hit] = np.where(same[:, None], others[place[hit]], others[place[hit], ::-1])
        return out

    def _halved(self, edges: Ints, count: int) -> Ints:
        """Replace seams whose edges are divided by their halves."""
        keys = pair_keys(edges, count)
        middle = [_places(keys, pair_keys(self.seams[:, side], count)) for side in (0, 1)]
        hit = middle[0] >= 0
        one, other = self.seams[hit].transpose(1, 0, 2)
        m, w = (count + part[hit] for part in middle)
        first = np.stack([np.c_[one[:, 0], m], np.c_[other[:, 0], w]], axis=1)
        second = np.stack([np.c_[m, one[:, 1]], np.c_[w, other[:, 1]]], axis=1)
        return np.concatenate([self.seams[~hit], first, second])

    def edges_of(self, number: int) -> Ints:
        """Return the edges (e, 2) of the triangles of a face, each once."""
        own, count = self.faces[self.label == number], len(self.flat)
        keys = np.unique(edge_keys(own, np.roll(own, -1, axis=1), count))
        return np.stack(np.divmod(keys, count), axis=1)

    def inner(self) -> Ints:
        """Return the keys of the edges that two triangles share."""
        keys = edge_keys(self.faces, np.roll(self.faces, -1, axis=1), len(self.flat)).ravel()
        found, often = np.unique(keys, return_counts=True)
        return np.asarray(found[often == 2])


def _places(keys: Ints, wanted: Ints) -> Ints:
    """Return the place of each wanted key among keys; -1 where it is not."""
    order = np.argsort(keys, kind="stable")
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][at] == wanted, order[at], -1)


def _row(flat: Array, part: Ints, gap: float) -> Array:
    """Return shifts that put parts side by side."""
    order = np.argsort(part, kind="stable")
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    low = np.minimum.reduceat(flat[order, 0], starts)
    wide = np.maximum.reduceat(flat[order, 0], starts) - low + gap
    return np.asarray(np.cumsum(wide) - wide - low)


def shape_size(shape: Recognised) -> float:
    """Return the diagonal of a shape."""
    return float(np.linalg.norm(np.ptp(shape.vertices, axis=0)))
