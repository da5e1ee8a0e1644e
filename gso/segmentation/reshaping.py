"""Seams of a design whose shape may change: as few cuts as a distance and a strain allow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from gso import metrics
from gso.mesh.paths import Paths
from gso.result import Result
from gso.seams.pieces import Pieces
from gso.segmentation.candidates import Candidate, cuts, joined, measured, neck_of
from gso.segmentation.options import Wishes
from gso.segmentation.potential import Potential
from gso.segmentation.tree import Ground
from gso.tasks.developable import Options
from gso.tno import optimize
from gso.tno.layout import strains_of

#: Bound on the estimated strain of the first cuts, the factor between attempts, and the ratio of a
#: bound that is too large to one that is not at which the search ends.
_FIRST, _STEP, _CLOSE = 0.04, 1.5, 1.1
#: Smallest bound on the estimated strain.
_LEAST = 2e-3
#: Factor on the weight of curvature where the distance is kept and the strain is not.
_STRONGER = 4.0


@dataclass(frozen=True)
class _Attempt:
    """A solve of one cut; `excess` is the larger of distance and strain over what is allowed."""

    level: float
    result: Result
    pieces: Pieces
    excess: float


def reshaped(ground: Ground, wishes: Wishes) -> tuple[Candidate, Result]:
    """Search for the fewest cuts whose pieces become developable within the allowed distance."""
    allowed = np.inf if wishes.max_deviation is None else wishes.max_deviation
    tried: list[_Attempt] = []
    for level in _levels(tried):
        wishes.say(f"seams and shape, attempt {len(tried) + 1}")
        cut_open = cuts(ground, wishes, level)
        tried.append(_attempt(ground, cut_open, level, allowed, wishes.max_strain))
    best = min(
        tried,
        key=lambda a: (
            max(a.excess, 1.0),
            *wishes.value(len(a.pieces), a.pieces.seam_length),
        ),
    )
    shape = best.pieces
    surface = replace(
        ground, mesh=shape.design, potential=Potential(shape.design), paths=Paths(shape.design)
    )
    found = measured(surface, shape, wishes.max_size, wishes.say)
    if wishes.darts and found.strain <= wishes.max_strain:
        found = joined(
            surface,
            found,
            wishes.max_strain,
            neck_of(ground, wishes),
            wishes.max_size,
            wishes.say,
        )
    return found, best.result


def _levels(tried: list[_Attempt]) -> Iterator[float]:
    """Yield the bound on the estimated strain of the next attempt, by bisection."""
    level = _FIRST
    for _ in range(12):
        yield level
        good = [a.level for a in tried if a.excess <= 1.0]
        bad = [a.level for a in tried if a.excess > 1.0]
        if not bad:
            if not len(tried[-1].pieces.edges):
                return
            level *= _STEP
        elif not good:
            level /= _STEP
            if level < _LEAST:
                return
        else:
            above = [b for b in bad if b > max(good)]
            if not above or min(above) < _CLOSE * max(good):
                return
            level = float(np.sqrt(max(good) * min(above)))


def _attempt(
    ground: Ground, cut_open: Pieces, level: float, allowed: float, strain: float
) -> _Attempt:
    best: _Attempt | None = None
    options = Options().for_pieces()
    for factor in (1.0, _STRONGER):
        chosen = replace(options, w_curvature=factor * options.w_curvature)
        result = optimize(cut_open, options=chosen, verdict=False)
        shape = cut_open if result.pieces is None else result.pieces
        away = metrics.surface_distance(ground.mesh, shape.design)
        far = max(away.there_max, away.back_max) / allowed
        excess = far
        if far <= 1.0:
            measured_strain = strains_of(result.mesh).get("strain_p99", np.inf)
            excess = max(far, measured_strain / strain)
        attempt = _Attempt(level, result, shape, excess)
        if best is None or excess < best.excess:
            best = attempt
        if far > 1.0 or excess <= 1.0:
            break
    return attempt if best is None else best
