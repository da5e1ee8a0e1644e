"""The first rulings: chords of the flat image along which the normal of the design varies little.

A dynamic program over all chords between points of the outline finds the sequence of chords that
sweeps the flat image at the least price.
"""

from __future__ import annotations

import numpy as np

from gso.ruled.domain import Domain
from gso.ruled.polygon import resampled
from gso.typing import Array, Ints

#: Points on the outline, and samples along a chord.
_COUNT, _SAMPLES = 96, 9
#: Steps of the sequence over which ends are averaged, and how far they are moved towards equal
#: spacing, so that rulings do not meet in one point.
_WINDOW, _EVEN = 9, 0.2
#: Part of the sequence that is left out at each tip, where chords are very short.
_TIP = 0.02
#: Largest turns of chords, in points of the outline, one round after the other; number of turns
#: that are tried in each; weight of the changes of the turn, relative to the mean price.
_TURNS, _CHOICES, _STEADY = (6.0, 1.5, 0.4), 13, 0.05
#: Least distance of ends on the offset polygon, relative to their mean distance, and the largest
#: number of points by which they move for the sake of a straight continuation.
_APART, _FAR = 0.2, 8.0


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
    for reach in _TURNS:
        one, other = turned(domain, outline, one, other, reach)
    one, other = _continued(outline, beyond, one, other)
    return _on(beyond, one), _on(beyond, other)


def _continued(outline: Array, beyond: Array, one: Array, other: Array) -> tuple[Array, Array]:
    """Continue chords as straight lines to an offset polygon, where they do not cross there.

    Returns
    -------
    one, other : ndarray, (k,)
        The ends as numbers of points of the offset polygon.
    """
    n, wide = len(outline), _APART * (one[-1] - one[0]) / len(one)
    ends = _on(outline, one), _on(outline, other)
    found = []
    for at, start, stop, sign in ((one, *ends[::-1], 1.0), (other, *ends, -1.0)):
        way = stop - start
        off = beyond - start[:, None]
        side = way[:, :1] * off[:, :, 1] - way[:, 1:] * off[:, :, 0]
        along = np.einsum("kd,knd->kn", way, off) / (way**2).sum(axis=1)[:, None]
        after, ahead = np.roll(side, -1, axis=1), np.roll(along, -1, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = side / (side - after)
        share = np.where((side > 0) != (after > 0), share, 0.0)
        there = np.where((side > 0) != (after > 0), along + share * (ahead - along), np.inf)
        there[there < 1.0] = np.inf
        k = there.argmin(axis=1)
        row = np.arange(len(k))
        move = (k + share[row, k] - at + 0.5 * n) % n - 0.5 * n
        move[~np.isfinite(there[row, k]) | (np.abs(move) > _FAR)] = 0.0
        rising = sign * (at + move)
        steps = wide * np.arange(len(k))
        # Both running extrema keep the order; their mean shares out what is moved.
        low = np.maximum.accumulate(rising - steps) + steps
        high = np.minimum.accumulate((rising - steps)[::-1])[::-1] + steps
        found.append(sign * 0.5 * (low + high))
    return found[0], found[1]


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


def prices(domain: Domain, outline: Array) -> Array:
    """Return the price (n, n) of the chords between points (n, 2) of the outline.

    It is the variance of the design's normal along the chord times the squared length of the
    chord, plus that square times the share of the chord outside the flat image.
    """
    n = len(outline)
    first, second = np.triu_indices(n, 1)
    out = np.zeros((n, n))
    out[first, second] = _price(domain, outline[first], outline[second])
    return out + out.T


def _price(domain: Domain, one: Array, other: Array) -> Array:
    """Return the price (k,) of chords with ends (k, 2), (k, 2)."""
    t = ((np.arange(_SAMPLES) + 0.5) / _SAMPLES)[:, None]
    places = (one[:, None] * (1.0 - t) + other[:, None] * t).reshape(-1, 2)
    normals, feet = domain.sample(domain.normals, places)
    normals = normals.reshape(len(one), _SAMPLES, 3)
    varying = ((normals - normals.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
    gap = np.linalg.norm(feet - places, axis=1).reshape(len(one), _SAMPLES)
    outside = (gap > 1e-6 * domain.margin).mean(axis=1)
    return np.asarray((varying + outside) * ((one - other) ** 2).sum(axis=1))


def turned(
    domain: Domain, outline: Array, one: Array, other: Array, reach: float
) -> tuple[Array, Array]:
    """Turn successive chords so that their prices fall; they do not cross.

    Both ends move by the same number of points along the outline, at most by `reach`.

    Parameters
    ----------
    one, other : ndarray, (k,)
        Ends of the chords, as numbers of points of the outline: `one` rises, `other` falls.
    """
    move = reach * np.linspace(-1.0, 1.0, _CHOICES)
    first, second = one[:, None] + move, other[:, None] + move
    ends = (_on(outline, x.ravel()) for x in (first, second))
    price = _price(domain, *ends).reshape(first.shape)
    bend = _STEADY * price.mean() * ((move[:, None] - move) / reach) ** 2
    total, choice = price[0], []
    for k in range(1, len(one)):
        ahead = (first[k] > first[k - 1][:, None]) & (second[k] < second[k - 1][:, None])
        step = total[:, None] + np.where(ahead, bend, np.inf)
        choice.append(step.argmin(axis=0))
        total = step.min(axis=0) + price[k]
    if not np.isfinite(total.min()):
        return one, other
    way = [int(total.argmin())]
    for before in reversed(choice):
        way.append(int(before[way[-1]]))
    found = move[way[::-1]]
    return one + found, other + found


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
