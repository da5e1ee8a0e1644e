"""Where a user wants seams, and where not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.mesh import Mesh
from gso.mesh.slicing import followed
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
