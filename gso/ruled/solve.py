"""From a design to a ruled surface: starts, number of strips, and the choice of the best."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso.ruled.chords import chords
from gso.ruled.conditions import Conditions
from gso.ruled.descent import Stopped, Tell
from gso.ruled.domain import Domain
from gso.ruled.extended import Extended
from gso.ruled.ruled_surface import RuledSurface, built
from gso.ruled.sheet_division import without_overlaps
from gso.ruled.strip_fit import Fit, Job, evened, halved, refined, single
from gso.typing import Array, Ints

#: Points of the design in the solve for one strip and for several.
_POINTS = (500, 1000)
#: Number of quads of a strip in the first solve.
_COARSE = 16
#: Cost of a flat triangle in the first rulings.
_FLAT = 1e-5
#: Number of strips from which doubling has to lower the largest distance, to this share of it.
_PAYING, _LESS = 8, 0.95
#: Number of strips from which the trend of the largest distance counts, and the share of it that
#: doubling leaves at best: sagittas fall with the square of the width.
_TREND, _QUARTER = 4, 0.25
#: Relative tolerance of a bound on the distance.
_TIGHT = 1e-6


@dataclass(frozen=True)
class Wanted:
    """What a ruled surface has to be; lengths relative to the design's diagonal.

    Attributes
    ----------
    strips : int or None
        Number of strips side by side; None for as few as meet the bounds.
    rulings : int
        Rulings of a strip, beyond the outline included.
    flats : bool
        Whether a single strip may branch at flat triangles.
    max_deviation : float or None
        Largest distance between design and surface, in both directions.
    max_crease : float or None
        Largest angle at a crease, in radians.
    min_radius : float or None
        Smallest radius of a bend.
    most : int
        Largest number of strips that is tried.
    """

    strips: int | None
    rulings: int
    flats: bool
    max_deviation: float | None
    max_crease: float | None
    min_radius: float | None
    most: int

    @property
    def bounded(self) -> bool:
        """Whether there are bounds."""
        bounds = (self.max_deviation, self.max_crease, self.min_radius)
        return any(bound is not None for bound in bounds)

    def met(self, surface: RuledSurface) -> bool:
        """Return whether a measured surface is sound and meets the bounds.

        It must not be pleated where the number of strips is to be found.
        """
        far, turn, radius = self.max_deviation, self.max_crease, self.min_radius
        return (
            surface.sound
            and not (surface.pleated and self.strips is None)
            and (radius is None or surface.rulings.smallest_radius >= radius)
            and (far is None or surface.farthest <= far * (1.0 + _TIGHT))
            and (turn is None or surface.creases.largest_angle <= turn)
        )


@dataclass(frozen=True)
class Found:
    """A ruled surface and its distance from the design, relative to the design's diagonal.

    Attributes
    ----------
    surface : RuledSurface
    mean : float
        Mean distance, the larger of both directions.
    start : str
        Name of the normals that the first rulings came from.
    divided : bool
        Whether strips are divided across, as they overlap themselves in the plane otherwise.
    """

    surface: RuledSurface
    mean: float
    start: str
    divided: bool = False

    @classmethod
    def of(cls, surface: RuledSurface, start: str, *, divided: bool = False) -> Found:
        """Return a measured surface with its mean distance."""
        far = surface.deviation
        return cls(surface, 0.0 if far is None else far.mean, start, divided)

    @property
    def ends(self) -> Array:
        """Ends of the rulings before trimming."""
        source = self.surface.untrimmed
        return self.surface.mesh.vertices if source is None else source.vertices

    @property
    def order(self) -> tuple[int, float]:
        """Sort key: surfaces with fewer flaws first, then by distance."""
        return self.surface.flaws, self.mean + 0.2 * self.surface.farthest


def solve(
    domain: Domain,
    starts: dict[str, Array],
    wanted: Wanted,
    tell: Tell | None = None,
    conditions: Conditions = Conditions(),  # noqa: B008
) -> tuple[Found | None, dict[int, float]]:
    """Fit a ruled surface to a design with a diagonal of one.

    Parameters
    ----------
    domain : Domain
        The design over its flat image.
    starts : dict of str to ndarray
        Unit normals (n, 3) of surfaces near the design, along which first rulings are found;
        the best result counts.
    wanted : Wanted
        Strips, rulings and bounds.
    tell : callable, optional
        Told each iteration; see :data:`gso.ruled.descent.Tell`.
    conditions : Conditions, optional
        What the surface has to satisfy.

    Returns
    -------
    found : Found or None
        None if `tell` ended the solve before there was a surface.
    tried : dict of int to float
        Largest distance by number of strips, for all numbers that were tried.
    """
    target = Extended(domain)
    jobs = []
    for count in _POINTS:
        points = domain.lattice(count)
        if conditions.mirror is not None:
            points = np.concatenate([points, conditions.mirror.image(points)])
        jobs.append(Job(target, points, tell=tell, conditions=conditions))
    # The nearest single strip need not be the one whose halves are the nearest.
    alone = wanted.strips is not None and wanted.strips > 1
    groups = [{name: normals} for name, normals in starts.items()] if alone else [starts]
    searches = [_Search(jobs, wanted) for _ in groups]
    with contextlib.suppress(Stopped):
        for search, group in zip(searches, groups, strict=True):
            search.run(group)
    every = [search.best for search in searches if search.best is not None]
    best = min(every, key=lambda f: (f.surface.strips != wanted.strips, f.order), default=None)
    tried: dict[int, float] = {}
    for search in searches:
        for k, f in search.results.items():
            tried[k] = min(f.surface.farthest, tried.get(k, np.inf))
    return best, tried


class _Search:
    """The fits, and the surfaces made of them, by number of strips."""

    def __init__(self, jobs: Sequence[Job], wanted: Wanted):
        self.jobs, self.wanted = jobs, wanted
        self.fits: dict[int, Fit] = {}
        self.results: dict[int, Found] = {}
        self.start = ""

    @property
    def best(self) -> Found | None:
        """The wanted number of strips, the smallest that meets the bounds, or the nearest."""
        results, wanted = self.results, self.wanted
        met = [k for k in sorted(results) if wanted.met(results[k].surface)]
        if wanted.strips in results:
            return results[wanted.strips]
        if wanted.strips is None and met:
            return results[met[0]]
        every = results.values()
        return min(every, key=lambda f: (f.surface.flaws, f.surface.farthest), default=None)

    def run(self, starts: dict[str, Array]) -> None:
        """Fit one strip from each start, and halve strips until the bounds are met."""
        wanted, (one, job) = self.wanted, self.jobs
        for name, normals in starts.items():
            fit = _first(one, normals, wanted)
            found = self._found(one, fit, name)
            if 1 not in self.results or found.order < self.results[1].order:
                self.fits[1], self.results[1], self.start = fit, found, name
        fewer, count, most = 0, 1, wanted.strips or wanted.most
        while count < most and not self._enough(count):
            more = min(2 * count, most)
            fit = self.fits[count]
            self.fits[more] = halved(job, fit, _worst(job, fit, more - count))
            fewer, count = count, more
            if wanted.strips is None or count == most:
                self.results[count] = self._found(job, self.fits[count], self.start)
        if wanted.strips is None and wanted.met(self.results[count].surface):
            self._bisect(job, fewer, count)

    def _enough(self, count: int) -> bool:
        """Return whether there are enough strips, or more of them are of no use."""
        if self.wanted.strips is not None:
            return False
        found = self.results[count].surface
        paying = count <= _PAYING or found.farthest <= _LESS * self._far(count // 2)
        return self.wanted.met(found) or not paying or self._out_of_reach(count)

    def _far(self, count: int) -> float:
        return self.results[count].surface.farthest

    def _out_of_reach(self, count: int) -> bool:
        """Return whether the largest number of strips is too far away by the trend of distances.

        The trend is what doubling gains at best, and later what it gained the last two times.
        """
        wanted, share = self.wanted, _QUARTER
        if count < _TREND or wanted.max_deviation is None:
            return False
        if count > _PAYING:
            share = max(share, float(np.sqrt(self._far(count) / self._far(count // 4))))
        forecast = self._far(count) * share ** np.log2(wanted.most / count)
        return bool(forecast > wanted.max_deviation)

    def _bisect(self, job: Job, fewer: int, count: int) -> None:
        """Bisect between a number of strips that was too few, and one that is enough."""
        base, low, high = fewer, fewer, count
        while high - low > 1:
            middle = (low + high) // 2
            fit = halved(job, self.fits[base], _worst(job, self.fits[base], middle - base))
            self.results[middle] = self._found(job, fit, self.start)
            if self.wanted.met(self.results[middle].surface):
                high = middle
            else:
                low = middle

    def _found(self, job: Job, fit: Fit, start: str) -> Found:
        """Lower the largest distance of a fit, and measure the surface that it is."""
        design = job.target.domain.mesh
        whole = surface = built(job, evened(job, fit))
        if job.conditions.mirror is None:
            surface = without_overlaps(whole, design)
        return Found.of(surface.measured(design), start, divided=surface is not whole)


def _first(job: Job, normals: Array, wanted: Wanted) -> Fit:
    """Fit a single strip, before its largest distance is lowered."""
    domain = job.target.domain
    quads = wanted.rulings - 1
    rounds = max(int(np.ceil(np.log2(quads / _COARSE))), 0)
    flat = _FLAT if wanted.flats else None
    strips, places = chords(
        domain.with_normals(normals),
        round(quads / 2**rounds) + 1,
        flat,
        job.conditions.chords,
    )
    start = domain.points(places)
    if job.conditions.mirror is not None:
        start = job.conditions.mirror.arranged(strips.index[0], start)
    fit = single(job, strips, start)
    for _ in range(rounds):
        fit = refined(job, fit)
    return fit


def _worst(job: Job, fit: Fit, count: int) -> Ints | None:
    """Return the numbers of the strips with the largest distances; None for all of them."""
    if count >= fit.strips.count:
        return None
    measured = job.energy(fit.strips, fit.vertices, fit.width).measure(fit.vertices)
    face = fit.strips.split[1][measured.triangle]
    far = np.zeros(fit.strips.count)
    np.maximum.at(far, fit.strips.column[face], np.abs(measured.height))
    return np.sort(np.argsort(-far)[:count])
