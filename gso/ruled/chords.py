"""The first rulings: chords of the flat image along which the normal of the design varies little.

A dynamic program over all chords between points of the outline finds the sequence of chords that
sweeps the flat image at the least price.
"""

from __future__ import annotations

import numpy as np

from gso.ruled.domain import Domain
from gso.typing import Array, Ints

#: Points on the outline, and samples along a chord.
_COUNT, _SAMPLES = 96, 9
#: Steps of the sequence over which ends are averaged, and how far they are moved towards equal
#: spacing, so that rulings do not meet in one point.
_WINDOW, _EVEN = 9, 0.2
#: Part of the sequence that is left out at each tip, where chords are very short.
_TIP = 0.02
#: Turning angles of sharp corners, and the largest for which offsets are lengthened.
_SHARP, _MITRE = 0.5, 2.0


def chords(domain: Domain, count: int) -> tuple[Array, Array]:
    """Return the ends (count, 2) of chords of low price, beyond the outline by the margin.

    Chords follow each other across the flat image.

    Parameters
    ----------
    domain : Domain
        The design over its flat image.
    count : int
        Number of chords.
    """
    outline, normals = resampled(domain.flat[domain.outline], _COUNT)
    first, second = sequence(outline, prices(domain, outline))
    beyond = outline + domain.margin * normals
    at = np.linspace(_TIP, 1.0 - _TIP, count)
    one, other = (np.interp(at, np.linspace(0.0, 1.0, len(x)), _even(x)) for x in (first, second))
    return _on(beyond, one), _on(beyond, other)


def _even(ends: Ints) -> Array:
    """Smooth the ends of a sequence along the outline."""
    window = np.ones(_WINDOW) / _WINDOW
    smooth = ends.astype(float)
    for _ in range(2):
        smooth = np.convolve(np.pad(smooth, _WINDOW // 2, mode="edge"), window, mode="valid")
    return (1.0 - _EVEN) * smooth + _EVEN * np.linspace(smooth[0], smooth[-1], len(smooth))


def _on(loop: Array, at: Array) -> Array:
    """Interpolate a closed polygon (n, 2) at numbers of its points, modulo n."""
    n = len(loop)
    return np.stack([np.interp(at % n, np.arange(n + 1), np.append(c, c[0])) for c in loop.T], 1)


def resampled(loop: Array, count: int) -> tuple[Array, Array]:
    """Return points along a closed polygon (k, 2), and outward offsets of distance one.

    The points are at equal distances, but the nearest ones are moved to the sharp corners. There
    the offset is longer, so that the offset polygon has corners too.
    """
    closed = np.vstack([loop, loop[:1]])
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))]
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    turn = _turning(loop)
    for k in np.argsort(turn):
        if turn[k] > _SHARP:
            gap = np.abs(at - along[k])
            at[np.minimum(gap, along[-1] - gap).argmin()] = along[k]
    at = np.sort(at)
    points = np.stack([np.interp(at, along, c) for c in closed.T], axis=1)
    way = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    normals = np.stack([way[:, 1], -way[:, 0]], axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    mitre = 1.0 / np.cos(0.5 * np.clip(_turning(points), 0.0, _MITRE))
    return points, normals * mitre[:, None]


def _turning(loop: Array) -> Array:
    """Return the angles (n,) by which a closed polygon (n, 2) turns left at its corners."""
    way = np.roll(loop, -1, axis=0) - loop
    back = np.roll(way, 1, axis=0)
    cross = back[:, 0] * way[:, 1] - back[:, 1] * way[:, 0]
    return np.arctan2(cross, (back * way).sum(axis=1))


def prices(domain: Domain, outline: Array) -> Array:
    """Return the price (n, n) of the chords between points (n, 2) of the outline.

    It is the variance of the design's normal along the chord times the squared length of the
    chord, plus that square times the share of the chord outside the flat image.
    """
    n = len(outline)
    first, second = np.triu_indices(n, 1)
    t = ((np.arange(_SAMPLES) + 0.5) / _SAMPLES)[:, None]
    places = (outline[first, None] * (1.0 - t) + outline[second, None] * t).reshape(-1, 2)
    normals, feet = domain.sample(domain.normals, places)
    normals = normals.reshape(len(first), _SAMPLES, 3)
    varying = ((normals - normals.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
    gap = np.linalg.norm(feet - places, axis=1).reshape(len(first), _SAMPLES)
    outside = (gap > 1e-6 * domain.margin).mean(axis=1)
    out = np.zeros((n, n))
    out[first, second] = (varying + outside) * ((outline[first] - outline[second]) ** 2).sum(axis=1)
    return out + out.T


def sequence(outline: Array, price: Array) -> tuple[Ints, Ints]:
    """Find the cheapest sequence of chords that sweeps a polygon (n, 2).

    A step moves one end of the chord to the next point of the outline. Its cost is the area of
    the triangle that is swept times the mean price of the two chords. The sequence begins and
    ends with chords between neighbours.

    Returns
    -------
    first, second : ndarray of int, (n - 1,)
        Ends of the chords, as unwrapped indices: `first` never falls, `second` never rises.
    """
    n = len(outline)
    start = np.arange(n)
    # best[i, k]: least cost of sweeping what the chord (i, i + k) cuts off between these ends.
    best, choice = np.zeros((n, n)), np.zeros((n, n), bool)
    for k in range(2, n):
        i, j = start, (start + k) % n
        ahead, back = (i + 1) % n, (j - 1) % n
        costs = [
            best[ahead, k - 1] + _swept(outline, i, ahead, j) * (price[i, j] + price[ahead, j]),
            best[i, k - 1] + _swept(outline, i, back, j) * (price[i, j] + price[i, back]),
        ]
        choice[:, k] = costs[1] < costs[0]
        best[:, k] = np.minimum(*costs)
    lengths = np.arange(1, n)
    whole = best[:, 1:] + best[(start[:, None] + lengths) % n, n - lengths]
    at, more = divmod(int(whole.argmin()), n - 1)
    to = at + more + 1
    before = [(b - n, a) for a, b in _backtracked(choice, to, at + n)]
    first, second = np.array(before[::-1] + _backtracked(choice, at, to)[1:]).T
    return first, second


def _swept(outline: Array, a: Ints, b: Ints, c: Ints) -> Array:
    """Half the area of triangles of the outline's points."""
    u, v = outline[b] - outline[a], outline[c] - outline[a]
    return 0.25 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _backtracked(choice: Array, a: int, b: int) -> list[tuple[int, int]]:
    """Return the chords from (a, b), with b - a < n, to their tip."""
    n, out = len(choice), [(a, b)]
    while b - a > 1:
        a, b = (a, b - 1) if choice[a % n, b - a] else (a + 1, b)
        out.append((a, b))
    return out
