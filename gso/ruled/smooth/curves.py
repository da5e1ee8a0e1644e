"""Smooth curves through the ends of rulings, piecewise cubic with continuous derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gso.geometry.vectors import lengths
from gso.ruled.strip_layout import Strips
from gso.typing import Array, Flags, Ints


def hermite(s: Array | float, width: Array | float) -> tuple[Array, Array]:
    """Return weights (..., 4) of a cubic's ends and derivatives there, for value and derivative.

    Parameters
    ----------
    s : float or ndarray
        Position in the span, 0 to 1.
    width : float or ndarray
        Width of the span, by which the derivatives are taken.
    """
    s, h = np.broadcast_arrays(np.asarray(s, float), np.asarray(width, float))
    value = [2 * s**3 - 3 * s**2 + 1, h * (s**3 - 2 * s**2 + s), 3 * s**2 - 2 * s**3]
    value.append(h * (s**3 - s**2))
    slope = [6 * (s * s - s) / h, 3 * s * s - 4 * s + 1, 6 * (s - s * s) / h, 3 * s * s - 2 * s]
    return np.stack(value, axis=-1), np.stack(slope, axis=-1)


class Spans(NamedTuple):
    """Parts of strips between successive rulings.

    Attributes
    ----------
    ids : ndarray of int, (e, 8)
        Rows of the unknowns: end, derivative, next end, derivative of the one curve, then those
        of the other.
    width : ndarray, (e,)
        Width in the parameter along the strip.
    sequence : ndarray of int, (e,)
        Number of the sequence of rulings.
    row : ndarray of int, (e,)
        Number of the span's first ruling in the sequence.
    column : ndarray of int, (e,)
        Number of the strip.
    """

    ids: Ints
    width: Array
    sequence: Ints
    row: Ints
    column: Ints


@dataclass(frozen=True)
class Curves:
    """Cubic curves through the ends of rulings: the borders and creases of smooth strips.

    Attributes
    ----------
    index : tuple of ndarray of int, (r, k + 1) each
        For each sequence of rulings, the rows of their ends in `points`.
    left, right : tuple of ndarray of int, (r, k + 1) each
        Rows of `slopes`: derivatives of the curves before and after each ruling. They differ
        where a curve stands still on one side, as successive rulings share that end. The last
        row of `slopes` is zero.
    knots : tuple of ndarray, (r,) each
        Parameter along the strip at each ruling.
    points, slopes : ndarray, (n, 3), (m, 3)
    flats : ndarray of int, (g, 4)
        Flat triangles between sequences, as in :class:`~gso.ruled.strip_layout.Strips`.
    """

    index: tuple[Ints, ...]
    left: tuple[Ints, ...]
    right: tuple[Ints, ...]
    knots: tuple[Array, ...]
    points: Array
    slopes: Array
    flats: Ints

    @classmethod
    def of(cls, strips: Strips, vertices: Array) -> Curves:
        """Interpolate the ends of the rulings of strips; derivatives do not overshoot."""
        index, left, right, slopes, count = [], [], [], [], 0
        for every in strips.index:
            new = np.r_[True, (np.diff(every, axis=0) != 0).any(axis=1)]
            ids = every[new]
            index.append(ids)
            moves = np.diff(ids, axis=0) != 0
            none = np.zeros((1, ids.shape[1]), bool)
            before, after = np.vstack([none, moves]), np.vstack([moves, none])
            chord = np.diff(vertices[ids], axis=0)
            blank = np.zeros((1, *chord.shape[1:]))
            one, two = np.concatenate([blank, chord]), np.concatenate([chord, blank])
            # The weighted harmonic mean of both chords' lengths: curves stay monotone.
            a, b = lengths(one)[:, :, None], lengths(two)[:, :, None]
            both = (before & after)[:, :, None]
            with np.errstate(invalid="ignore"):
                mean = np.nan_to_num((b * one + a * two) / (a + b))
            steps = np.stack([np.where(both, mean, one), np.where(both, mean, two)], axis=2)
            # Number the derivatives: one before and one after each ruling, or one for both.
            own = np.stack([before, after & ~before], axis=2)
            number = count + np.cumsum(own).reshape(own.shape) - 1
            slopes.append(steps[own])
            left.append(np.where(before, number[:, :, 0], -1))
            right.append(np.where(after, np.where(before, number[:, :, 0], number[:, :, 1]), -1))
            count += int(own.sum())
        rows = [tuple(np.where(x < 0, count, x) for x in side) for side in (left, right)]
        knots = tuple(np.arange(float(len(i))) for i in index)
        last = np.concatenate([*slopes, np.zeros((1, 3))])
        return cls(tuple(index), rows[0], rows[1], knots, vertices, last, strips.flats)

    @cached_property
    def spans(self) -> Spans:
        """All parts of strips between successive rulings that are different."""
        n = len(self.points)
        parts = []
        for k, (index, left, right, knots) in enumerate(
            zip(self.index, self.left, self.right, self.knots, strict=True)
        ):
            ends = [index[:-1], n + right[:-1], index[1:], n + left[1:]]
            ids = np.stack([*(x[:, :-1] for x in ends), *(x[:, 1:] for x in ends)], axis=2)
            row, column = np.indices(ids.shape[:2])
            width = np.broadcast_to(np.diff(knots)[:, None], row.shape)
            kept = (ids[:, :, 0] != ids[:, :, 2]) | (ids[:, :, 4] != ids[:, :, 6])
            number = np.full(int(kept.sum()), k)
            parts.append(Spans(ids[kept], width[kept], number, row[kept], column[kept]))
        return Spans(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    @property
    def unknowns(self) -> Array:
        """Points, then derivatives, (n + m, 3)."""
        return np.concatenate([self.points, self.slopes])

    def moved(self, unknowns: Array) -> Curves:
        """Return the curves with other points and derivatives."""
        n = len(self.points)
        return replace(self, points=unknowns[:n], slopes=unknowns[n:])

    def both(self, s: Array | float) -> tuple[Array, Array, Array, Array]:
        """Return points of both curves of all spans and their derivatives, (e, 3) each.

        Parameters
        ----------
        s : float or ndarray, (e,)
            Position in the spans, 0 to 1.
        """
        spans = self.spans
        value, slope = hermite(np.broadcast_to(s, spans.width.shape), spans.width)
        corner = self.unknowns[spans.ids]
        p, q = corner[:, :4], corner[:, 4:]
        return tuple(np.einsum("ec,ecd->ed", w, x) for w in (value, slope) for x in (p, q))

    def split(self, chosen: Flags) -> tuple[Curves, Ints]:
        """Halve spans, and those side by side with them, without changing the surface.

        Returns
        -------
        curves : Curves
        parent : ndarray of int, (e,)
            The old span that each new one is a part of.
        """
        spans, unknowns = self.spans, self.unknowns
        first, zero = len(self.points), len(self.slopes) - 1
        n, m = first, zero
        points, slopes = [self.points], [self.slopes[:-1]]
        index, left, right, knots, parents = [], [], [], [], []
        for k, (ids, before, after, at) in enumerate(
            zip(self.index, self.left, self.right, self.knots, strict=True)
        ):
            rows = np.unique(spans.row[chosen & (spans.sequence == k)])
            width = np.diff(at)[rows]
            stencil = [ids[rows], first + after[rows], ids[rows + 1], first + before[rows + 1]]
            corner = unknowns[np.stack(stencil, axis=2)]
            weights = hermite(np.full(len(rows), 0.5), width)
            value, slope = (np.einsum("rc,rjcd->rjd", w, corner) for w in weights)
            moves = ids[rows] != ids[rows + 1]
            count = int(moves.sum())
            points.append(value[moves])
            slopes.append(slope[moves])
            inner, steps = ids[rows].copy(), np.full(moves.shape, -1)
            inner[moves], steps[moves] = n + np.arange(count), m + np.arange(count)
            n, m = n + count, m + count
            index.append(np.insert(ids, rows + 1, inner, axis=0))
            # The zero derivative, which is the last one, gets another number.
            sides = (np.where(x == zero, -1, x) for x in (before, after))
            one, two = (np.insert(x, rows + 1, steps, axis=0) for x in sides)
            left.append(one)
            right.append(two)
            knots.append(np.insert(at, rows + 1, at[rows] + 0.5 * width))
            parents.append(np.insert(np.arange(len(ids)), rows + 1, rows))
        out = Curves(
            tuple(index),
            tuple(np.where(x < 0, m, x) for x in left),
            tuple(np.where(x < 0, m, x) for x in right),
            tuple(knots),
            np.concatenate(points),
            np.concatenate([*slopes, np.zeros((1, 3))]),
            self.flats,
        )
        new = out.spans
        number = np.full((len(self.index), max(map(len, self.index)), ids.shape[1]), -1)
        number[spans.sequence, spans.row, spans.column] = np.arange(len(spans.row))
        start = np.r_[0, np.cumsum([len(x) for x in parents])[:-1]]
        row = np.concatenate(parents)[start[new.sequence] + new.row]
        return out, number[new.sequence, row, new.column]

    def pieces(self) -> list[tuple[int, int, int]]:
        """Return (sequence, first ruling, last ruling) of the parts with continuous derivatives."""
        out = []
        for k, (left, right) in enumerate(zip(self.left, self.right, strict=True)):
            broken = 1 + np.flatnonzero((left[1:-1] != right[1:-1]).any(axis=1))
            ends = np.r_[0, broken, len(left) - 1].tolist()
            out += [(k, a, b) for a, b in pairwise(ends) if b > a]
        return out
