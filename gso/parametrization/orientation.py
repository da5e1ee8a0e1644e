"""Step limits of the line search that keep iterates away from inverted triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso.geometry import ops, sub
from gso.typing import Array, B, Ints, Vec
from gso.unknowns import Layout

#: Largest step, as a fraction of the step at which a triangle degenerates.
SAFETY = 0.9


@dataclass(frozen=True, eq=False)
class Orientation:
    """A limit on steps so that no triangle of the block "flat" collapses or inverts.

    Attributes
    ----------
    corners : ndarray of int, (3, t)
        Corners of the triangles, anticlockwise where a triangle is not inverted.
    start, count : int
        Place of the block in the coordinate vector, and its number of vertices.
    """

    corners: Ints
    start: int
    count: int

    def __call__(self, coordinates: Array, direction: Array) -> float:
        """Return the largest step, at most 1."""
        part = slice(self.start, self.start + 2 * self.count)
        both = (np.ascontiguousarray(c[part].reshape(-1, 2).T) for c in (coordinates, direction))
        at, along = (list(p.take(self.corners, axis=1).swapaxes(0, 1)) for p in both)
        c, b, a = _areas(at, along)
        # Most triangles change too little to degenerate within a step of one.
        some = (c > 0) & (c <= (np.abs(b) + np.abs(a) / SAFETY) / SAFETY)
        if not some.any():
            return 1.0
        with np.errstate(invalid="ignore"):
            steps = _first_root(c[some], b[some], a[some])
        return float(min(1.0, SAFETY * steps.min()))


def orientation(triangles: Ints, layout: Layout) -> Orientation:
    """Limit steps so that no triangle of the block "flat" collapses or inverts.

    The step is limited to :data:`SAFETY` times that at which the first triangle degenerates.
    Triangles that are inverted already are ignored.

    Parameters
    ----------
    triangles : ndarray of int, (t, 3)
        Corners, anticlockwise where the triangle is not inverted.
    layout : Layout
        Layout of the coordinate vector.
    """
    start, count, _ = layout.where("flat")
    return Orientation(np.ascontiguousarray(triangles.T), start, count)


def degenerate(points: Sequence[Vec[B]], directions: Sequence[Vec[B]]) -> B:
    """Compute the step at which each triangle degenerates; infinity where none does.

    Along a step the signed area of a triangle is quadratic in the step length; this is the
    smallest positive root (Smith and Schaefer 2015, Bijective parameterization with free
    boundaries, section 3.3). It is infinite for triangles that are inverted already.

    Parameters
    ----------
    points, directions : three tuples (x, y) of arrays or tensors
        Corners, and their displacements by a full step.
    """
    return _first_root(*_areas(points, directions))


def _areas(points: Sequence[Vec[B]], directions: Sequence[Vec[B]]) -> tuple[B, B, B]:
    """Return c, b and a of the doubled signed areas ``c + b t + a t^2`` at steps t."""
    e, f, de, df = (sub(corners[k], corners[0]) for corners in (points, directions) for k in (1, 2))
    return _cross(e, f), _cross(e, df) + _cross(de, f), _cross(de, df)


def _first_root(c: B, b: B, a: B) -> B:
    """Return the smallest positive root of ``c + b t + a t^2``, or infinity; so where c <= 0."""
    # 2c / (sqrt(b^2 - 4ac) - b) is the smallest positive root, if there is one.
    steepness = (b * b - 4.0 * a * c) ** 0.5 - b
    falling = ops.minimum(steepness, c) > 0
    return ops.where(falling, 2.0 * c / ops.where(falling, steepness, 1.0), float("inf"))


def _cross(a: Vec[B], b: Vec[B]) -> B:
    return a[0] * b[1] - a[1] * b[0]
