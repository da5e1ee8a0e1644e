"""The first rulings: chords of the flat image along which the normal of the design varies little.

A dynamic program (:mod:`gso.ruled.program`) finds sequences of chords between points of the
outline. They are smoothed, turned to lower prices, and continued beyond the outline.
"""

from __future__ import annotations

import numpy as np

from gso.ruled.domain import Domain
from gso.ruled.polygon import corners, on, resampled
from gso.ruled.prices import along, prices
from gso.ruled.program import Branch, sequences
from gso.ruled.strip_layout import Strips
from gso.typing import Array, Flags, Ints

#: Points on the outline.
_COUNT = 96
#: Steps of the sequence over which ends are averaged, and how far they are moved towards equal
#: spacing, so that rulings do not meet in one point.
_WINDOW, _EVEN = 9, 0.2
#: Steps that are left out at each tip, where chords are very short, and the largest share of a
#: sequence that they are.
_TIP, _SHARE = 2.0, 0.3
#: Largest turns of chords, in points of the outline, one round after the other; number of turns
#: that are tried in each; weight of the changes of the turn, relative to the mean price.
_TURNS, _CHOICES, _STEADY = (6.0, 1.5, 0.4), 13, 0.05
#: Least distance of ends on the offset polygon, relative to their mean distance, and the largest
#: number of points by which they move for the sake of a straight continuation.
_APART, _FAR = 0.2, 8.0
#: Price of chords that cross given ones, relative to the highest.
_DEAR = 100.0


def chords(
    domain: Domain, count: int, flat: float | None = None, given: Array | None = None
) -> tuple[Strips, Array]:
    """Find first rulings: chords of low price, continued beyond the outline by the margin.

    Parameters
    ----------
    domain : Domain
        The design over its flat image.
    count : int
        Number of chords of a single sequence; about the number of all chords of several.
    flat : float, optional
        Cost of a flat triangle between three sequences. Without it there is one sequence.
    given : ndarray, (m, 2, 2), optional
        Ends of parts of chords that are among the result.

    Returns
    -------
    strips : Strips
        The layout.
    places : ndarray, (n, 2)
        Its vertices in the plane.
    """
    outline, normals = resampled(domain.around, _COUNT)
    beyond = outline + domain.margin * normals
    price, normal = prices(domain, outline)
    for segment in () if given is None else given:
        price[_crossed(outline, segment)] += _DEAR * price.max()
    found, triangles = sequences(outline, price, None if flat is None else normal, flat or 0.0)
    steps = sum(len(b.first) - 1 for b in found)
    index, places = [], []
    shared, which = np.unique(triangles, return_inverse=True)
    size = len(shared)
    for branch in found:
        share = (len(branch.first) - 1) / steps
        if share == 0.0:
            continue
        number = count if len(found) == 1 else max(round(count * share), 2)
        one, other = _spread(domain, outline, beyond, branch, number)
        for segment in () if given is None else given:
            one, other = _with_chord(beyond, segment, one, other)
        own = size + np.arange(2 * number).reshape(number, 2)
        # Number 0 is the first chord, -1 the last.
        for at in np.flatnonzero(branch.held):
            ends = [branch.first[-at] % _COUNT, branch.second[-at] % _COUNT]
            own[-at] = np.searchsorted(shared, ends)
        index.append(own)
        places.append(np.stack([on(beyond, one), on(beyond, other)], axis=1).reshape(-1, 2))
        size += 2 * number
    # The faces of strips are clockwise in the plane.
    flats = which.reshape(-1, 3)[:, [0, 2, 0, 1]]
    return Strips(tuple(index), flats).compact(np.concatenate([beyond[shared], *places]))


def _spread(
    domain: Domain, outline: Array, beyond: Array, branch: Branch, number: int
) -> tuple[Array, Array]:
    """Return the ends of evenly spread chords of a branch, as numbers of points of `beyond`."""
    steps = len(branch.first) - 1
    tip = min(_TIP / steps, _SHARE)
    begin, end = (0.0 if held else tip for held in branch.held)
    at = np.linspace(begin, 1.0 - end, number)
    share = np.linspace(0.0, 1.0, steps + 1)
    one, other = (
        np.interp(at, share, _even(x, branch.held)) for x in (branch.first, branch.second)
    )
    for reach in _TURNS:
        one, other = turned(domain, outline, one, other, reach, branch.held)
    one, other = _continued(outline, beyond, one, other, branch.held)
    sharp = corners(outline)
    return _cornered(one, sharp), _cornered(other, sharp)


def _crossed(outline: Array, segment: Array) -> Flags:
    """Return which chords (n, n) between points of the outline cross the line of a segment.

    The line goes from one side of the outline to the other.
    """
    ends = _hits(outline, segment[None, ::-1])[0], _hits(outline, segment[None])[0]
    low, high = sorted(e % len(outline) for e in np.concatenate(ends).tolist())
    k = np.arange(len(outline))
    between, outside = (k > low + 0.5) & (k < high - 0.5), (k < low - 0.5) | (k > high + 0.5)
    cross = between[:, None] & outside
    return np.asarray(cross | cross.T)


def _with_chord(beyond: Array, segment: Array, one: Array, other: Array) -> tuple[Array, Array]:
    """Replace the nearest chord by the line of a segment; others keep out of its way."""
    n = len(beyond)
    ends = [float(_hits(beyond, x[None])[0][0]) for x in (segment[::-1], segment)]
    best: tuple[float, int, Array] | None = None
    for pair in (ends, ends[::-1]):
        off = [(x - e + 0.5 * n) % n - 0.5 * n for x, e in zip((one, other), pair, strict=True)]
        far = np.abs(off[0]) + np.abs(off[1])
        k = int(far.argmin())
        if best is None or far[k] < best[0]:
            best = float(far[k]), k, np.array([one[k] - off[0][k], other[k] - off[1][k]])
    if best is None or best[0] > 0.5 * n:
        return one, other
    _, k, (x, y) = best
    row = np.arange(len(one))
    one = np.where(row < k, np.minimum(one, x), np.maximum(one, x))
    other = np.where(row < k, np.maximum(other, y), np.minimum(other, y))
    one[k], other[k] = x, y
    return one, other


def _hits(polygon: Array, ways: Array) -> tuple[Array, Flags]:
    """Find where rays (k, 2, 2) through two points, from the first, leave a closed polygon (n, 2).

    Returns
    -------
    at : ndarray, (k,)
        Numbers of the polygon's points, with fractions.
    found : ndarray of bool, (k,)
        Whether there is such a place beyond the second point.
    """
    start, way = ways[:, 0], ways[:, 1] - ways[:, 0]
    off = polygon - start[:, None]
    side = way[:, :1] * off[:, :, 1] - way[:, 1:] * off[:, :, 0]
    along = np.einsum("kd,knd->kn", way, off) / (way**2).sum(axis=1)[:, None]
    after, ahead = np.roll(side, -1, axis=1), np.roll(along, -1, axis=1)
    crosses = (side > 0) != (after > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(crosses, side / (side - after), 0.0)
    there = np.where(crosses, along + share * (ahead - along), np.inf)
    there[there < 1.0] = np.inf
    k, row = there.argmin(axis=1), np.arange(len(ways))
    return k + share[row, k], np.isfinite(there[row, k])


def _continued(
    outline: Array, beyond: Array, one: Array, other: Array, held: tuple[bool, bool]
) -> tuple[Array, Array]:
    """Continue chords as straight lines to an offset polygon, where they do not cross there.

    Returns
    -------
    one, other : ndarray, (k,)
        The ends as numbers of points of the offset polygon.
    """
    n = len(outline)
    ends = on(outline, one), on(outline, other)
    found = []
    for at, start, stop, sign in ((one, *ends[::-1], 1.0), (other, *ends, -1.0)):
        there, hit = _hits(beyond, np.stack([start, stop], axis=1))
        move = (there - at + 0.5 * n) % n - 0.5 * n
        move[~hit | (np.abs(move) > _FAR)] = 0.0
        ordered = sign * _ordered(sign * at, sign * move, held)
        found.append(ordered)
    return found[0], found[1]


def _cornered(at: Array, sharp: Ints) -> Array:
    """Move the nearest of ordered numbers to each sharp corner that they pass.

    Otherwise the line between two of them would cut off the corner.
    """
    out: Array = at.copy()
    low, high = min(at[0], at[-1]), max(at[0], at[-1])
    rounds = np.arange(int(low // _COUNT), int(high // _COUNT) + 1) * _COUNT
    for corner in (sharp + rounds[:, None]).ravel().tolist() if len(at) > 2 else ():
        if low < corner < high:
            k = int(np.abs(at[1:-1] - corner).argmin()) + 1
            out[k] = corner
    return out


def _ordered(at: Array, move: Array, held: tuple[bool, bool]) -> Array:
    """Move rising numbers so that they keep their order, and some distance.

    The first and the last one stay: outside the design, so that its corners are covered.
    """
    k = np.arange(len(at))
    wide = _APART * (at[-1] - at[0]) / len(at)
    rising = at + np.where((k == 0) | (k == k[-1]), 0.0, move)
    level = rising - wide * k
    if held[0]:
        level = np.maximum(level, level[0])
    if held[1]:
        level = np.minimum(level, level[-1])
    # Both running extrema keep the order; their mean shares out what is moved.
    low = np.maximum.accumulate(level)
    high = np.minimum.accumulate(level[::-1])[::-1]
    return np.asarray(0.5 * (low + high) + wide * k)


def _even(ends: Ints, held: tuple[bool, bool]) -> Array:
    """Smooth the ends of a sequence along the outline; those that are held stay."""
    window = np.ones(_WINDOW) / _WINDOW
    smooth: Array = ends.astype(float)
    for _ in range(2):
        smooth = np.convolve(np.pad(smooth, _WINDOW // 2, mode="edge"), window, mode="valid")
    whole = np.linspace(0.0, 1.0, len(ends))
    if held[0]:
        smooth += (ends[0] - smooth[0]) * (1.0 - whole)
    if held[1]:
        smooth += (ends[-1] - smooth[-1]) * whole
    line: Array = smooth[0] + (smooth[-1] - smooth[0]) * whole
    return (1.0 - _EVEN) * smooth + _EVEN * line


def turned(
    domain: Domain, outline: Array, one: Array, other: Array, reach: float, held: tuple[bool, bool]
) -> tuple[Array, Array]:
    """Turn successive chords so that their prices fall; they do not cross.

    Both ends move by the same number of points along the outline, at most by `reach`.

    Parameters
    ----------
    one, other : ndarray, (k,)
        Ends of the chords, as numbers of points of the outline: `one` rises, `other` falls.
    held : tuple of bool
        Whether the first and the last chord stay.
    """
    move = reach * np.linspace(-1.0, 1.0, _CHOICES)
    first, second = one[:, None] + move, other[:, None] + move
    ends = (on(outline, x.ravel()) for x in (first, second))
    price = along(domain, *ends)[0].reshape(first.shape)
    for end in np.flatnonzero(held):
        price[-end] = np.where(move == 0.0, price[-end], np.inf)
    bend = _STEADY * price[np.isfinite(price)].mean() * ((move[:, None] - move) / reach) ** 2
    total, choice = price[0], []
    for k in range(1, len(one)):
        ahead = (first[k] >= first[k - 1][:, None]) & (second[k] <= second[k - 1][:, None])
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
