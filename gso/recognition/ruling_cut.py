"""Refinement of meshes along the ruling at which a face that closes around an axis is opened."""

from __future__ import annotations

import numpy as np

from gso.mesh import topology
from gso.mesh.slicing import subdivided
from gso.recognition.flat_images import Part, continuous, hole_angles, seam_angle, turns
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Ints

#: Angles at which the ruling is tried.
_TRIED = 90


def opening_angle(part: Part, surface: RoundSurface, tolerance: float) -> tuple[float, bool] | None:
    """Choose the ruling at which to open a face, and whether it crosses triangles.

    A row of edges along a ruling that meets no hole, if there is one; else the ruling that meets
    the fewest holes and keeps farthest from vertices. None if the face does not close around the
    axis.
    """
    theta, rho, height = surface.coordinates(part.points)
    angle = continuous(part, theta, rho)
    if not turns(part, angle, rho)[1]:
        return None
    seam = seam_angle(part, theta, rho, height, tolerance)
    if not len(_crossed(part, angle, rho, seam, tolerance)[0]):
        return seam, False
    tried = np.linspace(-np.pi, np.pi, _TRIED, endpoint=False)
    holes = np.zeros(_TRIED)
    for low, high in hole_angles(part, theta, rho):
        holes += np.mod(tried - low, 2 * np.pi) < high - low
    clear = np.zeros(_TRIED)
    for k in np.flatnonzero(holes == holes.min()):
        _, share = _crossed(part, angle, rho, float(tried[k]), tolerance)
        clear[k] = np.minimum(share, 1.0 - share).min() if len(share) else 0.5
    return float(tried[np.argmax(clear)]), True


def _crossed(
    part: Part, angle: Array, rho: Array, seam: float, tolerance: float
) -> tuple[Ints, Array]:
    """Return edges (e, 2) that a ruling crosses, and where, as shares of their angles."""
    off = angle - seam
    off = off - 2 * np.pi * np.round(off.mean(axis=1, keepdims=True) / (2 * np.pi))
    far = rho[part.triangles] > 1e-4 * rho[part.triangles].max()
    aside = np.abs(off) * rho[part.triangles] > 4 * tolerance
    off = np.where(far & aside, off, 0.0)
    ends, shares = [], []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        hit = (off[:, i] * off[:, j] < 0) & (np.abs(off[:, i] - off[:, j]) < np.pi)
        ends.append(part.triangles[hit][:, [i, j]])
        shares.append(off[hit, i] / (off[hit, i] - off[hit, j]))
    edge, share = np.concatenate(ends), np.concatenate(shares)
    turned = edge[:, 0] > edge[:, 1]
    edge[turned], share[turned] = edge[turned][:, ::-1], 1.0 - share[turned]
    keys = topology.pair_keys(edge, len(part.points))
    first = np.unique(keys, return_index=True)[1]
    return edge[first], share[first]


def cut_along(
    part: Part, surface: RoundSurface, seam: float, triangles: Ints, tolerance: float
) -> tuple[Array, Ints, Ints]:
    """Insert vertices where a ruling of a face crosses edges, and divide the triangles there.

    Parameters
    ----------
    part : Part
        The face.
    surface : RoundSurface
    seam : float
        Angle of the ruling around the axis.
    triangles : ndarray of int, (t, 3)
        Of the whole mesh: those of neighbouring faces are divided at the same vertices.
    tolerance : float
        Distance from the ruling up to which a vertex is on it.

    Returns
    -------
    points : ndarray, (n, 3)
        New vertices follow the old ones.
    triangles : ndarray of int, (t2, 3)
    source : ndarray of int, (t2,)
        The triangle that each was a part of.
    """
    theta, rho, height = surface.coordinates(part.points)
    edge, share = _crossed(part, continuous(part, theta, rho), rho, seam, tolerance)
    a, b = edge.T
    if surface.slope:
        # In the plane the edge is straight, and the ruling passes the apex.
        base = surface.radius / surface.slope
        turn = theta[b] - theta[a]
        turn = (turn - 2 * np.pi * np.round(turn / (2 * np.pi))) * np.sin(surface.half_angle)
        p, q = height[a] + base, height[b] + base
        level = q * np.sin((1 - share) * turn) + p * np.sin(share * turn)
        at = p * q * np.sin(turn) / level - base
        # An edge on a circle is an arc.
        at = np.where(np.abs(q - p) <= 2 * tolerance, (height[a] + height[b]) / 2, at)
    else:
        at = height[a] + share * (height[b] - height[a])
    new = surface.point(np.full(len(a), seam), at)
    points = np.concatenate([part.points, new])
    return points, *subdivided(triangles, len(part.points), edge)
