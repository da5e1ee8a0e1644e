"""A dynamic program over chords between points of an outline: sequences and flat triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso.typing import Array, Ints


class Branch(NamedTuple):
    """A sequence of chords that follow each other, as unwrapped numbers of points of the outline.

    Attributes
    ----------
    first, second : ndarray of int, (k,)
        Ends of the chords: `first` never falls, `second` never rises.
    held : tuple of bool
        Whether the first and the last chord are sides of flat triangles; otherwise they are
        between neighbours on the outline.
    """

    first: Ints
    second: Ints
    held: tuple[bool, bool]


def sequences(
    outline: Array, price: Array, normal: Array | None = None, flat: float = 0.0
) -> tuple[list[Branch], Ints]:
    """Find the cheapest sequences of chords that sweep a polygon (n, 2).

    A step moves one end of the chord to the next point of the outline. Its cost is the area of
    the triangle that is swept times the mean price of the two chords. A flat triangle between
    three chords costs its area times (the mean of their prices, plus the variance of their mean
    normals times the square of the longest), plus a constant.

    Parameters
    ----------
    price : ndarray, (n, n)
        Prices of the chords.
    normal : ndarray, (n, n, 3), optional
        Their mean normals. Without these there is one sequence, and no triangle.
    flat : float
        The constant cost of a triangle.

    Returns
    -------
    branches : list of Branch
    triangles : ndarray of int, (g, 3)
        Points of the outline, anticlockwise.
    """
    n = len(outline)
    start = np.arange(n)
    # best[i, k]: least cost of sweeping what the chord (i, i + k) cuts off between these ends.
    # choice: 0 moves the first end, 1 the second, m > 1 is a triangle with the corner i + m.
    best, choice = np.zeros((n, n)), np.zeros((n, n), np.int64)
    for k in range(2, n):
        i, j = start, (start + k) % n
        ahead, back = (i + 1) % n, (j - 1) % n
        costs = [
            best[ahead, k - 1] + _swept(outline, i, ahead, j) * (price[i, j] + price[ahead, j]),
            best[i, k - 1] + _swept(outline, i, back, j) * (price[i, j] + price[i, back]),
        ]
        choice[:, k] = costs[1] < costs[0]
        best[:, k] = np.minimum(*costs)
        if normal is not None and k >= 4:
            m = np.arange(2, k - 1)
            corner = (i[:, None] + m) % n
            cost = best[i[:, None], m] + best[corner, k - m] + flat
            cost += _triangles(outline, price, normal, i[:, None], corner, j[:, None])
            at = cost.argmin(axis=1)
            least = cost[start, at]
            choice[:, k] = np.where(least < best[:, k], m[at], choice[:, k])
            best[:, k] = np.minimum(least, best[:, k])
    lengths = np.arange(1, n)
    whole = best[:, 1:] + best[(start[:, None] + lengths) % n, n - lengths]
    at, more = divmod(int(whole.argmin()), n - 1)
    return _collected(choice, at, at + more + 1)


def _collected(choice: Ints, a: int, b: int) -> tuple[list[Branch], Ints]:
    """Follow the choices to both sides of the chord (a, b)."""
    n = len(choice)
    back, before = _followed(choice, b, a + n)
    ahead, after = _followed(choice, a, b)
    # Both sides are one sequence.
    trunk = [(second - n, first) for first, second in back][::-1] + ahead[1:]
    branches = [_branch(trunk, (before is not None, after is not None))]
    triangles = []
    todo = [corners for corners in (before, after) if corners is not None]
    while todo:
        i, m, j = todo.pop()
        triangles.append((i % n, m % n, j % n))
        for one, other in ((i, m), (m, j)):
            path, corners = _followed(choice, one, other)
            branches.append(_branch(path, (True, corners is not None)))
            if corners is not None:
                todo.append(corners)
    return branches, np.array(triangles, np.int64).reshape(-1, 3)


def _branch(path: list[tuple[int, int]], held: tuple[bool, bool]) -> Branch:
    first, second = np.array(path).T
    return Branch(first, second, held)


def _followed(
    choice: Ints, a: int, b: int
) -> tuple[list[tuple[int, int]], tuple[int, int, int] | None]:
    """Return the chords from (a, b), with b - a < n, to their tip or to a triangle."""
    n, out = len(choice), [(a, b)]
    while b - a > 1:
        taken = int(choice[a % n, b - a])
        if taken > 1:
            return out, (a, a + taken, b)
        a, b = (a, b - 1) if taken else (a + 1, b)
        out.append((a, b))
    return out, None


def _swept(outline: Array, a: Ints, b: Ints, c: Ints) -> Array:
    """Half the area of triangles of the outline's points."""
    u, v = outline[b] - outline[a], outline[c] - outline[a]
    return 0.25 * np.abs(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _triangles(outline: Array, price: Array, normal: Array, a: Ints, b: Ints, c: Ints) -> Array:
    """Return the costs of flat triangles."""
    pairs = ((a, b), (b, c), (a, c))
    mean = sum(price[p, q] for p, q in pairs) / 3.0
    one, two, three = (((outline[p] - outline[q]) ** 2).sum(axis=-1) for p, q in pairs)
    longest = np.maximum(np.maximum(one, two), three)
    own = [normal[p, q] for p, q in pairs]
    middle = sum(own) / 3.0
    varying = sum(((v - middle) ** 2).sum(axis=-1) for v in own) / 3.0
    return np.asarray(2.0 * _swept(outline, a, b, c) * (mean + varying * longest))
