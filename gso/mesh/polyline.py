"""Polylines to slide along: nearest points, directions, and where a slide ends."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh.mesh import Frame
from gso.typing import Array, Flags, Ints

#: Vertices do not slide round corners of more than this many degrees.
CORNER = 45.0
#: Number of pairs of a point and a segment that are processed together.
_BLOCK = 1_000_000


class Feet(NamedTuple):
    """Nearest points (k, dim) of polylines, with their segments.

    `along` is the position along the line through segment `segment`, in units of its length
    and not clipped to it.
    """

    points: Array
    segment: Ints
    along: Array


@dataclass(frozen=True)
class Polylines:
    """Segments of one or more polylines.

    Attributes
    ----------
    start, end : ndarray, (m, dim)
        Ends of the segments.
    stop : ndarray of bool, (m, 2)
        Whether a slide ends at the start and at the end of a segment: at the ends of open
        lines, and at corners.
    tangent : ndarray, (m, 2, dim)
        Unit directions at both ends: the mean of the segments that meet there.
    """

    start: Array
    end: Array
    stop: Flags
    tangent: Array

    @classmethod
    def of(cls, points: Array, *, closed: bool, corner: float = CORNER) -> Polylines:
        """Make one polyline through points (m, dim), no two consecutive ones the same."""
        start = points if closed else points[:-1]
        end = np.roll(points, -1, axis=0) if closed else points[1:]
        way = _unit(end - start)
        mean = way + np.roll(way, 1, axis=0)
        sharp = turns(way) > corner
        if not closed:
            sharp[0] = True
        # Joint k is the start of segment k and the end of the one before.
        mean = np.where(sharp[:, None], way, _unit(mean))
        before = np.roll(np.arange(len(way)), -1)
        stop = np.stack([sharp, sharp[before]], axis=1)
        last = np.where(stop[:, 1:], way, mean[before])
        return cls(start, end, stop, np.stack([mean, last], axis=1))

    @classmethod
    def join(cls, several: list[Polylines]) -> Polylines:
        """Join the segments of several polylines."""
        parts = zip(*((s.start, s.end, s.stop, s.tangent) for s in several), strict=True)
        return cls(*(np.concatenate(p) for p in parts))

    def mapped(self, frame: Frame) -> Polylines:
        """Return the polylines in the unit of a frame."""
        return replace(self, start=frame.to_unit(self.start), end=frame.to_unit(self.end))

    @property
    def way(self) -> Array:
        """Unit direction of every segment."""
        return _unit(self.end - self.start)

    def directions(self, segment: Ints, along: Array) -> Array:
        """Interpolate unit tangents (k, dim) at positions along segments."""
        t = np.clip(along, 0.0, 1.0)[:, None]
        return _unit((1.0 - t) * self.tangent[segment, 0] + t * self.tangent[segment, 1])

    def nearest(self, points: Array) -> Feet:
        """Find the points of the polylines nearest to points (k, dim)."""
        edge = self.end - self.start
        square = np.maximum((edge**2).sum(axis=1), 1e-300)  # points may coincide
        segment = np.empty(len(points), np.int64)
        along = np.empty(len(points))
        block = max(_BLOCK // len(edge), 1)
        for first in range(0, len(points), block):
            part = slice(first, first + block)
            away = points[part, None] - self.start
            t = (away * edge).sum(axis=2) / square
            away -= np.clip(t, 0.0, 1.0)[..., None] * edge
            best = (away**2).sum(axis=2).argmin(axis=1)
            segment[part], along[part] = best, t[np.arange(len(best)), best]
        feet = self.start[segment] + np.clip(along, 0.0, 1.0)[:, None] * edge[segment]
        return Feet(feet, segment, along)


def turns(way: Array) -> Array:
    """Angle in degrees between each direction (m, dim) of a closed line and the one before."""
    return np.asarray(np.degrees(geometry.angle(tuple(way.T), tuple(np.roll(way, 1, axis=0).T))))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))
