"""Bodies of revolution in rings: parts of cones about the axis, each of which unrolls exactly.

The profile becomes the polygon with the least largest distance, for a number of sides, among those
with corners near points of it. Each side is the straight line in the middle of what it replaces,
so that the rings are as far inside of the body as outside. The circles of its boundary stay, so
that it fits what is joined there. Rings of a part of a body, such as a dome with a door, are cut
along its outline.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gso.geometry.polygon import arc_lengths, points_at
from gso.mesh import Mesh
from gso.result import StripsResult
from gso.ruled.paneling.made_strips import made_strips
from gso.ruled.paneling.ring_surface import ROUND, RingSurface
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.paneling.surface_strips import wanted
from gso.seams.revolution import Revolution
from gso.status import Status
from gso.typing import Array, Ints

#: Name of this way in results.
REVOLUTION = "revolution"
#: Number of places of the profile that sides may end near.
_PLACES = 160
#: Number of rings that are measured, from the fewest on that the profile allows.
_TRIED = 8
#: Largest move of a corner of the polygon along a side, relative to the side's length.
_MOVED = 0.5
#: Radius of a ring's end within the body, relative to the allowed distance, up to which it closes.
_THIN = 1e-3
#: Least cosine of half the turn at a corner that is reckoned with.
_BLUNT = 0.3
#: Number of halvings of the range of a line's other end.
_HALVED = 30
_TINY = float(np.sqrt(np.finfo(float).tiny))


def ring_strips(design: Mesh, allowed: float, request: StripsRequest) -> StripsResult | None:
    """Make rings of a body of revolution or of a part of one, without a verdict.

    They are as few as are within a distance.

    Parameters
    ----------
    design : Mesh
    allowed : float
        Largest distance from the design, both ways, in its unit.
    request : StripsRequest
        Without constraints, start, and number of strips.

    Returns
    -------
    StripsResult or None
        None if the design is no part of a body of revolution, or rings do not hold the bounds.
    """
    clock = time.perf_counter()
    body, is_part = Revolution.of(design, allowed), False
    if body is None:
        body, is_part = Revolution.with_part(design, allowed), True
    if body is None:
        return None
    # Cones are as much farther out than their facets.
    aim = wanted(request.options, (1.0 - ROUND) * allowed, 1.0)
    for polygon in _polygons(body.profile, allowed - body.apart, request.options.max_strips):
        inner, most = polygon[1:-1, 0], float(polygon[:, 0].max())
        if inner.min(initial=most) <= _THIN * allowed:
            # A needle, or a neck that closes.
            continue
        rings = RingSurface(design, body, polygon, allowed)
        surface = rings.within_outline() if is_part else rings.whole()
        if surface is None:
            return None
        if aim.met(surface):
            far = surface.deviation
            mean = 0.0 if far is None else far.mean
            status, notes = Status.CONVERGED, [_said(surface.strips, is_part)]
            return made_strips(
                design, surface, status, REVOLUTION, begun=clock, mean=mean, notes=notes
            )
    return None


def _said(count: int, is_part: bool) -> str:
    """Return a note on rings."""
    rings, part = "one ring" if count == 1 else f"{count} rings", "part of " if is_part else ""
    return f"the design is {part}a body of revolution: {rings}, each part of a cone about its axis"


def _polygons(profile: Array, allowed: float, most: int) -> Iterator[Array]:
    """Return polygons (k + 1, 2) near a profile, from the fewest sides within a distance on.

    The largest distance is the least one for sides between places on the profile: the best
    polygons of k sides up to each place come from those of k - 1.
    """
    line = _spread(profile)
    sides = _Sides.of(line)
    far = sides.far
    best, before, found = far[0], [], 0
    for count in range(1, most + 1):
        if count > 1:
            through = np.maximum(best[:, None], far)
            before.append(through.argmin(axis=0))
            best = through.min(axis=0)
        if best[-1] > allowed or (count < 3 and _is_closed(line)):
            continue
        corners = [len(line) - 1]
        for place in before[::-1]:
            corners.insert(0, int(place[corners[0]]))
        corners.insert(0, 0)
        yield _polygon(line, np.array(corners), sides)
        found += 1
        if found == _TRIED:
            return


def _spread(profile: Array) -> Array:
    """Return the points of a profile, and more between them in about equal steps."""
    along = arc_lengths(profile)
    even = np.linspace(0.0, along[-1], _PLACES)
    apart = np.abs(even[:, None] - along).min(axis=1) > 0.5 * even[1]
    return points_at(np.sort(np.concatenate([along, even[apart]])), along, profile)


@dataclass(frozen=True)
class _Sides:
    """Straight lines in place of the parts of a profile between any two of its points (n).

    Attributes
    ----------
    far : ndarray, (n, n)
        Largest distance of the points from the line; infinite unless the second end comes later.
    first, last : ndarray, (n, n)
        Distance of the line from the first and from the second point, to the left.
    """

    far: Array
    first: Array
    last: Array

    @classmethod
    def of(cls, line: Array) -> _Sides:
        """Find the lines, which begin and end on the profile's own ends off the axis."""
        way = line[None] - line[:, None]
        size = np.maximum(np.linalg.norm(way, axis=2), _TINY)[..., None]
        left = np.stack([-way[..., 1], way[..., 0]], axis=2) / size
        away = np.einsum("ijd,ikd->ijk", left, way)
        k = np.arange(len(line))
        away = np.where((k[:, None, None] <= k) & (k <= k[:, None]), away, 0.0)
        low, high = away.min(axis=2), away.max(axis=2)
        # Corners between lines are farther out than these, as on an arc of this height.
        half = 2.0 * (high - low) / size[..., 0]
        out = np.maximum((1.0 - half**2) / (1.0 + half**2), _BLUNT)
        first = (high + low) * out / (1.0 + out)
        far = np.maximum(np.maximum(high - first, first - low), np.abs(first) / out)
        last = first.copy()
        if _is_closed(line):
            far[0, -1] = np.inf
            return cls(np.where(np.tri(len(line), dtype=bool), np.inf, far), first, last)
        begins, ends = line[0, 0] > 0.0, line[-1, 0] > 0.0
        across = np.abs(left[..., 1])
        if begins:
            far[0], last[0] = _tilted(away[0], _shares(line[0], line))
            first[0] = 0.0
        else:
            far[0], first[0] = _pointed(low[0], high[0], across[0])
            last[0] = first[0]
        if ends:
            far[:, -1], first[:, -1] = _tilted(away[:, -1], _shares(line[-1], line))
            last[:, -1] = 0.0
        else:
            far[:, -1], first[:, -1] = _pointed(low[:, -1], high[:, -1], across[:, -1])
            last[:, -1] = first[:, -1]
        if begins and ends:
            far[0, -1], first[0, -1] = max(high[0, -1], -low[0, -1]), 0.0
        return cls(np.where(np.tri(len(line), dtype=bool), np.inf, far), first, last)


def _is_closed(line: Array) -> bool:
    """Whether a line ends where it begins, as the profile of a torus."""
    return np.array_equal(line[0], line[-1])


def _pointed(low: Array, high: Array, across: Array) -> tuple[Array, Array]:
    """Move chords that end on the axis, where the tip moves farther than they do.

    Parameters
    ----------
    low, high : ndarray, (n,)
        Least and largest distance of points from the chords, to the left: 0 or less, 0 or more.
    across : ndarray, (n,)
        Cosine of the angle between the chord and the radius.

    Returns
    -------
    far, moved : ndarray, (n,)
        The largest distance left, also of the tip, and the move to the left.
    """
    middle = 0.5 * (low + high)
    most = np.where(middle > 0.0, high, -low)
    moved = np.minimum(np.abs(middle), most * across / (1.0 + across))
    return most - moved, np.copysign(moved, middle)


def _shares(end: Array, line: Array) -> Array:
    """Return the places (n, n) of points (n, 2) along chords from one end to each of them."""
    way = line - end
    return np.asarray(way @ way.T / np.maximum((way**2).sum(axis=1), _TINY)[:, None])


def _tilted(away: Array, share: Array) -> tuple[Array, Array]:
    """Turn chords (n) about one end until points (n, k) are as far on one side as on the other.

    Parameters
    ----------
    away, share : ndarray, (n, k)
        Distances of points from the chords, to the left, and their places along them, from 0 at
        the end that stays.

    Returns
    -------
    far, moved : ndarray, (n,)
        The largest distance left, and the move of the other end, to the left.
    """
    low, high = 2.0 * np.minimum(away.min(axis=1), 0.0), 2.0 * np.maximum(away.max(axis=1), 0.0)
    for _ in range(_HALVED):
        moved = 0.5 * (low + high)
        left = away - moved[:, None] * share
        more = left.max(axis=1) > -left.min(axis=1)
        low, high = np.where(more, moved, low), np.where(more, high, moved)
    left = away - (0.5 * (low + high))[:, None] * share
    return np.abs(left).max(axis=1), 0.5 * (low + high)


def _polygon(line: Array, corners: Ints, sides: _Sides) -> Array:
    """Return the polygon whose corners are where lines near the profile meet.

    Ends on the axis stay on it.
    """
    a, b = corners[:-1], corners[1:]
    way = line[b] - line[a]
    size = np.linalg.norm(way, axis=1, keepdims=True)
    left = np.stack([-way[:, 1], way[:, 0]], axis=1) / size
    start, end = (
        line[at] + off[a, b][:, None] * left for at, off in ((a, sides.first), (b, sides.last))
    )
    closed = _is_closed(line)
    if closed:
        start, end, size = (np.concatenate([x, x[:1]]) for x in (start, end, size))
    out = np.concatenate([start[:1], 0.5 * (start[1:] + end[:-1]), end[-1:]])
    way = end - start
    turn = way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]
    gap = start[1:] - start[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (gap[:, 0] * way[1:, 1] - gap[:, 1] * way[1:, 0]) / turn
    met = start[:-1] + share[:, None] * way[:-1]
    near = np.linalg.norm(met - out[1:-1], axis=1) <= _MOVED * np.minimum(size[1:], size[:-1])[:, 0]
    out[1:-1][near] = met[near]
    if closed:
        out = np.concatenate([out[-2:-1], out[1:-1]])
    for k, at in ((0, 0), (-1, -1)):
        if line[at, 0] == 0.0:
            # Along the side, back to the axis; the end of a side near the axis stays.
            step = -out[at, 0] / way[k, 0] if way[k, 0] else np.inf
            out[at] = out[at] + step * way[k] if abs(step) <= _MOVED else line[at]
            out[at, 0] = 0.0
    out[:, 0] = np.maximum(out[:, 0], 0.0)
    return np.asarray(out)
