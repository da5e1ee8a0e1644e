"""Which lines of a family become creases: a dynamic program over sagittas.

Between two creases rulings are straight. The distance of the design's lines across from these
chords is the sagitta, width^2 x curvature / 8. The program minimises the mean of its fourth power,
between mean and maximum, over all choices of a number of lines. Widths are then
larger where the curvature across is smaller: they follow one over its square root.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from gso.geometry.vectors import lengths
from gso.mesh import topology
from gso.ruled.lines.line_families import Band, Family
from gso.ruled.lines.line_twist import twist
from gso.typing import Array, Flags, Ints

#: Largest number of lines across a strip that sagittas are measured on.
_COLUMNS = 32
#: Power of the sagittas.
_POWER = 4
#: Largest number of lines of a band that creases are chosen from.
_LEVELS = 97


@dataclass(frozen=True)
class _Costs:
    """Costs of strips of a band.

    Attributes
    ----------
    levels : ndarray of int, (n + 1,)
        The line at each level; -1 where the band ends.
    cost : ndarray, (n + 1, n + 1)
        Cost of the strip between two levels.
    places : ndarray, (n + 1, c, 3)
        Positions on the levels; not a number where there are none.
    """

    levels: Ints
    cost: Array
    places: Array

    def narrower(self, widest: float) -> _Costs:
        """Return the costs without strips that are wider."""
        wide = [lengths(self.places - own) for own in self.places]
        too_wide = np.nan_to_num(wide).max(axis=2) > widest
        return replace(self, cost=np.where(too_wide, np.inf, self.cost))

    def best(self, most: int) -> tuple[Array, list[Ints]]:
        """Return costs (most,) and lines for 1 to `most` strips; infinite where there are none."""
        n = len(self.levels) - 1
        most = min(most, n)
        cost = self.cost
        value, before = cost[0].copy(), [np.zeros(n + 1, np.int64)]
        values, chosen = [value[n]], [np.empty(0, np.int64)]
        for k in range(1, most):
            through = value[:, None] + cost
            before.append(through.argmin(axis=0))
            value = through.min(axis=0)
            values.append(value[n])
            levels, at = [], n
            for j in range(k, 0, -1):
                at = int(before[j][at])
                levels.append(at)
            chosen.append(self.levels[np.array(sorted(levels))])
        return np.array(values), chosen


class Choice:
    """Chooses lines of a family.

    Parameters
    ----------
    family : Family
    """

    def __init__(self, family: Family):
        self.family = family
        places = [_places(family, band) for band in family.bands]
        weight = 1.0 / max(sum(int(np.isfinite(p[:, :, 0]).sum()) for p in places), 1)
        self._costs = [
            _costs(band, p, weight) for band, p in zip(family.bands, places, strict=True)
        ]
        self._known: dict[int, tuple[Ints, float] | None] = {}
        self._far: dict[bytes, float] = {}
        self._twist, self._width = twist(family)

    def narrower(self, widest: float) -> Choice:
        """Return the choice among strips that are at most so wide."""
        other = copy(self)
        other._costs = [costs.narrower(widest) for costs in self._costs]
        other._known, other._far = {}, {}
        return other

    @property
    def least(self) -> int:
        """The smallest number of strips."""
        return sum(3 if band.closed else 1 for band in self.family.bands)

    @property
    def rows(self) -> int:
        """The largest number of strips."""
        return sum(len(band.rows) for band in self.family.bands)

    def predicted(self, lines: Ints) -> float:
        """Return the distance that was predicted for lines that were chosen."""
        return self._far[lines.tobytes()]

    def lines(self, count: int) -> tuple[Ints, float] | None:
        """Return the lines for a number of strips, and the predicted distance; None without any."""
        if count not in self._known:
            self._known[count] = self._chosen(count)
        return self._known[count]

    def rank(self, count: int) -> float:
        """Return the predicted distance with that of rulings which are not conjugate to the lines.

        It orders families; the first part alone is nearer to what is reached.
        """
        found = self.lines(count)
        far = np.inf if found is None else found[1]
        return float(np.hypot(far, self._twist * (self._width / count) ** 2 / 8.0))

    def _chosen(self, count: int) -> tuple[Ints, float] | None:
        total, chosen = np.array([0.0]), [np.empty(0, np.int64)]
        for costs, band in zip(self._costs, self.family.bands, strict=True):
            values, lines = costs.best(count)
            if band.closed:
                # Rulings around a closed band need three different creases at least.
                values[:2] = np.inf
                lines = [np.r_[band.lines[-1:], own] for own in lines]
            # Entry i has i strips more than bands.
            both = total[:, None] + values[None]
            new, picks = [], []
            for strips in range(len(total) + len(values) - 1):
                i = np.arange(max(0, strips - len(values) + 1), min(strips, len(total) - 1) + 1)
                at = i[int(both[i, strips - i].argmin())]
                new.append(both[at, strips - at])
                picks.append(np.r_[chosen[at], lines[strips - at]])
            total, chosen = np.array(new), picks
        place = count - len(self._costs)
        if not 0 <= place < len(total) or not np.isfinite(total[place]):
            return None
        picked = np.sort(chosen[place])
        far = float(total[place] ** (1.0 / _POWER))
        self._far[picked.tobytes()] = far
        return picked, far


def _costs(band: Band, places: Array, weight: float) -> _Costs:
    """Return the costs of the strips of a band, on some of its levels if there are many."""
    lines = np.r_[-1, band.lines[: len(band.rows) - 1], -1]
    if band.closed:
        lines[[0, -1]] = band.lines[-1]
    levels = np.unique(np.linspace(0, len(lines) - 1, min(len(lines), _LEVELS)).round().astype(int))
    places = places[levels]
    return _Costs(lines[levels], weight * _sagittas(places), places)


def _places(family: Family, band: Band) -> Array:
    """Return positions (levels, columns, 3) on a band; not a number where there are none."""
    mesh, he = family.mesh, family.mesh.half_edges
    number = np.full(int(family.row.max()) + 1, -1)
    number[band.rows] = np.arange(len(band.rows))
    k = he.interior
    edge = family.edge[k]
    at = number[family.row[he.face[k]]]
    kept = family.is_ruling[edge] & (at >= 0)
    k, edge, at = k[kept], edge[kept], at[kept]
    # Boundary edges across the strips count, too.
    rim = np.flatnonzero((he.twin < 0) & ~family.lengthwise)
    rim = rim[number[family.row[he.face[rim]]] >= 0]
    k, edge = np.r_[k, rim], np.r_[edge, family.edge[rim]]
    at = np.r_[at, number[family.row[he.face[rim]]]]
    ends = np.stack([he.origin[k], he.dest[k]], axis=1)
    # Which end is at the lower level: the one on the line before, by the lines of the faces.
    upper = _at_upper(family, band, k, at)
    low = np.where(upper, ends[:, 1], ends[:, 0])
    high = np.where(upper, ends[:, 0], ends[:, 1])
    where = np.full(len(mesh.edges), -1)
    where[edge] = at
    _, one, two = family.triples
    inside = (where[one] >= 0) & (where[two] >= 0) & (np.abs(where[one] - where[two]) == 1)
    label = topology.label_components(len(mesh.edges), one[inside], two[inside])[edge]
    names, column = np.unique(label, return_inverse=True)
    out = np.full((len(band.rows) + 1, len(names), 3), np.nan)
    out[at, column] = mesh.vertices[low]
    out[at + 1, column] = mesh.vertices[high]
    step = max(len(names) // _COLUMNS, 1)
    return out[:, ::step]


def _at_upper(family: Family, band: Band, k: Ints, at: Ints) -> Flags:
    """Return whether the first vertex of half-edges (k,) is on the upper line of their row."""
    he = family.mesh.half_edges
    line = family.line[family.edge]
    # The half-edges before and after one across a strip lie along it.
    before, after = line[he.prev[k]], line[he.next[k]]
    n = len(band.rows)
    upper = np.full(n, -2)
    upper[: len(band.lines)] = band.lines
    lower = np.full(n, -2)
    lower[1:] = band.lines[: n - 1]
    if band.closed:
        lower[0] = band.lines[-1]
    above, below = upper[at], lower[at]
    # In a row at the end of a band the other side may be any line, or the boundary.
    return np.asarray(
        np.where(above != -2, (before == above) & (after != above), (after == below) & (below >= 0))
    )


def _sagittas(places: Array) -> Array:
    """Return the sum of powers of sagittas between each two levels, (n + 1, n + 1).

    Lines across that begin or end between two levels count with the part that is there.
    """
    n, columns = places.shape[:2]
    out = np.zeros((n, n))
    for i in range(n - 2):
        own = places[i:]
        there, level, every = np.isfinite(own[:, :, 0]), np.arange(n - i), np.arange(columns)
        p = own[there.argmax(axis=0), every]
        last = np.maximum.accumulate(np.where(there, level[:, None], 0), axis=0)
        way, off = own[last, every] - p, own - p
        # Axes: the second of two levels, a level between them, a line across.
        dot = np.einsum("jcd,lcd->jlc", way, off)
        size = np.maximum(np.einsum("jcd,jcd->jc", way, way), 1e-300)[:, None]
        share = np.clip(dot / size, 0.0, 1.0)
        square = np.einsum("lcd,lcd->lc", off, off) + share * (share * size - 2.0 * dot)
        between = (level > 0) & (level < level[:, None])
        square = np.where(between[:, :, None], np.maximum(square, 0.0), 0.0)
        out[i, i:] = np.nansum(square ** (_POWER // 2), axis=(1, 2))
    return np.where(np.tri(n, dtype=bool), np.inf, out)
