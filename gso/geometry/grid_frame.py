"""Frames at the vertices of grids: derivatives, unit tangents and unit normals.

Points are component tuples; a component is a batch of grids (..., H, W), of NumPy or PyTorch.
"""

from __future__ import annotations

from operator import add
from typing import TYPE_CHECKING, Generic, NamedTuple

from gso.geometry import ops
from gso.geometry.vector import cross, norm, sub
from gso.typing import B, Vec

if TYPE_CHECKING:
    from types import EllipsisType

#: Lower bound on lengths in denominators, far below the lengths of grids in the unit ball.
_SHORTEST = 1e-12


def unit(v: Vec[B]) -> Vec[B]:
    """Normalise vectors to unit length; zero vectors stay zero."""
    scale = 1.0 / ops.maximum(norm(v), _SHORTEST)
    return tuple(c * scale for c in v)


def grid_slope(x: B, axis: int) -> B:
    """Compute the derivative of values (..., H, W) along a grid direction over [0, 1].

    Differences are central, and one-sided at the ends.

    Parameters
    ----------
    x : array or tensor, (..., H, W)
    axis : {-2, -1}
        The direction.

    Examples
    --------
    >>> import numpy as np
    >>> grid_slope(np.array([[0.0, 1.0, 4.0]]), -1)
    array([[2., 4., 6.]])
    """
    spacing = 1.0 / (x.shape[axis] - 1)
    low, high = _along(axis, None, -2), _along(axis, 2, None)
    middle = (x[high] - x[low]) / (2.0 * spacing)
    first = (x[_along(axis, 1, 2)] - x[_along(axis, 0, 1)]) / spacing
    last = (x[_along(axis, -1, None)] - x[_along(axis, -2, -1)]) / spacing
    return ops.concatenate([first, middle, last], axis)


def _along(axis: int, start: int | None, stop: int | None) -> tuple[slice | EllipsisType, ...]:
    """Return the index of a slice along one of the last two axes."""
    part = slice(start, stop)
    return (..., part, slice(None)) if axis == -2 else (..., part)


def cell_corners(p: Vec[B]) -> tuple[Vec[B], Vec[B], Vec[B], Vec[B]]:
    """Return the corners (i, j), (i+1, j), (i+1, j+1), (i, j+1) of all cells of grids."""
    low, high = slice(None, -1), slice(1, None)
    where = ((low, low), (high, low), (high, high), (low, high))
    v0, v1, v2, v3 = (tuple(c[..., i, j] for c in p) for i, j in where)
    return v0, v1, v2, v3


def at_vertices(corners: list[Vec[B]]) -> Vec[B]:
    """Sum, at each vertex of grids, the values at the four corners of the cells around it.

    Parameters
    ----------
    corners : list of 4
        Component tuples (..., H-1, W-1), in the order of :func:`cell_corners`.
    """
    sides = ((0, 1, 0, 1), (1, 0, 0, 1), (1, 0, 1, 0), (0, 1, 1, 0))
    placed = [
        [ops.padded(c, *side) for c in corner] for corner, side in zip(corners, sides, strict=True)
    ]
    return tuple(a + b + c + d for a, b, c, d in zip(*placed, strict=True))


def split_normals(p: Vec[B]) -> Vec[B]:
    """Compute unit vertex normals of grids by the triangulation of Wang et al. 2024."""
    v0, v1, v2, v3 = cell_corners(p)
    diagonal = sub(v2, v0)
    lower = cross(sub(v1, v0), diagonal)
    upper = cross(diagonal, sub(v3, v0))
    whole = tuple(map(add, lower, upper))
    return unit(at_vertices([whole, lower, whole, upper]))


class GridFrame(NamedTuple, Generic[B]):
    """Derivatives of grids by their parameters in [0, 1]^2, and unit vectors at the vertices.

    `along` and `across` are the unit tangents of the grid lines and `normal` is the unit
    normal. They rotate with the surface, so that components along them are pose-invariant.
    """

    du: Vec[B]
    dv: Vec[B]
    along: Vec[B]
    across: Vec[B]
    normal: Vec[B]

    @classmethod
    def of(cls, p: Vec[B]) -> GridFrame[B]:
        """Compute the frame of grids."""
        du, dv = (tuple(grid_slope(c, axis) for c in p) for axis in (-2, -1))
        return cls(du, dv, unit(du), unit(dv), split_normals(p))

    def vectors(self, normal: B, along: B, across: B) -> Vec[B]:
        """Compute vectors from components along `normal`, `along` and `across`."""
        axes = zip(self.normal, self.along, self.across, strict=True)
        return tuple(normal * x + along * y + across * z for x, y, z in axes)
