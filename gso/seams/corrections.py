"""Vertices that are drawn elsewhere where an earlier solve of pieces was not as it should be.

Every vertex of the result may be close to the design where the design is not close to the result:
the ends of rods recede, and ridges become flat. And parts of the surface may pass through each
other.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gso import faults
from gso.constraints import Handle
from gso.cut_pieces import Pieces
from gso.mesh import Mesh, Nearest
from gso.mesh.normals import vertex_normals
from gso.typing import Flags, Ints

#: Distance over the allowed one from which on vertices are drawn, and that up to which they are.
_FROM, _TO = 0.85, 0.6
#: Weight of that, its factor where a vertex that is drawn stays as far away, and its largest power.
_WEIGHT, _STRONGER, _OFTEN = 1.0, 3.0, 4
#: Step over the allowed distance by which parts that cross in the design are drawn apart.
_APART = 0.15


class Corrections:
    """Where vertices are drawn; those that were once drawn stay so.

    Vertices from which the surface is too far away are drawn towards their own points of the
    design, and so are those of parts that have come to pass through each other. Where the design
    passes through itself, or that does not help, both parts are drawn inwards.

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
        #: How often each vertex was part of a crossing, and was drawn inwards for it.
        self._through, self._inwards = self._often.copy(), self._often.copy()
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
        target -= step[:, None] * vertex_normals(design)
        often = np.maximum(self._often, self._inwards)
        ids = np.flatnonzero(often)
        power = np.minimum(often[ids] - 1, _OFTEN)
        self.constraints = [
            Handle(ids[power == k], target[ids[power == k]], _WEIGHT * _STRONGER**k)
            for k in np.unique(power).tolist()
        ]

    @cached_property
    def _before(self) -> Flags:
        """The vertices of faces that cross in the design."""
        faces = self._design.faces[np.unique(faults.crossings(self._design))]
        return np.isin(np.arange(len(self._often)), faces)

    def _add(self, now: Flags) -> None:
        """Add the vertices of faces that cross."""
        if not now.any():
            return
        self._through[now] += 1
        # Faces beside those that cross in the design may cross, too.
        inwards = now & (self._before | (self._through > 1))
        self._inwards[inwards] += 1
        self._often[now & ~inwards] += 1
        self._own[now] = ~inwards[now]
