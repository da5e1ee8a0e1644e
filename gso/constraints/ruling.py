"""Straight lines of a surface, such as beams that it rests on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import Part, Straight
from gso.mesh import Polylines
from gso.short_repr import short_repr


@dataclass(frozen=True, eq=False)
class Ruling(Constraint):
    """Vertices that lie on the straight line from the first to the last, such as those on a beam.

    The line goes through the places of both ends in the design. In :func:`gso.strips` it is
    a ruling, or a part of one, also between and beyond the vertices.

    Parameters
    ----------
    ids : array_like of int, (k,)
        Vertex indices, two or more; for strips both ends are enough.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> roof = gso.as_mesh(np.stack([u, v, 0.2 * u * u - 0.05 * v], axis=-1))
    >>> beam = gso.Ruling([5 * 17, 5 * 17 + 16])
    >>> result = gso.strips(roof, constraints=[beam])
    >>> max(result.details["constraints"].values()) < 1e-6
    True
    """

    ids: ArrayLike

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        subject.in_space("take gso.OnCurve with a line in the plane")
        ids = subject.ids(self.ids)
        if len(ids) < 2:
            raise subject.refuse(f"has {len(ids)} vertices; a line needs two or more")
        ends = subject.mesh.vertices[ids[[0, -1]]]
        if not np.linalg.norm(ends[1] - ends[0]) > 1e-9 * subject.mesh.diagonal:
            raise subject.refuse(f"goes from vertex {ids[0]} to {ids[-1]} at the same place")
        return [Straight(subject.number, ids, Polylines.of(ends, closed=False))]
