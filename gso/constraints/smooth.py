"""Curves on the surface that stay smooth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import Part
from gso.energy import Weighted, smooth_curve
from gso.short_repr import short_repr
from gso.typing import Array, Ints


@dataclass(frozen=True, eq=False)
class SmoothCurves(Constraint):
    """Curves through vertices that become smooth, such as seams: a soft constraint.

    It minimises the mean squared second derivative of the curves by arc length, in the unit
    ball. Their ends, where curves meet, are free.

    Parameters
    ----------
    curves : sequence of array_like of int, (k,)
        The vertices along each curve. If the first is also the last, it is closed.
    weight : float
        Weight of the mean.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> panel = np.stack([u, v, 0.3 * u * v], axis=-1)
    >>> rim = gso.SmoothCurves([np.arange(9)])
    >>> gso.tno.optimize(panel, constraints=[rim]).usable
    True
    """

    curves: Sequence[ArrayLike]
    weight: float = 1e-5

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        found = []
        for given in self.curves:
            ids = subject.ids(given)
            if len(ids) < 2 or (np.diff(ids) == 0).any():
                raise subject.refuse(
                    f"has the curve {np.asarray(given).tolist()}; it needs two or more vertices, "
                    "and no vertex twice in a row"
                )
            if ids[0] == ids[-1]:
                ids = np.r_[ids, ids[1]]
            found.append(np.stack([ids[:-2], ids[1:-1], ids[2:]], axis=1))
        triples = np.concatenate([np.empty((0, 3), np.int64), *found])
        points = subject.mesh.vertices[triples]
        if subject.flat:
            points = points[..., :2]
        steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
        far = max(subject.mesh.diagonal, 1e-300)
        return [
            Smooth(
                subject.number, triples, np.maximum(steps, 1e-6 * far), subject.weight(self.weight)
            )
        ]


@dataclass(frozen=True)
class Smooth(Part):
    """Second derivatives at the middle of `triples` (k, 3), with `steps` (k, 2) between them."""

    INDICES = ("triples",)
    ROWS = LENGTHS = ("steps",)

    triples: Ints
    steps: Array
    weight: float | None = None

    def violation(self, points: Array) -> Array:
        """Return the distance of each middle vertex from the chord of its neighbours."""
        a, b, c = points[self.triples].transpose(1, 0, 2)
        before, after = self.steps.T[..., None]
        return np.asarray(np.linalg.norm((after * a + before * c) / (before + after) - b, axis=1))

    @property
    def anchored(self) -> bool:
        return False

    def items(self, block: str) -> list[Weighted]:
        if not len(self.triples):
            return []
        term = smooth_curve.build(self.triples, self.steps, block=block)
        return [Weighted(term, self.weight or 1.0)]
