"""Vertices that are drawn elsewhere where an earlier solve of pieces was not as it should be.

Every vertex of the result may be close to the design where the design is not close to the result:
the ends of rods recede, and ridges become flat. And parts of the surface may pass through each
other.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gso import faults
from gso.constraints import Handle
from gso.cut_pieces import Pieces
from gso.mesh import Mesh, Nearest
from gso.mesh.normals import vertex_normals
from gso.mesh.topology import neighbour_means
from gso.typing import Array, Flags, Ints

#: Distance over the allowed one from which on vertices are drawn, and that up to which they are.
_FROM, _TO = 0.85, 0.6
#: Weight of that, its factor where a vertex that is drawn stays as far away, and its largest power.
_WEIGHT, _STRONGER, _OFTEN = 1.0, 3.0, 4
#: Step over the allowed distance by which parts that cross in the design are drawn apart.
_APART = 0.15
#: Distance over the allowed one up to which vertices are beside those of faces that cross, and that
#: up to which they are at one place.
_BESIDE, _ONE_PLACE = 0.5, 1e-6


class Corrections:
    """Where vertices are drawn; those that were once drawn stay so.

    Vertices from which the surface is too far away are drawn towards their own points of the
    design, and so are those of parts that have come to pass through each other. Where the design
    passes through itself, both parts are drawn inwards.

    Parameters
    ----------
    pieces : Pieces
        Of the design.
    distance : float
        The allowed one.
    """

    def __init__(self, pieces: Pieces, distance: float):
        self._design, self._distance = pieces.design, distance
        #: How often each vertex was too far away.
        self._often: Ints = np.zeros(len(self._design.vertices), np.int64)
        #: How often each vertex was drawn inwards for a crossing.
        self._inwards = self._often.copy()
        self._own: Flags = self._often > 0
        #: What draws them.
        self.constraints: list[Handle] = []

    def measure(self, surface: Mesh, crossed: Ints) -> None:
        """Add the vertices that are wrong on a surface, which is the design after a solve.

        Some faces of it pass through others.
        """
        design = self._design
        _, _, feet = Nearest(surface).locate(design.vertices)
        away = feet - design.vertices
        size = np.linalg.norm(away, axis=1) / self._distance
        self._often[(size > _FROM) & design.used] += 1
        self._add(np.isin(np.arange(len(size)), surface.faces[crossed]))
        share = np.minimum(1.0, _TO / np.maximum(size, 1e-300))
        share[self._own] = 0.0
        target = design.vertices + share[:, None] * away
        step = _APART * self._distance * np.minimum(self._inwards, _OFTEN)
        target += step[:, None] * self._directions
        often = np.maximum(self._often, self._inwards)
        ids = np.flatnonzero(often)
        power = np.minimum(often[ids] - 1, _OFTEN)
        self.constraints = [
            Handle(ids[power == k], target[ids[power == k]], _WEIGHT * _STRONGER**k)
            for k in np.unique(power).tolist()
        ]

    @cached_property
    def _before(self) -> Flags:
        """The vertices near faces that cross in the design, and those where parts touch."""
        design = self._design
        out = np.zeros(len(design.vertices), bool)
        own = np.unique(design.faces[np.unique(faults.crossings(design))])
        if len(own):
            away, _ = cKDTree(design.vertices[own]).query(design.vertices)
            out = np.asarray(away < _BESIDE * self._distance)
        out[self._touching] = True
        return out

    @cached_property
    def _touching(self) -> Ints:
        """The pairs (k, 2) of vertices at one place, where two parts of the design touch."""
        design, used = self._design, np.flatnonzero(self._design.used)
        found = cKDTree(design.vertices[used]).query_pairs(_ONE_PLACE * self._distance)
        return used[np.array(sorted(found), np.int64).reshape(-1, 2)]

    @cached_property
    def _directions(self) -> Array:
        """The unit vectors (n, 3) in which parts are drawn apart.

        That is inwards, and where parts touch to the own neighbours from those of the other part.
        """
        design, pairs = self._design, self._touching
        out = -vertex_normals(design)
        if len(pairs):
            means = neighbour_means(design.edges, len(out)) @ design.vertices
            way = means[pairs] - means[pairs[:, ::-1]]
            size = np.linalg.norm(way, axis=2, keepdims=True)
            out[pairs] = np.where(size > 0.0, way / np.maximum(size, 1e-300), out[pairs])
        return np.asarray(out)

    def _add(self, now: Flags) -> None:
        """Add the vertices of faces that cross."""
        if not now.any():
            return
        inwards = now & self._before
        self._inwards[inwards] += 1
        self._often[now & ~inwards] += 1
        self._own[now] = ~inwards[now]
