"""The combinatorics of strips along lines of a mesh: polygons between creases and rulings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.errors import MeshError
from gso.mesh import topology
from gso.ruled.lines.line_families import Family
from gso.ruled.vectors import cross, lengths
from gso.typing import Array, Flags, Ints


@dataclass(frozen=True)
class Cells:
    """Polygons that are to become planar, of faces of a mesh joined across lines.

    All rulings of a family stay, and its lines where these are creases; vertices where a ruling
    only runs on are left out. Vertices of the outline stay.

    Attributes
    ----------
    family : Family
    kept : ndarray of int, (k,)
        The lines that are creases.
    """

    family: Family
    kept: Ints

    @cached_property
    def is_crease(self) -> Flags:
        """Mask over the mesh's edges: inside, and not rulings."""
        family = self.family
        inner = ~family.mesh.boundary_edges & ~family.is_ruling
        return np.asarray(inner & ~self._removed)

    @cached_property
    def _removed(self) -> Flags:
        family = self.family
        movable = np.concatenate([band.lines for band in family.bands])
        return np.asarray(family.is_line & np.isin(family.line, np.setdiff1d(movable, self.kept)))

    @cached_property
    def dropped(self) -> Flags:
        """Mask over the mesh's vertices: where a ruling runs on."""
        mesh = self.family.mesh
        left = np.bincount(mesh.edges[~self._removed].ravel(), minlength=len(mesh.vertices))
        return np.asarray((left == 2) & ~mesh.half_edges.boundary_vertex & mesh.used)

    @cached_property
    def cell(self) -> Ints:
        """The polygon of each face of the mesh."""
        he = self.family.mesh.half_edges
        k = he.interior
        k = k[self._removed[self.family.edge[k]]]
        count = len(self.family.mesh.faces)
        return topology.label_components(count, he.face[k], he.face[he.twin[k]])

    @cached_property
    def rings(self) -> list[Ints]:
        """The corners of the polygons, anticlockwise, as vertices of the mesh."""
        he = self.family.mesh.half_edges
        open_ = ~self._removed[self.family.edge]
        ahead = he.next.copy()
        while True:
            shut = ~open_[ahead]
            if not shut.any():
                break
            ahead[shut] = he.next[he.twin[ahead[shut]]]
        k = np.flatnonzero(open_)
        owner = self.cell[he.face[k]]
        count = int(self.cell.max()) + 1
        first = k[np.unique(owner, return_index=True)[1]]
        size = np.bincount(owner, minlength=count)
        walk, at = [first], ahead[first]
        for _ in range(int(size.max()) - 1):
            walk.append(at)
            at = ahead[at]
        table = np.stack(walk, axis=1)
        steps = np.argmax(np.c_[table[:, 1:], at] == first[:, None], axis=1) + 1
        if (steps != size).any():
            raise MeshError("strips along the lines of this mesh would have holes")
        origin = he.origin[table]
        inside = (np.arange(table.shape[1]) < size[:, None]) & ~self.dropped[origin]
        return [ids[own] for ids, own in zip(origin, inside, strict=True)]

    @cached_property
    def ruling(self) -> Ints:
        """The ruling of each edge of the mesh; -1 for edges that are on none."""
        family = self.family
        triples, one, two = family.triples
        through = family.is_ruling[one] & family.is_ruling[two] & self.dropped[triples[:, 1]]
        label = topology.label_components(len(family.is_ruling), one[through], two[through])
        out = np.full(len(label), -1)
        out[family.is_ruling] = np.unique(label[family.is_ruling], return_inverse=True)[1]
        return out

    @cached_property
    def ends(self) -> Ints:
        """The ends (r, 2) of the rulings, as vertices of the mesh."""
        edges = np.flatnonzero(self.ruling >= 0)
        ids, of = self.family.mesh.edges[edges].ravel(), np.repeat(self.ruling[edges], 2)
        end = ~self.dropped[ids]
        order = np.lexsort((ids[end], of[end]))
        return np.asarray(ids[end][order].reshape(-1, 2))

    @cached_property
    def inside(self) -> tuple[Ints, Ints]:
        """The vertices (d,) that were left out, and the ruling (d,) that each is on."""
        edges = np.flatnonzero(self.ruling >= 0)
        ids, of = self.family.mesh.edges[edges].ravel(), np.repeat(self.ruling[edges], 2)
        out = self.dropped[ids]
        vertex, first = np.unique(ids[out], return_index=True)
        return vertex, of[out][first]

    @cached_property
    def strip(self) -> Ints:
        """The strip of each polygon, which rulings join."""
        family, he = self.family, self.family.mesh.half_edges
        k = he.interior
        k = k[family.is_ruling[family.edge[k]]]
        one, two = self.cell[he.face[k]], self.cell[he.face[he.twin[k]]]
        return topology.label_components(len(self.rings), one, two)

    @cached_property
    def creased(self) -> Ints:
        """Triples (t, 3) of vertices that follow each other on creases."""
        triples, one, two = self.family.triples
        return triples[self.is_crease[one] & self.is_crease[two]]

    @cached_property
    def bordered(self) -> Ints:
        """Triples (t, 3) of vertices that follow each other on the outline, straight on."""
        rim = self.family.mesh.boundary_edges
        triples, one, two = self.family.triples
        return triples[rim[one] & rim[two]]

    @cached_property
    def across(self) -> Ints:
        """Triples (t, 3) of ends of rulings that follow each other across creases."""
        triples, one, two = self.family.triples
        kept = (self.ruling[one] >= 0) & (self.ruling[two] >= 0) & ~self.dropped[triples[:, 1]]
        at = triples[kept, 1]
        far = []
        for edge in (one, two):
            ends = self.ends[self.ruling[edge[kept]]]
            far.append(np.where(ends[:, 0] == at, ends[:, 1], ends[:, 0]))
        return np.stack([far[0], at, far[1]], axis=1)

    def planes(self, points: Array) -> Ints:
        """Return three corners and another one (e, 4) for each condition that polygons are planar.

        Parameters
        ----------
        points : ndarray, (n, 3)
            Positions of the mesh's vertices, from which three corners far apart are chosen.
        """
        out = []
        size = np.array([len(ring) for ring in self.rings])
        for n in np.unique(size[size > 3]):
            ids = np.array([ring for ring in self.rings if len(ring) == n])
            out.append(_base(points, ids))
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
    off = lengths(cross(np.broadcast_to(way[:, None], corner.shape), corner - corner[rows, a][:, None]))
    c = off.argmax(axis=1)
    other = np.ones((count, n), bool)
    for k in (a, b, c):
        other[rows, k] = False
    p, at = np.nonzero(other)
    base = np.stack([ids[rows, k] for k in (a, b, c)], axis=1)
    return np.column_stack([base[p], ids[p, at]])
