"""Where a user wants seams, and where not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.mesh.slicing import followed
from gso.mesh.topology import label_components, pair_keys
from gso.seams.tree import Ground
from gso.typing import Flags, Ints


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is asked of the seams of a mesh.

    Attributes
    ----------
    kept : ndarray of int, (k, 2)
        Edges that are cut in any case.
    along : ndarray of int, (a, 2)
        Edges that seams should follow.
    avoided : ndarray of bool, (n,)
        Vertices between which seams should not run.
    """

    kept: Ints
    along: Ints
    avoided: Flags

    @classmethod
    def nothing(cls, mesh: Mesh) -> Wanted:
        """Ask nothing of the seams of a mesh."""
        none = np.empty((0, 2), np.int64)
        return cls(none, none, np.zeros(len(mesh.vertices), bool))

    @classmethod
    def of(cls, ground: Ground) -> Wanted:
        """Return what was asked of the seams of a design."""
        mesh, factor = ground.mesh, ground.factor
        nothing = cls.nothing(mesh)
        if factor is None:
            return cls(ground.kept, nothing.along, nothing.avoided)
        avoided = nothing.avoided
        avoided[mesh.edges[factor > 1.0]] = True
        return cls(ground.kept, mesh.edges[factor < 1.0], avoided)

    @property
    def lines(self) -> tuple[Ints, Ints]:
        """The edges that are cut in any case, and those that seams should follow."""
        return self.kept, self.along

    def through(self, edges: Ints, count: int) -> Wanted:
        """Return the same for a mesh of `count` vertices with one more on each of some edges."""
        kept, along = (followed(own, edges, count) for own in self.lines)
        more = self.avoided[edges].all(axis=1)
        return Wanted(kept, along, np.concatenate([self.avoided, more]))


def without_specks(mesh: Mesh, lines: Ints, least: float) -> Ints:
    """Leave out edges of lines (k, 2) that divide a very small part of a mesh from its neighbour.

    Such parts have less than the `least` share of the area. They come from lines that run side by
    side where a mesh is coarse.

    Examples
    --------
    >>> sheet = Mesh.from_grid(np.dstack([*np.meshgrid(range(4), range(4)), np.zeros((4, 4))]))
    >>> mesh = Mesh(sheet.vertices, sheet.triangles)
    >>> around = mesh.edges[np.isin(mesh.edges, mesh.faces[8]).all(axis=1)]
    >>> len(around), len(without_specks(mesh, around, 0.1))
    (3, 1)
    """
    he, area = mesh.half_edges, geometry.doubled_areas(mesh.vertices, mesh.faces)
    while len(lines):
        k = he.interior
        on = he.on(lines)[k]
        f, g = he.face[k], he.face[he.twin[k]]
        part = label_components(len(mesh.faces), f[~on], g[~on])
        size = np.bincount(part, area)
        k, pair = k[on], part[np.stack([f[on], g[on]], axis=1)]
        small = size[pair] < least * area.sum()
        some = (pair[:, 0] != pair[:, 1]) & small.any(axis=1)
        if not some.any():
            break
        k, pair = k[some], np.sort(pair[some], axis=1)
        length = np.linalg.norm(mesh.vertices[he.origin[k]] - mesh.vertices[he.dest[k]], axis=1)
        pairs, number = np.unique(pair, axis=0, return_inverse=True)
        longest = np.bincount(number.ravel(), length).argmax()
        gone = k[(pair == pairs[longest]).all(axis=1)]
        keys = pair_keys(np.stack([he.origin[gone], he.dest[gone]], axis=1), len(mesh.vertices))
        lines = lines[~np.isin(pair_keys(lines, len(mesh.vertices)), keys)]
    return lines
