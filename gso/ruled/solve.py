"""From a design to a ruled surface: starts, number of strips, and the choice of the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso.ruled.chords import chords
from gso.ruled.domain import Domain
from gso.ruled.extended import Extended
from gso.ruled.fit import Fit, Job, evened, halved, refined, single
from gso.ruled.surface import RuledSurface, built
from gso.typing import Array, Ints

#: Points of the design in the solve for one strip and for several.
_POINTS = (500, 1000)
#: Number of quads of a strip in the first solve.
_COARSE = 16
#: Cost of a flat triangle in the first rulings.
_FLAT = 1e-5
#: Largest number of strips that are tried.
MOST = 64
#: Number of strips from which doubling has to lower the largest distance, to this share of it.
_PAYING, _LESS = 8, 0.95
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
    """

    strips: int | None = 1
    rulings: int = 33
    flats: bool = False
    max_deviation: float | None = None
    max_crease: float | None = None

    def met(self, found: Found) -> bool:
        """Return whether a surface is sound and meets the bounds."""
        far, turn = self.max_deviation, self.max_crease
        return (
            found.surface.sound
            and (far is None or found.deviation <= far * (1.0 + _TIGHT))
            and (turn is None or found.surface.creases.largest_angle <= turn)
        )


@dataclass(frozen=True)
class Found:
    """A ruled surface and its distance from the design, relative to the design's diagonal.

    Attributes
    ----------
    surface : RuledSurface
    mean, deviation : float
        Mean and largest distance; the larger of both directions each.
    start : str
        Name of the normals that the first rulings came from.
    """

    surface: RuledSurface
    mean: float
    deviation: float
    start: str

    @property
    def order(self) -> tuple[bool, float]:
        """Sort key: sound surfaces first, then by distance."""
        return not self.surface.sound, self.mean + 0.2 * self.deviation


def solve(
    domain: Domain, starts: dict[str, Array], wanted: Wanted
) -> tuple[Found, dict[int, float]]:
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

    Returns
    -------
    found : Found
    tried : dict of int to float
        Largest distance by number of strips, for all numbers that were tried.
    """
    target = Extended(domain)
    jobs = [Job(target, domain.lattice(count)) for count in _POINTS]
    first = {name: _first(jobs[0], normals, wanted) for name, normals in starts.items()}
    if wanted.strips == 1:
        found = min((_found(jobs[0], evened(jobs[0], f), n) for n, f in first.items()), key=_order)
        return found, {1: found.deviation}
    return _several(jobs, first, wanted)


def _order(found: Found) -> tuple[bool, float]:
    return found.order


def _first(job: Job, normals: Array, wanted: Wanted) -> Fit:
    """Fit a single strip, before its largest distance is lowered."""
    domain = job.target.domain
    quads = wanted.rulings - 1
    rounds = max(int(np.ceil(np.log2(quads / _COARSE))), 0)
    flat = _FLAT if wanted.flats else None
    strips, places = chords(domain.with_normals(normals), round(quads / 2**rounds) + 1, flat)
    fit = single(job, strips, domain.points(places))
    for _ in range(rounds):
        fit = refined(job, fit)
    return fit


def _found(job: Job, fit: Fit, start: str) -> Found:
    surface = built(job, fit)
    far = surface.distances(job.target.domain.mesh)
    return Found(
        surface,
        max(far.there_mean, far.back_mean),
        max(far.there_max, far.back_max),
        start,
    )


def _several(
    jobs: Sequence[Job], first: dict[str, Fit], wanted: Wanted
) -> tuple[Found, dict[int, float]]:
    """Halve strips until their number, or the bounds, are reached."""
    one, job = jobs
    ranked = {name: _found(one, evened(one, fit), name) for name, fit in first.items()}
    name = min(ranked, key=lambda n: ranked[n].order)
    fits, results = {1: first[name]}, {1: ranked[name]}
    count = 1
    most = wanted.strips or MOST
    while count < most and not (wanted.strips is None and wanted.met(results[count])):
        more = min(2 * count, most)
        fits[more] = halved(job, fits[count], _worst(job, fits[count], more - count))
        count = more
        if wanted.strips is None or count == most:
            results[count] = _found(job, evened(job, fits[count]), name)
        if wanted.strips is None and count > _PAYING and _useless(results, count):
            break
    best = results[count]
    if wanted.strips is None and wanted.met(best):
        best = _fewest(job, fits, results, count, wanted, name)
    elif wanted.strips is None:
        best = min(results.values(), key=lambda f: (not f.surface.sound, f.deviation))
    return best, {k: f.deviation for k, f in results.items()}


def _useless(results: dict[int, Found], count: int) -> bool:
    """Return whether twice as many strips did not lower the largest distance."""
    return results[count].deviation > _LESS * results[count // 2].deviation


def _fewest(
    job: Job, fits: dict[int, Fit], results: dict[int, Found], count: int, wanted: Wanted, name: str
) -> Found:
    """Bisect between half a number of strips, which was too few, and that number."""
    base = low = count // 2
    high = count
    while high - low > 1:
        middle = (low + high) // 2
        fit = halved(job, fits[base], _worst(job, fits[base], middle - base))
        results[middle] = _found(job, evened(job, fit), name)
        if wanted.met(results[middle]):
            high = middle
        else:
            low = middle
    return results[high]


def _worst(job: Job, fit: Fit, count: int) -> Ints | None:
    """Return the numbers of the strips with the largest distances; None for all of them."""
    if count >= fit.strips.count:
        return None
    measured = job.energy(fit.strips, fit.vertices, fit.width).measure(fit.vertices)
    face = fit.strips.split[1][measured.triangle]
    far = np.zeros(fit.strips.count)
    np.maximum.at(far, fit.strips.column[face], np.abs(measured.height))
    return np.sort(np.argsort(-far)[:count])
