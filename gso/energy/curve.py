"""Vertices that slide along polylines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gso.energy.base import Term
from gso.geometry import dot, sub
from gso.mesh import Polylines
from gso.typing import Array, Ints, S, Vec

#: The curve does not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the vector from a target to the point, without its part along a unit direction.

    Constants: the target; then the direction, or zero where the vertex cannot slide.
    """
    dim = len(points[0])
    away = sub(points[0], tuple(constants[:dim]))
    tangent = tuple(constants[dim:])
    along = dot(away, tangent)
    return tuple(a - along * t for a, t in zip(away, tangent, strict=True))


def build(
    ids: Ints, lines: Polylines, *, block: str = "surface", weight: float | None = None
) -> Term:
    """Build the constraint of vertices (k,) to polylines: soft with a weight, otherwise hard.

    The nearest point is recomputed before every linearisation, as in iterated closest points,
    and the vertex is free to move along the tangent there. Tangents are interpolated along the
    segments: with one tangent per segment, vertices would oscillate at joints. At an end of an
    open line, or at a corner, a vertex can only slide back.
    """
    dim = lines.start.shape[1]
    sliding = _Sliding(block, ids, lines)
    term = Term(
        "curve",
        residual,
        ((block, ids[:, None]),),
        weights=np.full(len(ids), 1.0 if weight is None else weight),
        constants=np.zeros((2 * dim, len(ids))),
        refresh=sliding.constants,
    )
    return replace(term, multipliers=sliding) if weight is None else term


class _Sliding:
    """Targets and directions of vertices on polylines, and their multipliers."""

    def __init__(self, block: str, ids: Ints, lines: Polylines):
        self.block, self.ids, self.lines = block, ids, lines
        #: Multipliers over the weight, (k, dim): see :mod:`gso.energy.multipliers`.
        self.shift = np.zeros((len(ids), lines.start.shape[1]))

    def constants(self, blocks: Mapping[str, Array]) -> Array:
        """Return the targets and directions from the current nearest points."""
        target, tangent = self._targets(blocks[self.block][self.ids])
        shift = self.shift - (self.shift * tangent).sum(axis=1, keepdims=True) * tangent
        return np.concatenate([(target - shift).T, tangent.T])

    def update(self, blocks: Mapping[str, Array]) -> float:
        """Update the multipliers; return the largest distance from the lines."""
        points = blocks[self.block][self.ids]
        value = np.stack(residual([tuple(points.T)], list(self.constants(blocks))), axis=1)
        left = np.linalg.norm(points - self.lines.nearest(points).points, axis=1)
        self.shift = value
        return float(left.max(initial=0.0))

    def scale(self, factor: float) -> None:
        """Rescale the multipliers when the weights of all other terms are scaled."""
        self.shift = factor * self.shift

    def _targets(self, points: Array) -> tuple[Array, Array]:
        """Find the nearest points, and the directions of free sliding there, (k, dim) each."""
        lines = self.lines
        target, segment, along = lines.nearest(points)
        way = lines.way[segment]
        tangent = lines.directions(segment, along)
        for end, ends, out in ((0, lines.start, -way), (1, lines.end, way)):
            # The end is an active constraint where the vertex, shifted by its multiplier, is
            # beyond it.
            beyond = ((points - ends[segment] + self.shift) * out).sum(axis=1) > 0
            held = lines.stop[segment, end] & beyond
            target = np.where(held[:, None], ends[segment], target)
            tangent = np.where(held[:, None], 0.0, tangent)
        return target, tangent
