"""Patches of a smooth surface: B-spline strips, and flat triangles between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gso.geometry.polygon import signed_area
from gso.geometry.vectors import cross, lengths
from gso.ruled.smooth.curves import Curves
from gso.spline import BSplineSurface, TrimmedSpline
from gso.spline.trimmed import Loop
from gso.typing import Array, Ints

#: Spans of a strip's triangles, per span of the spline, in searches for the nearest point.
_FINE = 8
#: Newton steps towards the nearest point.
_STEPS = 4


class Side(NamedTuple):
    """A side of a patch, from `start` to `end` in its parameters, and what it is a part of.

    Patches with sides of one name are neighbours; start and end are the same points for both.
    """

    name: tuple[object, ...]
    start: Array
    end: Array


@dataclass(frozen=True)
class Patch:
    """A part of a smooth surface over a rectangle, or a triangle, of parameters (u, v).

    Attributes
    ----------
    spline : BSplineSurface
        Degree three along the strip (u), and one along the rulings (v). Degree one in both for a
        flat triangle, of which it is the parallelogram.
    sequence, strip : int
        Numbers of the sequence of rulings and of the strip; -1 and 0 for flat triangles.
    domain : ndarray, (3 or 4, 2)
        Corners of the domain, anticlockwise.
    sides : tuple of Side
    faces : tuple of tuple of Loop
        The parts inside the outline, as in :class:`gso.spline.TrimmedSpline`.
    """

    spline: BSplineSurface
    sequence: int
    strip: int
    domain: Array
    sides: tuple[Side, ...]
    faces: tuple[tuple[Loop, ...], ...] = ()

    @property
    def is_flat(self) -> bool:
        """Whether it is a flat triangle."""
        return len(self.domain) == 3

    def points(self, uv: Array) -> Array:
        """Return points (k, 3)."""
        return self.spline.evaluate(uv[:, 0], uv[:, 1])

    def normals(self, uv: Array) -> Array:
        """Return unit normals (k, 3)."""
        return self.spline.normals(uv[:, 0], uv[:, 1])

    def area(self, ring: Array) -> float:
        """Return the area of a small polygon (k, 2), from the derivatives in its middle."""
        u, v = ring.mean(axis=0)
        by = [self.spline.evaluate(u, v, **d) for d in ({"du": 1}, {"dv": 1})]
        return abs(signed_area(ring)) * float(lengths(cross(*by)))

    def nearest(self, points: Array, uv: Array) -> Array:
        """Return the parameters (k, 2) of the nearest points to points (k, 3), near a guess."""
        low, high = self.domain.min(axis=0), self.domain.max(axis=0)
        uv = np.clip(uv, low, high)
        for _ in range(_STEPS):
            u, v = uv.T
            off = points - self.spline.evaluate(u, v)
            by = np.stack([self.spline.evaluate(u, v, du=1), self.spline.evaluate(u, v, dv=1)], 1)
            normal = np.einsum("kid,kjd->kij", by, by)
            normal[:, [0, 1], [0, 1]] += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None] + 1e-30
            right = np.einsum("kid,kd->ki", by, off)
            uv = np.clip(uv + np.linalg.solve(normal, right[:, :, None])[:, :, 0], low, high)
        return uv

    def triangles(self) -> tuple[Array, Ints]:
        """Return parameters (n, 2) and triangles (t, 3) that approximate the patch."""
        if self.is_flat:
            return self.domain, np.array([[0, 1, 2]])
        knots = np.unique(self.spline.knots_u)
        share = np.arange(_FINE) / _FINE
        u = np.r_[(knots[:-1, None] + share * np.diff(knots)[:, None]).ravel(), knots[-1]]
        uv = np.stack([np.repeat(u, 2), np.tile([0.0, 1.0], len(u))], axis=1)
        a = 2 * np.arange(len(u) - 1)
        return uv, np.concatenate(
            [np.stack([a, a + 2, a + 3], axis=1), np.stack([a, a + 3, a + 1], axis=1)]
        )

    def trimmed(self, scale: float, shift: Array) -> TrimmedSpline:
        """Return the parts inside the outline, moved to another frame."""
        return TrimmedSpline(self.spline, self.faces).moved(scale, shift)


def patches(curves: Curves) -> list[Patch]:
    """Return the patches of curves: strips whose derivatives are continuous, flat triangles."""
    out = []
    for k, first, last in curves.pieces():
        rows = slice(first, last + 1)
        ids, knots = curves.index[k][rows], curves.knots[k][rows]
        right, left = curves.right[k][rows], curves.left[k][rows]
        one, two = curves.slopes[right[:-1]], curves.slopes[left[1:]]
        ends, third = curves.points[ids], np.diff(knots)[:, None, None] / 3.0
        inner = np.stack([ends[:-1] + third * one, ends[1:] - third * two], axis=1)
        inner = inner.reshape(-1, *ends.shape[1:])
        net = np.concatenate([ends[:1], inner, ends[-1:]])
        every = np.r_[[knots[0]] * 4, np.repeat(knots[1:-1], 2), [knots[-1]] * 4]
        for j in range(ids.shape[1] - 1):
            spline = BSplineSurface(net[:, j : j + 2], every, np.array([0.0, 0, 1, 1]))
            a, b = float(knots[0]), float(knots[-1])
            domain = np.array([[a, 0.0], [b, 0], [b, 1], [a, 1]])
            sides = [_crease(k, j, domain[[0, 1]]), _crease(k, j + 1, domain[[3, 2]])]
            sides += [
                _ruling(ids[0, j : j + 2], domain[[0, 3]]),
                _ruling(ids[-1, j : j + 2], domain[[1, 2]]),
            ]
            out.append(Patch(spline, k, j, domain, tuple(sides)))
    for flat in curves.flats[:, [0, 1, 3]]:
        p = curves.points[flat]
        net = np.array([[p[0], p[2]], [p[1], p[1] + p[2] - p[0]]])
        domain = np.array([[0.0, 0], [1, 0], [0, 1]])
        pairs = ([0, 1], [1, 2], [2, 0])
        own = tuple(_ruling(flat[pair], domain[pair]) for pair in pairs)
        line = np.array([0.0, 0, 1, 1])
        out.append(Patch(BSplineSurface(net, line, line), -1, 0, domain, own))
    return out


def _crease(sequence: int, column: int, ends: Array) -> Side:
    """Return the side on a curve; its first knot tells it from other parts of the curve."""
    return Side(("curve", sequence, column, float(ends[0, 0])), *ends)


def _ruling(pair: Ints, ends: Array) -> Side:
    """Return the side on a ruling, from the end with the lower number."""
    a, b = pair.tolist()
    return Side(("ruling", min(a, b), max(a, b)), *(ends if a < b else ends[::-1]))


def bends(one: Patch, two: Patch) -> float:
    """Return the largest angle between the tangent planes along common rulings, in radians.

    Measured at the middle of the ruling; zero for patches that share no ruling.
    """
    worst = 0.0
    for a in one.sides:
        for b in two.sides:
            if a.name != b.name or a.name[0] != "ruling":
                continue
            n, m = (p.normals(np.array([0.5 * (s.start + s.end)])) for p, s in ((one, a), (two, b)))
            cosine = np.einsum("kd,kd->k", n, m)
            if one.sequence < 0 or one.sequence != two.sequence:
                # Their parameters may have opposite orientations.
                cosine = np.abs(cosine)
            angle = np.arctan2(lengths(cross(n, m)), cosine)
            worst = max(worst, float(angle[0]))
    return worst
