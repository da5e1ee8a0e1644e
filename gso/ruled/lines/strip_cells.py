"""The combinatorics of strips along lines of a mesh: polygons between creases and rulings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.errors import MeshError
from gso.mesh import topology
from gso.ruled.lines.line_families import Family
from gso.ruled.lines.polygons import Polygons
from gso.typing import Flags, Ints


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
        owner, loops = self._loops(self._removed)
        if len(loops) > owner[-1] + 1:
            raise MeshError("strips along the lines of this mesh would have holes")
        return loops

    @cached_property
    def outlines(self) -> tuple[Ints, list[Ints]]:
        """The strip that each loop of strips' borders belongs to, and the loops."""
        owner, loops = self._loops(self._removed | self.family.is_ruling)
        # Strips are numbered by their first faces, as regions are.
        return owner, loops

    def _loops(self, removed: Flags) -> tuple[Ints, list[Ints]]:
        """Return the borders of regions of faces joined across edges, and the region of each."""
        he = self.family.mesh.half_edges
        shut = removed[self.family.edge]
        k = he.interior
        k = k[shut[k]]
        count = len(self.family.mesh.faces)
        region = topology.label_components(count, he.face[k], he.face[he.twin[k]])
        k = np.flatnonzero(~shut)
        ahead = np.full(len(shut), -1)
        ahead[k] = he.next[k]
        while (again := k[shut[ahead[k]]]).size:
            ahead[again] = he.next[he.twin[ahead[again]]]
        loop = topology.label_components(len(shut), k, ahead[k])[k]
        loop = np.unique(loop, return_inverse=True)[1]
        first = k[np.unique(loop, return_index=True)[1]]
        size = np.bincount(loop)
        walk = [first]
        for _ in range(int(size.max()) - 1):
            walk.append(ahead[walk[-1]])
        origin = he.origin[np.stack(walk, axis=1)]
        inside = (np.arange(origin.shape[1]) < size[:, None]) & ~self.dropped[origin]
        owner = region[he.face[first]]
        order = np.argsort(owner, kind="stable")
        return owner[order], [origin[i][inside[i]] for i in order]

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

    @cached_property
    def _pairs(self) -> tuple[Ints, Ints, Ints]:
        """Pairs of polygons (k,), (k,) that a ruling joins, and the ruling."""
        family, he = self.family, self.family.mesh.half_edges
        k = he.interior
        k = k[family.is_ruling[family.edge[k]]]
        rulings, first = np.unique(self.ruling[family.edge[k]], return_index=True)
        k = k[first]
        return self.cell[he.face[k]], self.cell[he.face[he.twin[k]]], rulings

    @cached_property
    def neighbours(self) -> Ints:
        """Number of rulings of each polygon."""
        one, two, _ = self._pairs
        return np.bincount(np.r_[one, two], minlength=len(self.rings))

    @cached_property
    def strip_of_ruling(self) -> Ints:
        """The strip that each ruling is in."""
        one, _, rulings = self._pairs
        out = np.zeros(len(self.ends), np.int64)
        out[rulings] = self.strip[one]
        return out

    def end_ruling(self, cell: int) -> tuple[int, int]:
        """Return the ends of the only ruling of a polygon."""
        one, two, rulings = self._pairs
        a, b = self.ends[rulings[int(((one == cell) | (two == cell)).argmax())]]
        return int(a), int(b)

    @cached_property
    def polygons(self) -> Polygons:
        """The polygons, with the lines between them."""
        edges = self.family.mesh.edges
        lines = np.concatenate([self.creased, self.bordered])
        creases = edges[self.is_crease]
        return Polygons(self.rings, self.strip, self.ends, creases, lines, self.across)
