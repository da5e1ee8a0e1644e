"""The combinatorics of strips: which vertices are the corners of which planar faces.

A layout numbers the vertices of all strips; their positions (n, 3) are passed separately.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gso.geometry.vectors import cross
from gso.mesh.topology import label_components
from gso.short_repr import short_repr
from gso.typing import Array, Flags, Ints


def _no_faces() -> Ints:
    return np.empty((0, 4), np.int64)


@dataclass(frozen=True)
class Strips:
    """Strips of quads between successive rulings, and flat triangles between strips.

    A face has four corners: both ends of its part of a ruling, then both of the next ruling.
    Where two ends are one vertex, the face is a triangle.

    Attributes
    ----------
    index : tuple of ndarray of int, (r, k + 1) each
        For each sequence of rulings, the vertices of the rulings where they cross the k + 1
        border curves and creases, which divide it into k strips side by side.
    flats : ndarray of int, (g, 4)
        Triangles between three sequences, whose sides are rulings; the first corner is repeated
        as the third.
    """

    index: tuple[Ints, ...]
    flats: Ints = field(default_factory=_no_faces)

    __repr__ = short_repr

    @classmethod
    def sequence(cls, rulings: int, strips: int = 1) -> Strips:
        """Return the layout of strips side by side without merged vertices."""
        return cls((np.arange(rulings * (strips + 1)).reshape(rulings, strips + 1),))

    @property
    def count(self) -> int:
        """Number of strips side by side."""
        return int(self.index[0].shape[1]) - 1

    @cached_property
    def size(self) -> int:
        """Number of vertices."""
        return 1 + max(int(i.max()) for i in self.index)

    @cached_property
    def _faces(self) -> tuple[Ints, Ints]:
        """Corners (f, 4) of the faces, and the number of the strip of each, side by side."""
        parts = []
        for index in self.index:
            here, ahead = index[:-1], index[1:]
            sides = [here[:, :-1], here[:, 1:], ahead[:, :-1], ahead[:, 1:]]
            parts.append(np.stack(sides, axis=2).reshape(-1, 4))
        column = [np.arange(len(part)) % self.count for part in parts]
        corners = np.concatenate([*parts, self.flats])
        strip = np.concatenate([*column, np.zeros(len(self.flats), np.int64)])
        kept = (corners[:, 0] != corners[:, 2]) | (corners[:, 1] != corners[:, 3])
        return corners[kept], strip[kept]

    @property
    def corners(self) -> Ints:
        """Corners (f, 4) of the faces: of each sequence, ruling by ruling; the flats last.

        Between rulings that are the same there is no face.
        """
        return self._faces[0]

    @property
    def column(self) -> Ints:
        """Number of the strip of each face, side by side; 0 for the flats."""
        return self._faces[1]

    @cached_property
    def quads(self) -> Ints:
        """Numbers of the faces with four different corners."""
        c = self.corners
        return np.flatnonzero((c[:, 0] != c[:, 2]) & (c[:, 1] != c[:, 3]))

    @cached_property
    def along(self) -> Ints:
        """Triples (s, 3) of vertices that follow each other on border curves and creases."""
        parts = [np.stack([i[:-2], i[1:-1], i[2:]], axis=2).reshape(-1, 3) for i in self.index]
        return _different(np.concatenate(parts))

    @cached_property
    def creased(self) -> Ints:
        """Triples (s, 3) of vertices that follow each other on creases."""
        inner = [i[:, 1:-1] for i in self.index]
        parts = [np.stack([i[:-2], i[1:-1], i[2:]], axis=2).reshape(-1, 3) for i in inner]
        return _different(np.concatenate(parts))

    @cached_property
    def across(self) -> Ints:
        """Triples (s, 3) of vertices that follow each other on rulings."""
        parts = [
            np.stack([i[:, :-2], i[:, 1:-1], i[:, 2:]], axis=2).reshape(-1, 3) for i in self.index
        ]
        return _different(np.concatenate(parts))

    @cached_property
    def sides(self) -> Ints:
        """Vertices (e, 2) that follow each other on border curves and creases, if different."""
        rows = [np.stack([i[:-1], i[1:]], axis=2).reshape(-1, 2) for i in self.index]
        pairs: Ints = np.concatenate(rows)
        return _different(pairs)

    @cached_property
    def outer(self) -> Ints:
        """Vertices on the border curves."""
        return np.unique(np.concatenate([i[:, [0, -1]].ravel() for i in self.index]))

    @cached_property
    def split(self) -> tuple[Ints, Ints]:
        """Triangles (t, 3) of the faces, and the number of the face of each (t,)."""
        return _true(self.corners[:, [[0, 1, 3], [0, 3, 2]]])

    def _reflex(self, vertices: Array) -> Flags:
        """Return whether the corners (f, 4) of planar faces are reflex."""
        p, q, p1, q1 = vertices[self.corners].transpose(1, 0, 2)
        normal = cross(q1 - p, q - p1)
        own = [
            cross(q - p, p1 - p),
            cross(q1 - q, p - q),
            cross(p - p1, q1 - p1),
            cross(p1 - q1, q - q1),
        ]
        return np.stack([np.einsum("fd,fd->f", normal, n) > 0 for n in own], axis=1)

    def other_diagonal(self, vertices: Array) -> Flags:
        """Return whether faces (f,) have to be divided between their second and third corner.

        These are quads with a reflex corner there; the diagonal between the first and the last
        corner, which :attr:`split` takes, is outside of them.
        """
        return np.asarray(self._reflex(vertices)[:, 1:3].any(axis=1))

    def tangled(self, vertices: Array) -> Flags:
        """Return whether the outlines of planar faces (f,) cross themselves.

        Such a quad has two reflex corners.
        """
        out = np.zeros(len(self.corners), bool)
        out[self.quads] = self._reflex(vertices)[self.quads].sum(axis=1) > 1
        return out

    def divided(self, vertices: Array) -> tuple[Ints, Ints]:
        """Return triangles (t, 3) of planar faces, and the number of the face of each (t,)."""
        ids = self.corners[:, [[0, 1, 3], [0, 3, 2]]]
        other = self.other_diagonal(vertices)
        ids[other] = self.corners[other][:, [[0, 1, 2], [1, 3, 2]]]
        return _true(ids)

    @cached_property
    def hinges(self) -> tuple[Ints, Ints, Ints]:
        """Pairs of faces (h,), (h,) that share a ruling, and the ends (h, 2) of the rulings."""
        c = self.corners
        sides = [c[:, [0, 1]], c[:, [2, 3]]]
        face = [np.arange(len(c))] * 2
        if len(self.flats):
            # The third side of a flat triangle.
            sides.append(self.flats[:, [1, 3]])
            face.append(np.arange(len(c) - len(self.flats), len(c)))
        return _shared(np.concatenate(sides), np.concatenate(face))

    @cached_property
    def creases(self) -> tuple[Ints, Ints, Ints]:
        """Pairs of faces (h,), (h,) that share an edge of a crease, and its ends (h, 2)."""
        c = self.corners[: len(self.corners) - len(self.flats)]
        face = np.arange(len(c))
        return _shared(np.concatenate([c[:, [0, 2]], c[:, [1, 3]]]), np.concatenate([face, face]))

    @cached_property
    def is_disk(self) -> bool:
        """Whether the faces are a disk: one border, without points where it touches itself."""
        triangles, _ = self.split
        if not len(triangles):
            return False
        start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
        key, other = start * self.size + end, end * self.size + start
        rim = ~np.isin(key, other)
        if len(np.unique(key)) < len(key) or len(np.unique(start[rim])) < int(rim.sum()):
            return False
        label = label_components(self.size, start[rim], end[rim])
        return len(np.unique(label[start[rim]])) == 1

    def halved(self, vertices: Array, which: Ints | None = None) -> tuple[Strips, Array]:
        """Halve strips along their length, all or those numbered; planar quads stay planar."""
        which = np.arange(self.count) if which is None else which
        index, parts, size = [], [vertices], len(vertices)
        for old in self.index:
            pairs = np.stack([old[:, which], old[:, which + 1]], axis=2)
            distinct, number = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
            new = np.insert(old, which + 1, size + number.reshape(pairs.shape[:2]), axis=1)
            parts.append(vertices[distinct].mean(axis=1))
            size += len(distinct)
            index.append(new)
        return Strips(tuple(index), self.flats), np.concatenate(parts)

    def refined(self, vertices: Array) -> tuple[Strips, Array]:
        """Insert a ruling half-way between successive ones; planar quads stay planar."""
        pairs = np.concatenate(
            [np.stack([i[:-1], i[1:]], axis=2).reshape(-1, 2) for i in self.index]
        )
        distinct, number = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
        same = distinct[:, 0] == distinct[:, 1]
        ids = np.where(same, distinct[:, 0], len(vertices) + np.cumsum(~same) - 1)
        middle = ids[number.ravel()]
        index, at = [], 0
        for old in self.index:
            new = np.empty((2 * len(old) - 1, old.shape[1]), np.int64)
            count = old[1:].size
            new[::2], new[1::2] = old, middle[at : at + count].reshape(-1, old.shape[1])
            at += count
            index.append(new)
        inserted = vertices[distinct[~same]].mean(axis=1)
        return Strips(tuple(index), self.flats), np.concatenate([vertices, inserted])

    def compact(self, vertices: Array) -> tuple[Strips, Array]:
        """Leave out vertices that no ruling and no flat uses."""
        used = np.unique(np.concatenate([i.ravel() for i in (*self.index, self.flats)]))
        number = np.full(len(vertices), -1)
        number[used] = np.arange(len(used))
        return Strips(tuple(number[i] for i in self.index), number[self.flats]), vertices[used]

    def merged(self, vertices: Array, pairs: Ints) -> tuple[Strips, Array]:
        """Merge pairs (m, 2) of vertices, and what they are chained to, at their means."""
        label = label_components(self.size, *pairs.T)
        number = np.bincount(label)[:, None]
        mean = np.stack([np.bincount(label, v) for v in vertices.T], 1) / number
        index = tuple(label[i] for i in self.index)
        flats = label[self.flats]
        a, b, c = flats[:, [0, 1, 3]].T
        return Strips(index, flats[(a != b) & (b != c) & (a != c)]), mean


def _true(ids: Ints) -> tuple[Ints, Ints]:
    """Keep the triangles (f, 2, 3) of faces that have three different corners."""
    true = (ids[:, :, 0] != ids[:, :, 1]) & (ids[:, :, 0] != ids[:, :, 2])
    true &= ids[:, :, 1] != ids[:, :, 2]
    face, half = np.nonzero(true)
    return ids[face, half], face


def _shared(sides: Ints, face: Ints) -> tuple[Ints, Ints, Ints]:
    """Find the sides (s, 2) that two faces have in common."""
    kept = sides[:, 0] != sides[:, 1]
    sides, face = np.sort(sides[kept], axis=1), face[kept]
    ends, which, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    which = which.ravel()
    order = np.argsort(which, kind="stable")
    first = np.r_[0, np.cumsum(count)[:-1]][count == 2]
    return face[order[first]], face[order[first + 1]], ends[count == 2]


def _different(triples: Ints) -> Ints:
    out: Ints = triples[(triples[:, :-1] != triples[:, 1:]).all(axis=1)]
    return out
