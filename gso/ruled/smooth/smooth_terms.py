"""Energy terms of smooth strips."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from gso.energy import Term, mean_weights
from gso.energy.base import Residual
from gso.geometry.vectors import cross, lengths, unit
from gso.ruled.smooth.curves import Curves, hermite
from gso.ruled.smooth.residuals import (
    bend_residual,
    break_residual,
    distance_residual,
    joined_residual,
    jump_residual,
    length_residual,
    speed_residual,
    turn_residual,
)
from gso.typing import Array, Flags, Ints

#: Positions in a span where its normals are compared.
_PLACES = (0.06, 0.25, 0.5, 0.75, 0.94)
#: Speed, relative to the mean width, below which normals lose their meaning, and least width
#: that speeds are compared with.
_SLOW, _NARROW = 3e-4, 0.02
#: Samples across a strip for distances, and along a span.
_ACROSS, _ALONG = 4, (0.25, 0.75)
#: Weights of a cubic's ends and derivatives in the control points of its derivative, and in its
#: own, for spans of width one.
_SPEEDS = np.array([[0.0, 1, 0, 0], [-3, -1, 3, -1], [0, 0, 0, 1]])
_CONTROLS = np.array([[1.0, 0, 0, 0], [1, 1 / 3, 0, 0], [0, 0, 1, -1 / 3], [0, 0, 1, 0]])


class Terms:
    """The terms of curves, given the place of the surface on each of their spans.

    Parameters
    ----------
    curves : Curves
        Where directions and lengths are taken from.
    ranges : ndarray, (e, 2)
        The part of the rulings of each span that is inside the outline, from 0 to 1.
    width : float
        Mean width of the spans.
    """

    def __init__(self, curves: Curves, ranges: Array, width: float):
        self.curves, self.ranges, self.width = curves, ranges, width
        self._spans = curves.spans
        corner = curves.unknowns[self._spans.ids]
        p, p1, q, q1 = corner[:, [0, 2, 4, 6]].transpose(1, 0, 2)
        self._ends = p, p1, q, q1
        self._least = (_SLOW * width) ** 2

    def turn(self) -> Term:
        """Return the turning of the normal along the rulings; zero is a torsal surface."""
        spans = self._spans
        constants = []
        for s in _PLACES:
            value, slope = hermite(np.full(len(spans.width), s), spans.width)
            # Derivatives in units of the span's width, so that speeds are lengths.
            slope = slope * spans.width[:, None]
            least = np.full((len(value), 1), self._least)
            constants.append(np.hstack([value, slope, self.ranges, least]))
        return self._repeated("turn", turn_residual, constants)

    def speed(self) -> Term:
        """Return the bound on the speed across the rulings."""
        p, p1, q, q1 = self._ends
        normal = cross(q1 - p, q - p1)
        side = unit(cross(unit(q - p) + unit(q1 - p1), normal))
        side *= np.sign(np.einsum("ed,ed->e", side, p1 - p + q1 - q))[:, None]
        gaps = np.stack([np.einsum("ed,ed->e", side, x) for x in (p1 - p, q1 - q)], axis=1)
        v = self.ranges
        widths = np.maximum((1 - v) * gaps[:, :1] + v * gaps[:, 1:], _NARROW * self.width)
        every = [np.hstack([self._scaled(w), v, side, widths]) for w in _SPEEDS]
        return self._repeated("speed", speed_residual, every)

    def length(self) -> Term:
        """Return the bound on the length of the rulings."""
        p, p1, q, q1 = self._ends
        least = np.maximum(np.minimum(lengths(q - p), lengths(q1 - p1)), 1e-3 * self.width)
        rest = np.hstack([unit(q - p + q1 - p1), least[:, None]])
        every = [np.hstack([self._scaled(w), rest]) for w in _CONTROLS]
        return self._repeated("length", length_residual, every)

    def bend(self) -> Term:
        """Return the second derivatives of the curves."""
        ids, width = self._spans.ids, self._spans.width
        every, first = np.unique(np.vstack([ids[:, :4], ids[:, 4:]]), axis=0, return_index=True)
        width = np.r_[width, width][first]
        kept = every[:, 0] != every[:, 2]
        return _mean("bend", bend_residual, every[kept], width[kept][:, None], linear=True)

    def jump(self) -> Term:
        """Return the jumps of the second derivatives of the curves at rulings."""
        curves, n = self.curves, len(self.curves.points)
        rows, factors = [], []
        for ids, left, right, at in zip(
            curves.index, curves.left, curves.right, curves.knots, strict=True
        ):
            inner = [ids[:-2], n + right[:-2], ids[1:-1], n + left[1:-1], ids[2:], n + left[2:]]
            h = np.broadcast_to(np.diff(at)[:, None], (len(at) - 1, ids.shape[1]))
            a, b = h[:-1], h[1:]
            size = a * b
            factor = [6 / a**2, 2 / a, 6 / b**2 - 6 / a**2, 4 / a + 4 / b, -6 / b**2, 2 / b]
            smooth = (left == right)[1:-1] & (ids[:-2] != ids[1:-1])
            rows.append(np.stack(inner, axis=2)[smooth])
            factors.append(np.stack([size * f for f in factor], axis=2)[smooth])
        return _mean(
            "jump", jump_residual, np.concatenate(rows), np.concatenate(factors), linear=True
        )

    def distance(self, nearest: Callable[[Array], tuple[Array, Array]]) -> Term:
        """Return the distances from a surface.

        Parameters
        ----------
        nearest : callable
            Returns the nearest points of the surface, and its normals there, to points (k, 3).
        """
        spans, v = self._spans, self.ranges
        inside = v[:, 1] > v[:, 0]
        rows, values, places = [], [], []
        for s in _ALONG:
            value, _ = hermite(np.full(len(spans.width), s), spans.width)
            for share in (np.arange(_ACROSS) + 0.5) / _ACROSS:
                rows.append(spans.ids[inside])
                values.append(value[inside])
                places.append((v[:, 0] + share * (v[:, 1] - v[:, 0]))[inside])
        ids, value, place = np.vstack(rows), np.vstack(values), np.concatenate(places)[:, None]

        def refresh(blocks: Mapping[str, Array]) -> Array:
            corner = blocks["surface"][ids]
            ends = [np.einsum("ec,ecd->ed", value, x) for x in (corner[:, :4], corner[:, 4:])]
            foot, normal = nearest((1 - place) * ends[0] + place * ends[1])
            offset = np.einsum("ed,ed->e", normal, foot)
            return np.vstack([value.T, place.T, normal.T, offset[None]])

        p, p1, q, q1 = self.curves.unknowns[ids[:, [0, 2, 4, 6]]].transpose(1, 0, 2)
        area = lengths(cross(p1 - p + q1 - q, q - p + q1 - p1))
        return Term(
            "distance",
            distance_residual,
            (("surface", ids),),
            area / area.sum(),
            refresh({"surface": self.curves.unknowns}),
            refresh=refresh,
        )

    def breaks(self) -> Term | None:
        """Return the angles at rulings where derivatives are not continuous; None without any."""
        curves, spans, n = self.curves, self._spans, len(self.curves.points)
        rows, rest = [], []
        ends: dict[tuple[int, int], tuple[list[int], float]] = {}
        for e in range(len(spans.row)):
            k, i, j = (int(x[e]) for x in (spans.sequence, spans.row, spans.column))
            own, place = slice(j, j + 2), float(self.ranges[e].mean())
            index, left, right = curves.index[k], curves.left[k], curves.right[k]
            if i and (left[i, own] != right[i, own]).any():
                rows.append([*index[i, own], *(n + left[i, own]), *(n + right[i, own])])
                rest.append([place, self._least, 1.0])
            # Two sequences may end at the same ruling.
            for at, slopes, way in ((0, right[0], -1.0), (len(index) - 1, left[-1], 1.0)):
                if i != min(at, len(index) - 2):
                    continue
                pair, by, there = index[at, own].tolist(), (n + slopes[own]).tolist(), place
                if pair[0] > pair[1]:
                    pair, by, there = pair[::-1], by[::-1], 1.0 - place
                key = pair[0], pair[1]
                if key in ends:
                    other, old = ends[key]
                    rows.append([*pair, *by, *other])
                    rest.append([there, self._least, -way * old])
                ends[key] = by, way
        return _mean("break", break_residual, np.array(rows), np.array(rest)) if rows else None

    def joined(self) -> Term | None:
        """Return the angles between flat triangles and the strips beside them, if there are any."""
        flats, spans = self.curves.flats, self._spans
        rows, constants = [], []
        for e in np.flatnonzero(_outermost(self.curves)) if len(flats) else ():
            for s, ends in ((0.0, (0, 4)), (1.0, (2, 6))):
                side = spans.ids[e, list(ends)]
                for flat in flats[:, [0, 1, 3]]:
                    if not np.isin(side, flat).all() or side[0] == side[1]:
                        continue
                    third = flat[~np.isin(flat, side)]
                    value, slope = hermite(s, spans.width[e])
                    rest = [*self.ranges[e], self._least, 1.0 if s else -1.0]
                    rows.append(np.r_[spans.ids[e], third])
                    constants.append(np.r_[value, slope * spans.width[e], rest])
        if not rows:
            return None
        return _mean("joined", joined_residual, np.array(rows), np.array(constants))

    def _scaled(self, weights: Array) -> Array:
        """Return weights (e, 4) for the spans' widths of those for width one."""
        h = self._spans.width
        return weights * np.stack([np.ones_like(h), h, np.ones_like(h), h], axis=1)

    def _repeated(self, name: str, residual: Residual, constants: list[Array]) -> Term:
        ids = np.tile(self._spans.ids, (len(constants), 1))
        return _mean(name, residual, ids, np.vstack(constants))


def _outermost(curves: Curves) -> Flags:
    """Return which spans are at an end of their sequence."""
    spans = curves.spans
    last = np.array([len(i) - 2 for i in curves.index])[spans.sequence]
    outermost: Flags = (spans.row == 0) | (spans.row == last)
    return outermost


def _mean(
    name: str, residual: Residual, ids: Ints, constants: Array, *, linear: bool = False
) -> Term:
    return Term(
        name,
        residual,
        (("surface", ids),),
        mean_weights(len(ids)),
        np.ascontiguousarray(constants.T),
        linear=linear,
    )
