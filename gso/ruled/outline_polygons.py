"""Polygons of a piece whose corners are all on its outline: a dynamic program over chords.

A surface without vertices inside is developable whatever its corners are. The program chooses
triangles, and quads between two chords, along which the design's normal varies little (Rose et al.
2007 choose among triangles only).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.vectors import cross, unit
from gso.ruled.domain import Domain
from gso.ruled.prices import prices
from gso.typing import Array, Ints

#: With n points and a distance d, a chord of length s costs _FAIR d^2 s^2 / n beside its price, and
#: a triangle with three chords _FAIR _BRANCH d^2 s^2 / n with the longest of all chords.
_FAIR, _BRANCH = 0.01, 100.0


def outline_polygons(domain: Domain, corners: Ints, points: Array, near: float) -> list[Ints]:
    """Divide a piece into triangles and quads with corners on its outline.

    Parameters
    ----------
    domain : Domain
        The piece over its flat image.
    corners : ndarray of int, (n,)
        Vertices of the outline, anticlockwise in the flat image.
    points : ndarray, (n, 3)
        Where they are.
    near : float
        Distance from the design that is allowed: the larger it is, the more short chords are
        preferred to those along which normals vary less.

    Returns
    -------
    list of ndarray of int
        Positions in `corners`, anticlockwise; empty if there is no way to divide the piece.
    """
    if len(corners) < 3:
        return []
    costs = _Costs.of(domain, domain.flat[corners], points, near)
    return costs.cheapest()


@dataclass(frozen=True)
class _Costs:
    """What polygons between points of an outline cost.

    Attributes
    ----------
    flat : ndarray, (n, 2)
    points : ndarray, (n, 3)
    price : ndarray, (n, n)
        Prices of chords; zero for sides of the outline.
    normal : ndarray, (n, n, 3)
        Mean normals of the design along chords.
    square : ndarray, (n, n)
        Their squared lengths.
    length : ndarray, (n, n)
        Their costs by length.
    branch : float
        Cost of a triangle with three chords.
    """

    flat: Array
    points: Array
    price: Array
    normal: Array
    square: Array
    length: Array
    branch: float

    @classmethod
    def of(cls, domain: Domain, flat: Array, points: Array, near: float) -> _Costs:
        """Measure the chords of an outline."""
        price, normal = prices(domain, flat, slots=False)
        n = len(flat)
        away = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        side = np.minimum(away, n - away)
        square = ((flat[:, None] - flat) ** 2).sum(axis=2)
        price[side < 2] = 0.0
        fair = _FAIR * near**2
        length = fair / n * np.where(side > 1, square, 0.0)
        branch = fair * _BRANCH * float(square.max()) / n
        return cls(flat, points, price, normal, square, length, branch)

    def cheapest(self) -> list[Ints]:
        """Return the polygons of least total cost."""
        n = len(self.flat)
        start = np.arange(n)
        # best[i, k]: least cost of what the chord (i, i + k) cuts off between its ends; choice: the
        # corner i + m of a triangle, or 0 for a quad with the chord (i + 1, i + k - 1).
        best = np.full((n, n), np.inf)
        best[:, :2] = 0.0
        choice = np.zeros((n, n), np.int64)
        for k in range(2, n):
            i, j = start, (start + k) % n
            m = np.arange(1, k)
            corner = (i[:, None] + m) % n
            cost = best[i[:, None], m] + best[corner, k - m]
            row, at = np.nonzero(np.isfinite(cost))
            own = self._triangles(i[row], corner[row, at], j[row])
            three = (m[at] > 1) & (m[at] < k - 1) & (k < n - 1)
            cost[row, at] += own + np.where(three, self.branch, 0.0)
            at = cost.argmin(axis=1)
            best[:, k], choice[:, k] = cost[start, at], m[at]
            if k > 2:
                inner, outer = (i + 1) % n, (j - 1) % n
                four = best[inner, k - 2] + self._quads(i, inner, outer, j)
                lower = four < best[:, k]
                best[lower, k], choice[lower, k] = four[lower], 0
            best[:, k] += self.length[i, j]
        whole = best[:, n - 1]
        if not np.isfinite(whole).any():
            return []
        return self._collected(choice, int(whole.argmin()))

    def _collected(self, choice: Ints, first: int) -> list[Ints]:
        n, out = len(self.flat), []
        todo = [(first, n - 1)]
        while todo:
            i, k = todo.pop()
            if k < 2:
                continue
            m = int(choice[i, k])
            if m:
                out.append(np.array([i, i + m, i + k]) % n)
                todo += [(i, m), ((i + m) % n, k - m)]
            else:
                out.append(np.array([i, i + 1, i + k - 1, i + k]) % n)
                todo.append(((i + 1) % n, k - 2))
        return out

    def _triangles(self, a: Ints, b: Ints, c: Ints) -> Array:
        pairs = ((a, b), (b, c), (a, c))
        price = sum(self.price[p, q] for p, q in pairs) / 3.0
        normals = [self.normal[p, q] for p, q in pairs]
        longest = np.maximum.reduce([self.square[p, q] for p, q in pairs])
        area = self._area(a, b, c)
        off = self._off(normals, [(a, b, c)])
        return np.asarray(np.where(area > 0, area * (price + off * longest), np.inf))

    def _quads(self, a: Ints, b: Ints, c: Ints, d: Ints) -> Array:
        price = 0.5 * (self.price[a, d] + self.price[b, c])
        normals = [self.normal[a, d], self.normal[b, c]]
        longest = np.maximum(self.square[a, c], self.square[b, d])
        ways = [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
        areas = [self._area(*way) for way in ways]
        # Across a triangle of a cylinder normals turn by about a third of that.
        off = self._off(normals, ways, 1.0 / 3.0)
        area = areas[0] + areas[1]
        convex = np.min(areas, axis=0) > 0.05 * area
        return np.asarray(np.where(convex, area * (price + off * longest), np.inf))

    def _area(self, a: Ints, b: Ints, c: Ints) -> Array:
        u, v = self.flat[b] - self.flat[a], self.flat[c] - self.flat[a]
        return np.asarray(0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))

    def _off(
        self, normals: list[Array], triangles: list[tuple[Ints, Ints, Ints]], share: float = 1.0
    ) -> Array:
        """Return a share of how much normals vary, and how much they differ from triangles'."""
        mean = unit(np.sum(normals, axis=0))
        varying = sum(((v - mean) ** 2).sum(axis=1) for v in normals) / len(normals)
        p = self.points
        own = [unit(cross(p[b] - p[a], p[c] - p[a])) for a, b, c in triangles]
        return np.asarray(
            share * varying + sum(((v - mean) ** 2).sum(axis=1) for v in own) / len(own)
        )
