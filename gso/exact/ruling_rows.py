"""Rows of edges along the rulings of a round face, where its mesh has them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.exact.sliced_pattern import SlicedPattern
from gso.mesh.topology import pair_keys
from gso.pattern import Folded
from gso.recognition import RoundSurface, ShapeFace
from gso.typing import Array, Flags, Ints

#: Difference of levels, relative to their range, up to which they are one.
_SAME = 1e-7
#: Angle in radians between neighbouring rows up to which they serve as bend lines.
_COARSEST = np.radians(15.5)


def levels(surface: RoundSurface, flat: Array) -> Array:
    """Return on which ruling points (..., 2) of the flat image lie.

    For cylinders that is the place along the arc; for cones the polar angle.
    """
    if surface.slope == 0:
        return np.asarray(flat[..., 0])
    z = flat @ np.array([1.0, 1j])
    # From the middle of the face, which does not close around.
    return np.asarray(np.angle(z * np.conj(z.mean())))


def turning(surface: RoundSurface) -> float:
    """Return the angle by which the surface turns over a difference of one in level."""
    return 1.0 / surface.radius if surface.slope == 0 else 1.0 / float(np.tan(surface.half_angle))


@dataclass(frozen=True, eq=False)
class _Rows:
    """Edges along rulings, by the triangles that they belong to.

    Attributes
    ----------
    levels : ndarray, (r,)
        Level of each row, increasing.
    clean : ndarray of bool, (r,)
        Rows that no triangle crosses.
    name : ndarray of int, (e,)
        Row of each edge.
    triangle, corner : ndarray of int, (e,)
        Its triangle in the face, and its first corner.
    """

    levels: Array
    clean: Flags
    name: Ints
    triangle: Ints
    corner: Ints

    @classmethod
    def of(cls, level: Array, near: float) -> _Rows:
        """Find the rows of triangles whose corners have some levels (k, 3), equal within `near`."""
        triangle, corner = np.nonzero(np.abs(np.roll(level, -1, axis=1) - level) < near)
        at = level[triangle, corner]
        order = np.argsort(at, kind="stable")
        group = np.cumsum(np.diff(at[order], prepend=-np.inf) > 2 * near) - 1
        own = np.bincount(group, at[order]) / np.bincount(group)
        name = np.empty(len(at), np.int64)
        name[order] = group
        low, high = np.sort(level.min(axis=1)), np.sort(level.max(axis=1))
        crossing = np.searchsorted(low, own - near) - np.searchsorted(high, own + near)
        return cls(own, crossing == 0, name, triangle, corner)


def ruling_rows(
    sliced: SlicedPattern, face: ShapeFace, flat: Array, count: int, near: float
) -> Folded | None:
    """Bend a round face along rows of its edges, about as many as `count`.

    Vertices within the distance `near` are on one ruling.

    The angle of a row is that from half-way to the row before to half-way to the next.

    Returns
    -------
    Folded or None
        None if too few rulings are rows of edges.
    """
    surface = face.surface
    corners = flat[face.triangles]
    if surface is None:
        return None
    far = np.hypot(corners[..., 0], corners[..., 1])
    if surface.slope > 0 and far.min() < _SAME * far.max():
        # The level of the apex is not defined.
        return None
    level = levels(surface, corners)
    low, high = float(level.min()), float(level.max())
    if surface.slope > 0:
        near = near / float(far.max())
    near = max(near, _SAME * (high - low))
    rows = _Rows.of(level, near)
    near = 2 * near
    inside = np.flatnonzero(rows.clean & (rows.levels > low + near) & (rows.levels < high - near))
    if not len(inside):
        return None
    wanted = np.linspace(low, high, count)[1:-1]
    chosen = inside[np.unique(_nearest(rows.levels[inside], wanted))]
    gaps = np.diff([low, *rows.levels[chosen], high])
    widest = max(2.0 * (high - low) / (count - 1), _COARSEST / turning(surface))
    if gaps.max() > widest + near:
        return None
    own = sliced.faces[face.triangles]
    ahead = (rows.corner + 1) % 3
    edges = np.stack([own[rows.triangle, rows.corner], own[rows.triangle, ahead]], axis=1)
    keys = pair_keys(edges, len(sliced.flat))
    inner = np.isin(keys, sliced.inner())
    weight = np.zeros(len(chosen) + 2)
    weight[:-1] += 0.5 * gaps
    weight[1:] += 0.5 * gaps
    every = [-1, *chosen.tolist(), -1]
    for end, to, at in ((0, 1, low), (-1, -2, high)):
        # A limiting line that is no outline is bent by its own half.
        limit = np.flatnonzero(np.abs(rows.levels - at) <= near)
        if len(limit) and inner[rows.name == limit[0]].any():
            every[end] = int(limit[0])
        else:
            weight[to] += weight[end]
    turn = np.zeros(len(rows.levels))
    turn[[row for row in every if row >= 0]] = weight[[row >= 0 for row in every]]
    used = np.flatnonzero(inner & (turn[rows.name] > 0))
    used = used[np.unique(keys[used], return_index=True)[1]]
    sign = -1.0 if face.bend_lines[0].up else 1.0
    angles = sign * turning(surface) * turn[rows.name[used]]
    middle = 0.5 * (far[rows.triangle, rows.corner] + far[rows.triangle, ahead])[used]
    radii = middle * surface.slope if surface.slope > 0 else np.full(len(used), surface.radius)
    return Folded(edges[used], angles, radii)


def _nearest(found: Array, wanted: Array) -> Ints:
    """Return the place of the nearest of increasing values to each wanted one."""
    after = np.clip(np.searchsorted(found, wanted), 1, max(len(found) - 1, 1))
    after = np.minimum(after, len(found) - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(found[before] - wanted) <= np.abs(found[after] - wanted)
    return np.where(closer, before, after)
