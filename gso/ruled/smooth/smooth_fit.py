"""The solve for smooth strips: the tangent plane becomes constant along every ruling."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gso.energy import Weighted, mean_weights
from gso.energy.position import build as position
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest
from gso.ruled.smooth.curves import Curves
from gso.ruled.smooth.smooth_terms import Terms
from gso.ruled.untrimmed import Untrimmed
from gso.solver import Problem, minimise
from gso.typing import Array, Ints
from gso.unknowns import Layout, Variables

#: Weights of the terms; that of the turning of normals rises.
_DISTANCE, _MOVED, _BEND, _JUMP, _BOUNDS = 30.0, 30.0, 0.1, 0.01, 10.0
_TURNS = (0.0, 1e-3, 1e-1, 1e1, 1e3, 1e4)
#: Number of the weights that are used again after spans were halved, and of times that they are.
_AGAIN, _ROUNDS = 2, 4
#: Iterations for each weight, and the relative decrease of the energy at which they end.
_ITERATIONS, _TOLERANCE = 40, 1e-6
#: Turning of the normal along a ruling, in radians, above which a span is halved.
_TORSAL = np.radians(0.05)
#: Rulings of a span where the turning is measured.
_MEASURED = 17


class Smooth(NamedTuple):
    """Smooth curves, and the part of each span's rulings that is inside the outline."""

    curves: Curves
    ranges: Array


class Fitter:
    """Fits smooth strips to strips of planar faces; lengths are relative to the diagonal.

    Parameters
    ----------
    source : Untrimmed
        The strips, from a surface whose diagonal is one.
    design : Mesh, optional
        The surface that distances are minimised from; the planar faces when not given.
    """

    def __init__(self, source: Untrimmed, design: Mesh | None = None):
        self.source = source
        vertices = source.vertices
        if design is None:
            corner, triangles = vertices, source.strips.divided(vertices)[0]
        else:
            corner, triangles = design.vertices, design.triangles
        self._near = Nearest.of(corner, triangles)
        a, b, c = corner[triangles].transpose(1, 0, 2)
        self._normals = unit(cross(b - a, c - a))
        sides = np.diff(vertices[source.strips.sides], axis=1)[:, 0]
        self._width = float(lengths(sides).mean())

    def first(self, corners: Array, owner: Ints) -> Smooth:
        """Fit the strips.

        Parameters
        ----------
        corners, owner : ndarray, (k, 3), (k,)
            Corners of the faces inside the outline, and the faces of the strips they are on.
        """
        curves = Curves.of(self.source.strips, self.source.vertices)
        ranges = _inside(self.source, corners, owner)[: len(curves.spans.row)]
        return self.divided(Smooth(self._solved(curves, ranges, _TURNS), ranges))

    def divided(self, found: Smooth) -> Smooth:
        """Halve spans where normals turn along rulings, and fit again, until they do not."""
        curves, ranges = found
        bad = turning(curves, ranges) > _TORSAL
        for _ in range(_ROUNDS):
            if not bad.any():
                break
            start, parent = curves.split(bad)
            halves = ranges[parent]
            tried = self._solved(start, halves, _TURNS[-_AGAIN:])
            still = turning(tried, halves) > _TORSAL
            if still.sum() > bad.sum():
                break
            curves, ranges, bad = tried, halves, still
        return Smooth(curves, ranges)

    def _nearest(self, points: Array) -> tuple[Array, Array]:
        which, _, feet = self._near.locate(points)
        return feet, self._normals[which]

    def _solved(self, curves: Curves, ranges: Array, weights: Sequence[float]) -> Curves:
        """Minimise the energy, for one weight of the turning after the other."""
        terms = Terms(curves, ranges, self._width)
        start, count = curves.unknowns, len(curves.points)
        variables = _without_last(Layout.of(len(start), "surface"))
        moved = position(np.arange(count), curves.points, mean_weights(count))
        rest = [
            Weighted(moved, _MOVED),
            Weighted(terms.bend(), _BEND),
            Weighted(terms.jump(), _JUMP),
            Weighted(terms.length(), _BOUNDS),
            Weighted(terms.distance(self._nearest), _DISTANCE),
        ]
        torsal = [t for t in (terms.turn(), terms.breaks(), terms.joined()) if t is not None]
        speed = terms.speed()
        x = start.ravel()[: variables.size]
        for weight in weights:
            items = [*rest, Weighted(speed, max(_BOUNDS, _BOUNDS * weight))]
            items += [Weighted(t, weight) for t in torsal if weight]
            x = minimise(
                Problem(items, variables),
                x,
                iterations=_ITERATIONS,
                tolerance=_TOLERANCE,
                method="levenberg-marquardt",
            ).x
        return curves.moved(variables.points(x).reshape(-1, 3))


def turning(curves: Curves, ranges: Array) -> Array:
    """Return the largest angle (e,) in each span between the normals at two places of a ruling."""
    worst = np.zeros(len(ranges))
    for s in np.linspace(0.0, 1.0, _MEASURED):
        p, q, dp, dq = curves.both(s)
        one, two = (unit(cross((1 - v[:, None]) * dp + v[:, None] * dq, q - p)) for v in ranges.T)
        angle = np.arctan2(lengths(cross(one, two)), np.einsum("ed,ed->e", one, two))
        # At the end of a span beside a point where curves stay, there may be no normal.
        none = (lengths(one) < 0.5) | (lengths(two) < 0.5)
        worst = np.maximum(worst, np.where(none, 0.0, angle))
    return worst


def _without_last(layout: Layout) -> Variables:
    """Return unknowns for all coordinates but those of the last row, which are zero."""
    from scipy.sparse import eye

    basis = eye(layout.size, layout.size - 3, format="csr")
    return Variables(layout, basis, np.zeros(layout.size))


def _inside(source: Untrimmed, corners: Array, owner: Ints) -> Array:
    """Return, for each face, the part of its rulings that is inside the outline, from 0 to 1."""
    place = _places(source.vertices[source.strips.corners[owner]], corners)
    count = len(source.strips.corners)
    low, high = np.full(count, 1.0), np.zeros(count)
    np.minimum.at(low, owner, place)
    np.maximum.at(high, owner, place)
    outside = low > high
    low[outside] = high[outside] = 0.5
    return np.stack([low, high], axis=1)


def _places(quads: Array, points: Array) -> Array:
    """Return the places (k,), 0 to 1, of points (k, 3) on the rulings of planar quads (k, 4, 3).

    A ruling goes from (1 - s) a + s c to (1 - s) b + s d. The point is on it if the area of the
    triangle with both ends is zero, which is a quadratic equation in s.
    """
    a, b, c, d = quads.transpose(1, 0, 2)
    normal = unit(cross(d - a, b - c))

    def area(s: float) -> Array:
        p, q = (1 - s) * a + s * c, (1 - s) * b + s * d
        return np.asarray(np.einsum("kd,kd->k", normal, cross(q - p, points - p)))

    zero, half, one = area(0.0), area(0.5), area(1.0)
    square = 2.0 * (zero + one) - 4.0 * half
    linear = one - zero - square
    root = np.sqrt(np.maximum(linear**2 - 4.0 * square * zero, 0.0))
    lower = -0.5 * (linear + np.where(linear < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.nan_to_num(np.stack([lower / square, zero / lower]), nan=0.0, posinf=9, neginf=9)
    s = np.clip(both[np.abs(both - 0.5).argmin(axis=0), np.arange(len(zero))], 0, 1)[:, None]
    p, way = (1 - s) * a + s * c, (1 - s) * (b - a) + s * (d - c)
    size = np.maximum(np.einsum("kd,kd->k", way, way), 1e-300)
    place: Array = np.einsum("kd,kd->k", points - p, way) / size
    return np.clip(place, 0.0, 1.0)
