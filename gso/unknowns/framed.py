"""Displacements in normal and tangential directions: three unknowns per vertex."""

from __future__ import annotations

import numpy as np

from gso.typing import Array, Ints
from gso.unknowns.base import Layout, Variables

#: Bound on each of the two tangential components, relative to the bound on the length.
_TANGENTIAL = 0.3
#: The remaining bound on the normal component, so that the box lies in the ball.
ALONG = (1.0 - 2.0 * _TANGENTIAL**2) ** 0.5


def framed_displacements(layout: Layout, points: Array, normals: Array, edges: Ints) -> Variables:
    """Make "surface" vertices = points + (unknowns along the normal and two tangents).

    Coordinates of other blocks are unknowns themselves, after those of the surface. With
    these unknowns, simple bounds keep a vertex in a ball around its point and still allow
    most of the displacement along the normal.

    Parameters
    ----------
    points, normals : ndarray, (n, 3)
        Points at zero displacement, and unit normals.
    edges : ndarray of int, (m, 2)
        Edges between the points, whose directions give the tangents.
    """
    from scipy.sparse import block_diag, csr_matrix, identity

    n = len(points)
    frames = np.stack([normals, *_tangents(points, normals, edges)], axis=2)
    columns = 3 * np.repeat(np.arange(n), 9) + np.tile(np.arange(3), 3 * n)
    turn = csr_matrix((frames.ravel(), columns, 3 * np.arange(3 * n + 1)), shape=(3 * n, 3 * n))
    rest = layout.size - 3 * n
    basis = block_diag([turn, identity(rest)], format="csr") if rest else turn
    return Variables(layout, basis, np.concatenate([points.ravel(), np.zeros(rest)]))


def _tangents(points: Array, normals: Array, edges: Ints) -> tuple[Array, Array]:
    """Return two orthogonal tangents (n, 3) at each point, the cross closest to its edges.

    The square that bounds tangential displacements then turns with the surface.
    """
    # The coordinate axis most orthogonal to the normal gives a tangent to measure angles from.
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    here, there = np.concatenate([edges, edges[:, ::-1]]).T
    along = points[there] - points[here]
    places = [np.einsum("ij,ij->i", along, tangent[here]) for tangent in (first, second)]
    # Fourth powers of directions are equal for the four arms of a cross.
    fourth = np.exp(4j * np.arctan2(places[1], places[0]))
    total = [np.bincount(here, part, len(points)) for part in (fourth.real, fourth.imag)]
    angle = 0.25 * np.arctan2(total[1], total[0])[:, None]
    turned = np.cos(angle) * first + np.sin(angle) * second
    return turned, np.cross(normals, turned)


def ball_bounds(layout: Layout, count: int, reach: float) -> tuple[Array, Array]:
    """Bound :func:`framed_displacements` of `count` vertices by a box within balls.

    Parameters
    ----------
    reach : float
        Radius of the balls around the points at zero displacement.
    """
    along, across = reach * ALONG, reach * _TANGENTIAL
    high = np.full(layout.size, np.inf)
    high[: 3 * count] = np.tile([along, across, across], count)
    return -high, high
