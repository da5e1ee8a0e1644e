"""The lines of a quad mesh along which strips may run, and the bands of rows between them.

Each face gets a direction: two of its opposite edges lie along the strips, the two others across
them. Edges along the strips continue to lines, edges across them to rulings. Faces that follow
each other along a strip are a row, and rows side by side a band.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, topology
from gso.typing import Array, Flags, Ints

#: Largest number of patches for which all combinations of directions are compared.
_PATCHES = 12
#: Cost of an edge where directions change, relative to that of curvature along rulings.
_WALL = 0.3


@dataclass(frozen=True)
class Family:
    """Lines of a quad mesh in one direction of each face.

    Attributes
    ----------
    mesh : Mesh
        Quads.
    along : ndarray of int, (m,)
        Which edges of each face lie along the strips: 0 for the first and the third, 1 for the
        others.
    """

    mesh: Mesh
    along: Ints

    @cached_property
    def edge(self) -> Ints:
        """The edge of each half-edge."""
        he = self.mesh.half_edges
        return self.mesh.edge_numbers(he.origin, he.dest)

    @cached_property
    def lengthwise(self) -> Flags:
        """Mask over half-edges: those along the strip of their face."""
        he = self.mesh.half_edges
        return np.asarray(np.arange(len(he.face)) % 2 == self.along[he.face])

    @cached_property
    def _counts(self) -> tuple[Ints, Ints]:
        """Number of faces of each edge that it lies along, and that it lies across."""
        size = len(self.mesh.edges)
        return (
            np.bincount(self.edge[self.lengthwise], minlength=size),
            np.bincount(self.edge[~self.lengthwise], minlength=size),
        )

    @cached_property
    def is_ruling(self) -> Flags:
        """Mask over edges: inside, across the strips of both faces."""
        return np.asarray(self._counts[1] == 2)

    @cached_property
    def is_line(self) -> Flags:
        """Mask over edges: inside, along the strips of both faces."""
        return np.asarray(self._counts[0] == 2)

    @cached_property
    def triples(self) -> tuple[Ints, Ints, Ints]:
        """Straight triples of vertices (t, 3), and the edges (t,), (t,) of each."""
        triples = topology.polyline_triples(self.mesh.half_edges, self.mesh.faces)
        ends = (self.mesh.edge_numbers(triples[:, k], triples[:, k + 1]) for k in range(2))
        one, two = ends
        return triples, one, two

    @cached_property
    def line(self) -> Ints:
        """Number of the line of each edge (e,); -1 for other edges."""
        _, one, two = self.triples
        inside = self.is_line[one] & self.is_line[two]
        label = topology.label_components(len(self.mesh.edges), one[inside], two[inside])
        out = np.full(len(label), -1)
        out[self.is_line] = np.unique(label[self.is_line], return_inverse=True)[1]
        return out

    @cached_property
    def row(self) -> Ints:
        """Number of the row of each face."""
        he = self.mesh.half_edges
        k = he.interior
        k = k[self.is_ruling[self.edge[k]]]
        return topology.label_components(len(self.mesh.faces), he.face[k], he.face[he.twin[k]])

    @cached_property
    def beside(self) -> Ints:
        """The rows on both sides of the lines, (s, 3): line, row, row; each triple once."""
        he = self.mesh.half_edges
        k = he.interior
        k = k[self.is_line[self.edge[k]]]
        rows = np.sort(np.stack([self.row[he.face[k]], self.row[he.face[he.twin[k]]]], axis=1), 1)
        return np.unique(np.column_stack([self.line[self.edge[k]], rows]), axis=0)

    @cached_property
    def bands(self) -> list[Band]:
        """The bands, in the order of their first rows; lines between bands are always creases."""
        beside, rows = self.beside, int(self.row.max()) + 1
        inner = ~self.mesh.half_edges.boundary_vertex
        irregular = inner & (self.mesh.half_edges.face_count != 4)
        on = self.mesh.edges[self.is_line]
        ends = self.line[self.is_line][irregular[on].any(axis=1)]
        # A line that ends at an irregular vertex, or has more than a row on a side, stays.
        number, times = np.unique(beside[:, 0], return_counts=True)
        fixed = np.r_[ends, number[times > 1], beside[beside[:, 1] == beside[:, 2], 0]]
        free = beside[~np.isin(beside[:, 0], fixed)]
        while len(free):
            pairs, which = np.unique(free[:, 1:], axis=0, return_inverse=True)
            degree = np.bincount(pairs.ravel(), minlength=rows)
            several = np.bincount(which.ravel())[which.ravel()] > 1
            # Two rows beside each other at several lines, as in a ring of two rows.
            bad = (degree[free[:, 1:]] > 2).any(axis=1) | several
            if not bad.any():
                break
            free = free[~bad]
        label = topology.label_components(rows, free[:, 1], free[:, 2])
        return [self._band(free, np.flatnonzero(label == k)) for k in range(int(label.max()) + 1)]

    def _band(self, free: Ints, rows: Ints) -> Band:
        """Return a band with its rows in order."""
        links = free[np.isin(free[:, 1], rows)]
        degree = np.bincount(links[:, 1:].ravel(), minlength=int(rows.max()) + 1)[rows]
        closed = bool(len(links)) and len(links) == len(rows)
        at = int(rows[0] if closed else rows[int((degree < 2).argmax())])
        order, lines = [at], []
        left = {int(n): (int(a), int(b)) for n, a, b in links}
        while left:
            step = next((n for n in sorted(left) if at in left[n]), None)
            if step is None:
                break
            a, b = left.pop(step)
            at = b if at == a else a
            lines.append(step)
            order.append(at)
        if closed:
            order = order[:-1]
        return Band(np.array(order), np.array(lines, np.int64), closed)


@dataclass(frozen=True)
class Band:
    """Rows side by side.

    Attributes
    ----------
    rows : ndarray of int, (n,)
        In order.
    lines : ndarray of int, (n - 1,) or (n,)
        Lines between successive rows; in a closed band the last one is between the last and the
        first row.
    closed : bool
        Whether the band closes around.
    """

    rows: Ints
    lines: Ints
    closed: bool


def families(mesh: Mesh) -> list[Family]:
    """Return the families of lines of a quad mesh, those with straighter rulings first.

    A mesh with irregular vertices of odd valence has no two families all over: it is divided along
    the lines that start at irregular vertices, and directions are chosen patch by patch, so that
    rulings are little curved and directions seldom change.

    Examples
    --------
    >>> u, v = np.mgrid[:3.0, :5.0]
    >>> grid = Mesh.from_grid(np.stack([u, v, 0.1 * v * v], axis=-1))
    >>> [len(family.bands[0].rows) for family in families(grid)]
    [2, 4]
    """
    if mesh.has_triangles:
        return []
    bent = _bending(mesh)
    he, faces = mesh.half_edges, np.arange(len(mesh.faces))
    k = he.interior
    parity = (k + he.twin[k]) % 2 == 1
    one, two = he.face[k], he.face[he.twin[k]]
    label, part = topology.tree_parity(len(faces), one, two, parity)
    if ((label[one] ^ label[two]) == parity).all():
        found = [label.astype(np.int64), 1 - label]
    else:
        walls = _separatrices(mesh)[mesh.edge_numbers(he.origin[k], he.dest[k])]
        label, part = topology.tree_parity(len(faces), one[~walls], two[~walls], parity[~walls])
        if ((label[one] ^ label[two]) != parity)[~walls].any():
            return []
        found = _choices(mesh, bent, label, part, k[walls])
    cost = [float(bent[faces, 1 - along].sum()) for along in found]
    return [Family(mesh, np.asarray(found[i], np.int64)) for i in np.argsort(cost, kind="stable")]


def _choices(mesh: Mesh, bent: Array, label: Flags, part: Ints, walls: Ints) -> list[Ints]:
    """Return the best directions of patches (m,), and the best with another first patch."""
    he, count = mesh.half_edges, int(part.max()) + 1
    faces = np.arange(len(part))
    own = label.astype(np.int64)
    # The cost of each patch with its label, and with the other one.
    cost = np.stack(
        [np.bincount(part, bent[faces, 1 - (own ^ flip)], count) for flip in (0, 1)], axis=1
    )
    one, two = he.face[walls], he.face[he.twin[walls]]
    # Directions change where one face lies along the wall and the other across it.
    turned = ((walls + he.twin[walls] + own[one] + own[two]) % 2).astype(bool)
    size = lengths(mesh.vertices[he.dest[walls]] - mesh.vertices[he.origin[walls]])
    price = _WALL * size * bent.sum() / (mesh.edge_lengths.sum())
    pairs = part[one], part[two]

    def total(flips: Ints) -> float:
        changed = turned ^ (flips[pairs[0]] != flips[pairs[1]])
        return float(cost[np.arange(count), flips].sum() + price[changed].sum())

    if count <= _PATCHES:
        every = [np.array([n >> i & 1 for i in range(count)]) for n in range(2**count)]
        values = [total(flips) for flips in every]
        largest = int(np.bincount(part).argmax())
        best = []
        for first in (0, 1):
            own_best = [i for i, flips in enumerate(every) if flips[largest] == first]
            best.append(every[min(own_best, key=values.__getitem__)])
    else:
        best = []
        for first in (0, 1):
            flips = np.full(count, first)
            for _ in range(4 * count):
                tried = [flips ^ (np.arange(count) == i) for i in range(count)]
                values = [total(t) for t in tried]
                if min(values) >= total(flips):
                    break
                flips = tried[int(np.argmin(values))]
            best.append(flips)
    return [own ^ flips[part] for flips in best]


def _bending(mesh: Mesh) -> Array:
    """Return, for each face and pair of opposite edges, how much these bend, times its area."""
    v, he = mesh.vertices, mesh.half_edges
    triples = topology.polyline_triples(he, mesh.faces)
    a, b, c = v[triples].transpose(1, 0, 2)
    long = np.maximum(0.5 * (lengths(c - b) + lengths(b - a)), 1e-300)
    bend = lengths(unit(c - b) - unit(b - a)) / long
    size = len(mesh.edges)
    total, count = np.zeros(size), np.zeros(size)
    for k in range(2):
        at = mesh.edge_numbers(triples[:, k], triples[:, k + 1])
        np.add.at(total, at, bend)
        np.add.at(count, at, 1.0)
    edge = mesh.edge_numbers(he.origin, he.dest)
    each = (total / np.maximum(count, 1.0))[edge].reshape(-1, 4)
    p, q, r, s = v[mesh.faces].transpose(1, 0, 2)
    area = 0.5 * lengths(np.cross(r - p, s - q))
    return 0.5 * area[:, None] * (each[:, :2] + each[:, 2:])


def _separatrices(mesh: Mesh) -> Flags:
    """Mask over edges: those on lines that start at irregular vertices inside."""
    triples = topology.polyline_triples(mesh.half_edges, mesh.faces)
    one, two = (mesh.edge_numbers(triples[:, k], triples[:, k + 1]) for k in range(2))
    label = topology.label_components(len(mesh.edges), one, two)
    he = mesh.half_edges
    irregular = ~he.boundary_vertex & (he.face_count != 4) & mesh.used
    starts = label[irregular[mesh.edges].any(axis=1)]
    return np.isin(label, starts)
