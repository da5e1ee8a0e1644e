"""Seams of a design whose shape may change: as few cuts as a distance and a strain allow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from gso import faults, metrics
from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.geometry.plane import Plane
from gso.mesh import Mesh
from gso.pipeline import strains_of
from gso.result import Result
from gso.seams.candidates import Candidate, cuts, joined, measured, neck_of
from gso.seams.crease_lines import faces_between
from gso.seams.edge_rows import rows_or_triangles
from gso.seams.facets import FACETS, facet_ratio
from gso.seams.joint_solve import solve_pieces
from gso.seams.options import PieceSettings
from gso.seams.scaled_search import divided_within
from gso.seams.straight import straightened_pieces
from gso.seams.tree import Ground
from gso.seams.trial import Trial
from gso.seams.wanted import Wanted
from gso.tasks.developable import Options
from gso.tasks.request import Request

#: Number of vertices of a mesh from which on a copy of it is searched.
_MANY = 1000
#: Bound on the estimated strain of the first cuts, the factor between attempts, and the ratio of a
#: bound that is too large to one that is not at which the search ends.
_FIRST, _STEP, _CLOSE = 0.04, 1.5, 1.1
#: Smallest bound on the estimated strain.
_LEAST = 2e-3
#: Factor on the weight of curvature where the distance is kept and the strain is not, and on that
#: of the distance where it is the other way round.
_STRONGER = 4.0
#: Ratio of the distance to its bound up to which a larger weight of it is tried, and how often;
#: the ratio from which the weight grows by the square of the factor.
_HOPELESS, _NEARER, _FAR = 20.0, 6, 4.0
#: Factors on the weights of fairness and curvature where pieces have facets or folds.
_FAIRER = (3.0, 2.0)
#: How often these are tried, and what a folded face adds to the excess.
_FAIR, _FOLD = 2, 0.01


@dataclass(frozen=True)
class _Attempt:
    """A solve of one cut; `excess` is the largest ratio of what was measured to its bound."""

    level: float
    proximity: float
    cut: Pieces
    result: Result | None
    pieces: Pieces
    excess: float


def reshaped(
    ground: Ground, settings: PieceSettings, plane: Plane | None = None
) -> tuple[Candidate, Result | None]:
    """Search for the fewest cuts whose pieces become developable within the allowed distance.

    Parameters
    ----------
    ground : Ground
    settings : PieceSettings
    plane : Plane, optional
        Plane of symmetry of the seams, for designs :func:`at_scale`.
    """
    allowed = settings.allowed
    if at_scale(ground.mesh, settings.max_deviation) and ground.mirror is None:
        trial = _at_scale(ground, settings, plane)
        return _patterns(ground, trial.shape, settings), trial.result
    tried: list[_Attempt] = []
    for level in _levels(tried, len(ground.kept)):
        settings.say(f"seams and shape, attempt {len(tried) + 1}")
        cut_open = cuts(ground, settings, level)
        # An attempt begins with the weight of the distance that the one before ended with.
        begin = tried[-1].proximity / _STRONGER if tried else 1.0
        tried.append(_attempt(ground, cut_open, level, max(begin, 1.0), allowed, settings))
    best = min(
        tried + _along_creases(ground, allowed, settings),
        key=lambda a: (
            max(a.excess, 1.0),
            *settings.value(len(a.pieces), a.pieces.seam_length),
        ),
    )
    best = _with_straight_seams(ground, best, settings, allowed)
    return _patterns(ground, best.pieces, settings), best.result


def _along_creases(ground: Ground, allowed: float, settings: PieceSettings) -> list[_Attempt]:
    """Solve the pieces between the creases of a design, if seams may be anywhere."""
    pieces = None if ground.factor is not None else faces_between(ground.mesh, ground.kept)
    if pieces is None:
        return []
    settings.say("seams along sharp edges")
    return [_attempt(ground, pieces, _FIRST, 1.0, allowed, settings)]


def at_scale(mesh: Mesh, distance: float | None) -> bool:
    """Whether the search runs on a copy at the scale of a distance, if there is one.

    Coarse designs are at that scale.
    """
    return distance is not None and int(mesh.used.sum()) >= _MANY


def _at_scale(ground: Ground, settings: PieceSettings, plane: Plane | None) -> Trial:
    """Search at the scale of the distance; seams of quads follow edges where that is as good."""
    design = ground.mesh
    if not design.is_triangles:
        design = Mesh(design.vertices, design.triangles)
    trial = divided_within(design, settings, Wanted.of(ground), plane)
    if ground.mesh.is_triangles:
        return trial
    return rows_or_triangles(ground, trial, settings, plane)


def _patterns(ground: Ground, shape: Pieces, settings: PieceSettings) -> Candidate:
    """Lay the solved pieces flat; with darts, join them where the strain allows it."""
    surface = ground.moved(shape.design)
    found = measured(surface, shape, settings.max_size, settings.say, executor=settings.executor)
    if settings.darts and found.strain <= settings.max_strain:
        found = joined(surface, found, settings.max_strain, neck_of(ground, settings), settings)
    return found


def _with_straight_seams(
    ground: Ground, best: _Attempt, settings: PieceSettings, allowed: float
) -> _Attempt:
    """Solve again with straight seams instead of zigzags, if that is as good."""
    if best.result is None:
        return best
    settings.say("straight seams")
    own = straightened_pieces(ground, best.cut)
    if own is None:
        return best
    new = _attempt(ground, own, best.level, best.proximity, allowed, settings)
    return new if new.excess <= max(best.excess, 1.0) else best


def _levels(tried: list[_Attempt], least: int) -> Iterator[float]:
    """Yield the bound on the estimated strain of the next attempt, by bisection.

    Not above one with which no more than the `least` number of edges were cut.
    """
    level = _FIRST
    for _ in range(12):
        yield level
        good = [a.level for a in tried if a.excess <= 1.0]
        bad = [a.level for a in tried if a.excess > 1.0]
        if not bad:
            if len(tried[-1].cut.edges) <= least:
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
    ground: Ground,
    cut_open: Pieces,
    level: float,
    proximity: float,
    allowed: float,
    settings: PieceSettings,
) -> _Attempt:
    """Solve one cut, again with other weights where distance, strain or facets are too large."""
    strain = settings.max_strain
    own = replace(Options().for_pieces(), w_proximity=proximity)
    sound = not len(faults.folded(ground.mesh))
    best: _Attempt | None = None
    todo, nearer, fairer = [own], 0, 0
    while todo:
        options = todo.pop(0)
        try:
            result = _solved(cut_open, options)
        except MeshError:
            # No vertex is inside a piece: the shape stays as it is.
            strained = strains_of(cut_open.opened.mesh).get("strain_max", np.inf) / strain
            return _Attempt(level, proximity, cut_open, None, cut_open, strained)
        shape = cut_open if result.pieces is None else result.pieces
        far = metrics.largest_distance(ground.mesh, shape.design) / allowed
        strained = uneven = 0.0
        if far <= _HOPELESS:
            strains = strains_of(result.mesh, settings.executor)
            strained = strains.get("strain_max", np.inf) / strain
        if far <= 1.0:
            folds = len(faults.folded(shape.design)) if sound else 0
            uneven = max(facet_ratio(result) / FACETS, 1.0 + _FOLD * folds if folds else 0.0)
        excess = max(far, strained, uneven)
        attempt = _Attempt(level, options.w_proximity, cut_open, result, shape, excess)
        if 1.0 < far <= _HOPELESS and strained < 1.0 and nearer < _NEARER:
            # The strain is less than allowed: a shape nearer to the design may do.
            nearer += 1
            more = _STRONGER if far < _FAR else _STRONGER**2
            todo.append(replace(options, w_proximity=more * options.w_proximity))
        elif uneven > 1.0 and fairer < _FAIR:
            fairer += 1
            todo.append(_fairer(options))
        elif best is None and strained > 1.0 >= far:
            todo.append(replace(own, w_curvature=_STRONGER * own.w_curvature))
        if best is None or attempt.excess < best.excess:
            best = attempt
        if best.excess <= 1.0:
            break
    return attempt if best is None else best


def _fairer(options: Options) -> Options:
    fairness, curvature = _FAIRER
    return replace(
        options,
        w_fairness=fairness * options.w_fairness,
        w_curvature=curvature * options.w_curvature,
    )


def _solved(pieces: Pieces, options: Options) -> Result:
    return solve_pieces(pieces, Request("developable", "curvature", options, verdict=False))
