"""Discrete Gaussian curvature by the angle defect."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from gso.geometry import ops
from gso.geometry.vector import cross, dot, norm2, sub
from gso.typing import B, S, Vec


def _wedge(a: Vec[S], b: Vec[S]) -> tuple[S, S]:
    """Return the angle between two edges of a triangle, and its doubled area."""
    twice = ops.sqrt(norm2(cross(a, b)))
    return ops.atan2(twice, dot(a, b)), twice


def _star(centre: Vec[S], ring: Sequence[Vec[S]]) -> tuple[S, S]:
    """Sum the angles and the doubled triangle areas of a closed star."""
    edges = [sub(p, centre) for p in ring]
    pairs = zip(edges, edges[1:] + edges[:1], strict=True)
    (angles, area2), *others = (_wedge(a, b) for a, b in pairs)
    for angle, twice in others:
        angles = angles + angle
        area2 = area2 + twice
    return angles, area2


def _curvature(angles: S, area2: S) -> S:
    """Return the Gaussian curvature of a star from its sums of angles and of doubled areas."""
    return (2.0 * math.pi - angles) / (0.5 * area2)


def star_area(centre: Vec[S], ring: Sequence[Vec[S]]) -> S:
    """Sum the full areas of the triangles of a star (three times the barycentric area)."""
    return 0.5 * _star(centre, ring)[1]


def fan_angle(centre: Vec[S], ring: Sequence[Vec[S]]) -> S:
    """Return the sum of the angles of an open fan of triangles at their common corner, radians.

    Parameters
    ----------
    centre : tuple of 3 numbers
        The corner.
    ring : sequence of tuples of 3 numbers
        The other corners in their order, two or more. One listed twice in a row adds nothing.

    Examples
    --------
    >>> round(float(fan_angle((0., 0., 0.), [(1., 0., 0.), (0., 1., 0.), (0., 0., 1.)])), 6)
    3.141593
    """
    edges = [sub(p, centre) for p in ring]
    total, *others = (_wedge(a, b)[0] for a, b in itertools.pairwise(edges))
    for angle in others:
        total = total + angle
    return total


#: Index offsets (i, j) from a grid vertex to its ring of six neighbours, for both triangulations
#: of the cells: split along (i, j)-(i+1, j+1) as in the published metric, and along the other
#: diagonals.
GRID_RINGS = (
    ((-1, 0), (-1, -1), (0, -1), (1, 0), (1, 1), (0, 1)),
    ((-1, 0), (-1, 1), (0, 1), (1, 0), (1, -1), (0, -1)),
)


def grid_star(points: Vec[B], split: int = 0) -> tuple[Vec[B], list[Vec[B]]]:
    """Return the interior vertices of grids and their rings of six, as component tuples.

    Parameters
    ----------
    points : tuple of 3 arrays, (..., H, W)
        Components of the vertices, NumPy arrays or torch tensors.
    split : {0, 1}
        Triangulation of the cells: an index of :data:`GRID_RINGS`.

    Examples
    --------
    >>> import numpy as np
    >>> centre, ring = grid_star((np.zeros((2, 5, 4)),) * 3)
    >>> centre[0].shape, len(ring)
    ((2, 3, 2), 6)
    """

    def moved(i: int, j: int) -> Vec[B]:
        rows, columns = slice(1 + i, (i - 1) or None), slice(1 + j, (j - 1) or None)
        return tuple(c[..., rows, columns] for c in points)

    return moved(0, 0), [moved(i, j) for i, j in GRID_RINGS[split]]


def gaussian_curvature(centre: Vec[S], ring: Sequence[Vec[S]]) -> S:
    """Return the Gaussian curvature of a vertex star, 1 / length^2.

    ``K = (2 pi - sum of angles) / (sum of full triangle areas)``, the definition behind the
    published figures of GSO-Net (Wang et al. 2024, Eq. 1). With the barycentric area of
    Meyer et al. 2003 it is three times as large.

    Parameters
    ----------
    centre : tuple of 3 numbers
        The vertex.
    ring : sequence of tuples of 3 numbers
        Its neighbours in cyclic order, three or more. A neighbour listed twice in a row
        adds nothing, so rings of different lengths can be padded to one length.

    Examples
    --------
    The apex of an octahedron: defect ``2 pi - 4 pi/3`` over ``4 * sqrt(3)/2``.

    >>> ring = [(1., 0., 0.), (0., 1., 0.), (-1., 0., 0.), (0., -1., 0.)]
    >>> round(float(gaussian_curvature((0., 0., 1.), ring)), 6)
    0.6046
    """
    return _curvature(*_star(centre, ring))


def grid_curvature(points: Vec[B], split: int = 0) -> B:
    """Return :func:`gaussian_curvature` of the interior vertices of grids, 1 / length^2.

    The six triangles of all stars are computed in one batch, because on small grids the time
    goes into the number of array operations.

    Parameters
    ----------
    points : tuple of 3 arrays, (..., H, W)
        Components of the vertices, NumPy arrays or torch tensors.
    split : {0, 1}
        Triangulation of the cells: an index of :data:`GRID_RINGS`.

    Returns
    -------
    array, (..., H-2, W-2)

    Examples
    --------
    >>> import numpy as np
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 4), indexing="ij")
    >>> grid_curvature((u, v, u * v)).shape, bool((grid_curvature((u, v, u * v)) < 0).all())
    ((3, 2), True)
    """
    centre, ring = grid_star(points, split)
    around = tuple(ops.stack([p[k] for p in (*ring, ring[0])]) for k in range(3))
    edges = sub(around, centre)
    angles, twice = _wedge(tuple(e[:-1] for e in edges), tuple(e[1:] for e in edges))
    return _curvature(angles.sum(0), twice.sum(0))
