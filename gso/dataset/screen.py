"""Selection of random draws so that given intervals of curvature and shape are filled.

Features (Wang et al. 2024, Eq. 1 and 2) are computed from 64 x 64 samples in the unit ball:
the means K_P, K_N, K_A of positive, negative and absolute Gaussian curvature, and the
variance sigma^2 of the boundary lengths. Each cell of :data:`CURVATURE` times :data:`SHAPE`
accepts draws in order until it has its share of the set; with these shares the mean K_A is
the published 0.307. With the strata "features" cells are also divided by :data:`BALANCE`, the
positive share K_P / K_A. As K_A is K_P - K_N, this gives every interval of K_P and of K_N its
share, too. Draws beyond the last intervals form the separate split "hard".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gso import geometry, metrics
from gso.dataset.bezier import BezierSurface, boundary_length_variance, draw, sample_many
from gso.dataset.seeds import Stream, generator
from gso.errors import DatasetError
from gso.typing import Array, Flags, Ints

FEATURES = ("K_P", "K_N", "K_A", "sigma2")
#: Samples along a side for the features, independent of the size of the set's grids.
SIZE = 64
#: Intervals of K_A and of sigma^2, and the share of the set in each. The shares are close to
#: those of unscreened draws, where K_A and sigma^2 are almost independent.
CURVATURE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
CURVATURE_SHARES = (0.18, 0.20, 0.19, 0.13, 0.10, 0.08, 0.05, 0.04, 0.03)
SHAPE = (0.0, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5)
SHAPE_SHARES = (0.24, 0.25, 0.19, 0.13, 0.11, 0.08)
#: Intervals of K_P / K_A and their shares, for the strata "features": close to the quartiles of
#: unscreened draws, and six percent at either end, mostly negative or mostly positive K.
BALANCE = (0.0, 0.1, 0.24, 0.39, 0.53, 0.67, 1.0)
BALANCE_SHARES = (0.06, 0.19, 0.25, 0.25, 0.19, 0.06)
#: What a set is stratified by: K_A and sigma^2, or K_P, K_N, K_A and sigma^2.
STRATA = ("curvature", "features")
#: Kinds of hard draws, a third of the split each. Curved: K_A up to the published limit on
#: the sum of |K| (15000 over 62 x 62 vertices). Wild: K_A above it. Uneven: only sigma^2 is
#: large.
HARD = ("curved", "wild", "uneven")
CURVED = 15000.0 / 62**2

_GOLDEN = (5**0.5 - 1) / 2

#: Number of draws evaluated together.
_BLOCK = 256
# Smallest doubled area of a cell; the threshold of a mesh is a hundredth of that.
_SMALLEST_CELL = 1e-12


@dataclass(frozen=True)
class Selection:
    """The draws that make a set.

    Attributes
    ----------
    main, hard : ndarray of int
        Numbers of the draws. `main` is ordered such that every contiguous range has its share
        of each cell, and is random otherwise; `hard` is increasing.
    drawn : int
        Number of draws evaluated.
    """

    main: Ints
    hard: Ints
    drawn: int


def surface(seed: int, number: int) -> BezierSurface:
    """Return the draw with this number of a seed."""
    return draw(generator(seed, Stream.DRAWS, number))


def features(points: Array) -> Array:
    """Compute K_P, K_N, K_A, sigma^2 of grids (b, H, W, 3) in the unit ball, as (b, 4)."""
    return np.array(
        [(*metrics.curvature_features(p, scale=1.0), boundary_length_variance(p)) for p in points]
    ).reshape(-1, len(FEATURES))


def select(
    count: int,
    hard: int,
    *,
    seed: int,
    strata: str = "curvature",
    tick: Callable[[int, int], None] | None = None,
) -> Selection:
    """Draw surfaces until every cell and every kind of hard draw has its share.

    Parameters
    ----------
    count, hard : int
        Number of surfaces of the set, and of the hard split.
    seed : int
        Seed of the draws.
    strata : {"curvature", "features"}
        Features whose intervals make the cells; see :data:`STRATA`.
    tick : callable, optional
        Progress callback, called with the number of selected surfaces and the total number.

    Examples
    --------
    >>> selection = select(10, 3, seed=0)
    >>> len(set(selection.main) | set(selection.hard))
    13
    """
    room = np.r_[quotas(count, strata), _rounded(np.full(len(HARD), 1.0 / len(HARD)), hard)]
    cells = len(room) - len(HARD)
    kept: list[Ints] = []
    cell_of: list[Ints] = []
    wanted, start = int(room.sum()), 0
    if tick is not None:
        tick(0, wanted)
    while room.any():
        if start > 10_000 * (wanted + 100):
            raise DatasetError(f"{start} draws of seed {seed} did not fill the intervals")
        numbers = np.arange(start, start + _BLOCK)
        points = sample_many([surface(seed, int(k)) for k in numbers], SIZE)
        good = np.flatnonzero(sound(points))
        cell = _cell(features(points[good]), strata)
        taken = _rank(cell) < room[cell]
        room -= np.bincount(cell[taken], minlength=len(room))
        kept.append(numbers[good[taken]])
        cell_of.append(cell[taken])
        start += _BLOCK
        if tick is not None:
            tick(wanted - int(room.sum()), wanted)
    draws, where = np.concatenate(kept), np.concatenate(cell_of)
    main = where < cells
    order = _spread(where[main], generator(seed, Stream.SPLIT))
    return Selection(draws[main][order], draws[~main], start)


def quotas(count: int, strata: str = "curvature") -> Ints:
    """Return the number of surfaces per cell, row by row.

    Rows are intervals of K_A, then of sigma^2, then, for the strata "features", of K_P / K_A.

    >>> int(quotas(10401).sum()), int(quotas(10401).min())
    (10401, 25)
    >>> int(quotas(10401, "features").sum())
    10401
    """
    rows = _rounded(np.array(CURVATURE_SHARES), count)
    room = np.concatenate([_rounded(np.array(SHAPE_SHARES), row) for row in rows])
    return _carried(np.array(BALANCE_SHARES), room) if strata == "features" else room


def _carried(shares: Array, rows: Ints) -> Ints:
    """Divide each row by the shares; what rounding leaves is carried to the rows after it.

    Most cells have few surfaces, so that rounding each row alone would change the shares.
    """
    out, left = [], np.zeros(len(shares))
    for row in rows:
        left = left + row * shares
        part = np.zeros(len(shares), np.int64)
        for _ in range(row):
            part[np.argmax(left - part)] += 1
        left = left - part
        out.append(part)
    return np.concatenate(out)


def _spread(cell: Ints, rng: np.random.Generator) -> Ints:
    """Return an order in which every range has its share of each cell, random within cells."""
    shuffled = rng.permutation(len(cell))
    by_cell = shuffled[np.argsort(cell[shuffled], kind="stable")]
    # Multiples of the golden ratio modulo one are evenly spread. Sorting by them therefore
    # spreads consecutive entries evenly over the list sorted by cell.
    return by_cell[np.argsort(np.arange(len(cell)) * _GOLDEN % 1.0)]


def _rounded(shares: Array, count: int) -> Ints:
    """Round `count` times the shares, which sum to one, to integers (largest remainders)."""
    exact = shares * count
    whole = np.floor(exact).astype(np.int64)
    most = np.argsort(whole - exact, kind="stable")
    whole[most[: count - whole.sum()]] += 1
    return whole


def sound(points: Array) -> Flags:
    """Tell which grids are finite and have no degenerate cell."""
    a = metrics.components(points[:, 1:, 1:] - points[:, :-1, :-1])
    b = metrics.components(points[:, :-1, 1:] - points[:, 1:, :-1])
    normal = np.stack(geometry.cross(a, b), axis=-1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt((normal**2).sum(axis=-1)).min(axis=(1, 2)) > _SMALLEST_CELL)


def _cell(values: Array, strata: str) -> Ints:
    """Return the cell of each row of features; kinds of hard draws are numbered last."""
    k, s = values[:, FEATURES.index("K_A")], values[:, FEATURES.index("sigma2")]
    rows = np.searchsorted(CURVATURE[1:-1], k)
    columns = np.searchsorted(SHAPE[1:-1], s)
    first = len(CURVATURE_SHARES) * len(SHAPE_SHARES)
    out = rows * len(SHAPE_SHARES) + columns
    if strata == "features":
        positive = values[:, FEATURES.index("K_P")] / np.maximum(k, 1e-300)
        first *= len(BALANCE_SHARES)
        out = out * len(BALANCE_SHARES) + np.searchsorted(BALANCE[1:-1], positive)
    out = np.where(s > SHAPE[-1], first + HARD.index("uneven"), out)
    out = np.where(k > CURVATURE[-1], first + HARD.index("curved"), out)
    return np.where(k > CURVED, first + HARD.index("wild"), out)


def _rank(cell: Ints) -> Ints:
    """Count, for each entry, the preceding entries with the same value."""
    order = np.argsort(cell, kind="stable")
    ordered = cell[order]
    rank = np.empty_like(cell)
    rank[order] = np.arange(len(cell)) - np.searchsorted(ordered, ordered)
    return rank
