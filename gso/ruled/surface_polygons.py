"""The planar polygons of a ruled surface, between its rulings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gso.mesh import topology
from gso.mesh.topology import pair_keys
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Ints

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True)
class SurfacePolygons:
    """A surface as polygons between rulings.

    Attributes
    ----------
    surface : RuledSurface
    rings : list of ndarray of int
        Corners of the polygons, vertices of the pattern, anticlockwise.
    face : ndarray of int, (p,)
        The first face of each.
    part : ndarray of int, (p,)
        The part of the pattern that each is in.
    pairs : ndarray of int, (r, 2)
        The polygons on both sides of the rulings.
    rulings : ndarray of int, (r, 2)
        The rulings, as edges of the pattern.
    """

    surface: RuledSurface
    rings: list[Ints]
    face: Ints
    part: Ints
    pairs: Ints
    rulings: Ints

    @classmethod
    def of(cls, surface: RuledSurface) -> Self | None:
        """Read a surface; None where a polygon has a hole, or touches itself."""
        pattern = surface.pattern
        he, n = pattern.mesh.half_edges, len(pattern.flat)
        inner = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
        key = pair_keys(np.stack([he.origin[inner], he.dest[inner]], axis=1), n)
        hinge = np.isin(key, pair_keys(surface.folded.edges, n))
        one, two = he.face[inner], he.face[he.twin[inner]]
        count = len(pattern.faces)
        cell = topology.label_components(count, one[~hinge], two[~hinge])
        part = topology.label_components(count, one, two)
        # In the order of strips.
        first = np.unique(cell, return_index=True)[1]
        rank = np.empty(len(first), np.int64)
        rank[np.lexsort((first, surface.strip[first]))] = np.arange(len(first))
        cell = rank[np.unique(cell, return_inverse=True)[1]]
        first = np.unique(cell, return_index=True)[1]
        k = np.flatnonzero(he.face >= 0)
        twin = np.where(he.twin[k] >= 0, cell[he.face[he.twin[k]]], -1)
        k = k[twin != cell[he.face[k]]]
        after: list[dict[int, int]] = [{} for _ in first]
        for own, a, b in zip(
            cell[he.face[k]].tolist(), he.origin[k].tolist(), he.dest[k].tolist(), strict=True
        ):
            if a in after[own]:
                return None
            after[own][a] = b
        rings = []
        for ways in after:
            ring = [next(iter(ways))]
            while (ahead := ways[ring[-1]]) != ring[0]:
                ring.append(ahead)
            if len(ring) < len(ways):
                return None
            rings.append(np.array(ring))
        at = inner[hinge]
        pairs = np.stack([cell[he.face[at]], cell[he.face[he.twin[at]]]], axis=1)
        ends = np.stack([he.origin[at], he.dest[at]], axis=1)
        part = np.unique(part[first], return_inverse=True)[1]
        return cls(surface, rings, first, part, pairs, ends)
