"""Constraints on vertex positions: fixed vertices and handles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import Part, Pins
from gso.short_repr import short_repr


@dataclass(frozen=True, eq=False)
class Fixed(Constraint):
    """Vertices fixed at their positions in the design.

    Not for flat images, whose vertices have no positions yet: use :class:`Handle` there.

    Parameters
    ----------
    ids : array_like of int
        Vertex indices, or a mask over all vertices.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> saddle = np.stack([u, v, 0.3 * u * v], axis=-1)
    >>> result = gso.tno.optimize(saddle, constraints=[gso.Fixed([0, 8])])
    >>> np.allclose(result.grid[0, [0, 8]], saddle[0, [0, 8]])
    True
    """

    ids: ArrayLike

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        subject.in_space("give a Handle with positions (k, 2)")
        ids = subject.ids(self.ids)
        return [Pins(subject.number, ids, subject.mesh.vertices[ids])]


@dataclass(frozen=True)
class FixedBoundary(Constraint):
    """All boundary vertices, fixed at their positions in the design; not for flat images."""

    def parts(self, subject: Subject) -> list[Part]:
        subject.in_space("give a Handle with positions (k, 2)")
        ids = np.flatnonzero(subject.mesh.half_edges.boundary_vertex)
        return [Pins(subject.number, ids, subject.mesh.vertices[ids])]


@dataclass(frozen=True, eq=False)
class Handle(Constraint):
    """Vertices that move to given positions.

    Parameters
    ----------
    ids : array_like of int, (k,)
        Vertex indices.
    positions : array_like, (k, 3)
        Their target positions, in the unit of the mesh; (k, 2) for a flat image.
    weight : float, optional
        Weight of a soft handle, of the order of 1; the handle is hard when not given.
    """

    ids: ArrayLike
    positions: ArrayLike
    weight: float | None = None

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        ids = subject.ids(self.ids)
        if not len(ids):
            return []
        positions = subject.points(self.positions, f"{len(ids)} positions", len(ids))
        return [Pins(subject.number, ids, positions, subject.weight(self.weight))]
