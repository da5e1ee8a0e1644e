"""The solve for strips of planar quads near a design.

The unknowns are the ends of the rulings. First the quads are made planar by a growing penalty,
then exactly: steps are tangential to the planar strips, and Newton's method leads back to these.
Ends of rulings that are close to each other are merged. A last phase lowers the largest distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gso.geometry.vectors import lengths
from gso.ruled.conditions import Conditions
from gso.ruled.descent import Tell, descend, planarised
from gso.ruled.extended import Extended
from gso.ruled.strip_energy import Energy
from gso.ruled.strip_layout import Strips
from gso.ruled.strip_weights import Weights
from gso.typing import Array, Ints

#: Phases of a single strip: weights of `moved` and `planar`.
_PENALTIES = ((1e-3, 0.1), (1e-4, 1.0), (1e-5, 10.0), (1e-6, 100.0))
#: Weight of `moved` among planar strips.
_MOVED = 1e-7
#: Largest number of iterations of each penalty, of planar strips, and of each power.
_PENALISED, _EXACT, _EACH = 6, 15, 8
#: Powers of the distance in the last phase, for one strip and for several.
_POWERS = {True: (4.0, 8.0), False: (4.0,)}
#: Weights by which points that strips pass through are met in the end.
_HOLDS = (1e5, 1e7)
#: Weights of the smallest radius in the end.
_RADII = (1.0, 100.0)
#: Ends of rulings are merged when their gap is below this multiple of the least one.
_MERGED = 1.7
#: Root mean square distance below which other terms lose weight; rounds of that, the largest
#: number of iterations in each, and the relative decrease of the energy at which it ends.
_CLOSE, _ROUNDS, _POLISH, _TIGHT = 1.4e-3, 6, 20, 1e-8
#: Number of times that strips are fitted again after ends were merged, and the gap at which these
#: block the way, relative to the least one.
_AGAIN, _TOUCHING = 3, 0.3
#: Rounds of merging ends of rulings that cross.
_MENDED = 3
#: Weights that differ from the usual ones when there are several strips.
_EVEN = 1e-4


@dataclass(frozen=True)
class Fit:
    """Strips near a design whose diagonal is one.

    Attributes
    ----------
    strips : Strips
        The layout.
    vertices : ndarray, (n, 3)
        Ends of the rulings, beyond the outline of the design.
    width : float
        Mean width of the faces.
    """

    strips: Strips
    vertices: Array
    width: float


class Job(NamedTuple):
    """What all phases share: target, points of the design, weights, who is told, conditions."""

    target: Extended
    points: Array
    weights: Weights = Weights()
    tell: Tell | None = None
    conditions: Conditions = Conditions()

    def energy(self, strips: Strips, start: Array, width: float | None = None) -> Energy:
        """Make the energy of a layout."""
        return Energy(self.target, strips, start, self.points, width, self.conditions)


def single(job: Job, strips: Strips, start: Array) -> Fit:
    """Fit strips from first rulings (n, 3) that are not planar."""
    energy, vertices = job.energy(strips, start), start
    for moved, planar in _PENALTIES:
        w = replace(job.weights, moved=moved, planar=planar)
        vertices = descend(energy, vertices, w, _PENALISED, tell=job.tell)
    return _exact(job, _planar(job, Fit(strips, vertices, energy.width), start), _EXACT)


def halved(job: Job, fit: Fit, which: Ints | None = None) -> Fit:
    """Halve strips along their length, all of them or those numbered, and fit again."""
    strips, vertices = fit.strips.halved(fit.vertices, which)
    return _exact(job, Fit(strips, vertices, fit.width), _EXACT)


def refined(job: Job, fit: Fit) -> Fit:
    """Insert rulings half-way between those of a fit, and fit again."""
    strips, vertices = fit.strips.refined(fit.vertices)
    return _exact(job, Fit(strips, vertices, 0.5 * fit.width), _EXACT)


def evened(job: Job, fit: Fit) -> Fit:
    """Lower the largest distance: minimise higher powers of the distances.

    Where strips are close to the design already, other terms get less weight before: a design
    that is ruled is reproduced up to the width of the faces.
    """
    energy, vertices = job.energy(fit.strips, fit.vertices, fit.width), fit.vertices
    full = replace(job.weights, moved=0.0, even=_EVEN)
    w, share = full, 1.0
    for _ in range(_ROUNDS):
        less = float((energy.measure(vertices).height ** 2).mean()) / _CLOSE**2
        if less > 0.5 * share:
            break
        share = less
        w = full.scaled(share)
        vertices = descend(energy, vertices, w, _POLISH, _TIGHT, job.tell)
    for power in _POWERS[fit.strips.count == 1]:
        vertices = descend(energy, vertices, replace(w, power=power), _EACH, tell=job.tell)
    for hold, radius in zip(_HOLDS, _RADII) if job.conditions.closing else ():
        closing = replace(w, power=power, hold=hold, radius=radius)
        vertices = descend(energy, vertices, closing, _EACH, 0.0, job.tell)
    return _uncrossed(job, energy, replace(fit, vertices=planarised(energy.system, vertices)))


def _exact(job: Job, fit: Fit, iterations: int) -> Fit:
    w = replace(job.weights, moved=_MOVED, even=_EVEN)
    for _ in range(_AGAIN):
        energy = job.energy(fit.strips, fit.vertices, fit.width)
        vertices = descend(energy, fit.vertices, w, iterations, tell=job.tell)
        fit = replace(fit, vertices=vertices)
        merged = _uncrossed(job, energy, fit, _TOUCHING)
        if merged is fit:
            break
        fit = merged
    return fit


def _planar(job: Job, fit: Fit, start: Array) -> Fit:
    """Make the quads planar, and merge ends of rulings that are close to each other."""
    energy = job.energy(fit.strips, start, fit.width)
    least = _MERGED * job.weights.least * fit.width
    fit = _merged(fit, close(energy, fit.vertices, least))
    energy = job.energy(fit.strips, fit.vertices, fit.width)
    fit = replace(fit, vertices=planarised(energy.system, fit.vertices))
    return _uncrossed(job, energy, fit)


def _uncrossed(job: Job, energy: Energy, fit: Fit, share: float = 0.0) -> Fit:
    """Merge ends of planar rulings that cross, until none do; the energy is that of the layout.

    With a `share`, also those whose gap is below this share of the least one: they block the way.
    """
    for _ in range(_MENDED):
        pairs = close(energy, fit.vertices, share * job.weights.least * fit.width)
        if not len(pairs):
            break
        fit = _merged(fit, pairs)
        energy = job.energy(fit.strips, fit.vertices, fit.width)
        fit = replace(fit, vertices=planarised(energy.system, fit.vertices))
    return fit


def _merged(fit: Fit, pairs: Ints) -> Fit:
    if not len(pairs):
        return fit
    strips, vertices = fit.strips.merged(fit.vertices, pairs)
    # Rulings that all run into each other cannot be merged.
    return Fit(strips, vertices, fit.width) if strips.is_disk else fit


def close(energy: Energy, vertices: Array, least: float) -> Ints:
    """Return pairs (m, 2) of ends of successive rulings whose gap is below a bound.

    Of faces whose outlines cross themselves, the ends with the smaller distance are taken.
    """
    gap = energy.measure(vertices).gap
    corners = energy.strips.corners
    knot = energy.strips.tangled(vertices)
    apart = lengths(vertices[corners[:, 2:]] - vertices[corners[:, :2]])
    nearer = apart.argmin(axis=1)
    pairs = [
        corners[(gap[:, end] < least) | (knot & (nearer == end))][:, [end, 2 + end]]
        for end in (0, 1)
    ]
    return energy.even_pairs(np.concatenate(pairs))
