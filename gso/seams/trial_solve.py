"""The solve of a division of a design, again with other weights as long as little is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso import faults, metrics
from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.executors import SERIAL, Executor
from gso.mesh import Nearest
from gso.result import Result
from gso.seams.corrections import Corrections
from gso.seams.cutting import cut
from gso.seams.joint_solve import solve_pieces
from gso.seams.kinds import Edges
from gso.seams.regions import Divided, with_flips
from gso.seams.sheets import laid
from gso.seams.trial import Allowed, Trial, solved
from gso.tasks.developable import Options
from gso.tasks.request import Request
from gso.tasks.start import Start
from gso.typing import Array, Ints

#: Share of the allowed distance beyond which the solver penalises it, and the weight of that.
_REACH, _WEIGHT = 0.9, 5000.0
#: Weight of a barrier against folds.
_FACING = 0.05
#: Factors on the weights of fairness, curvature and proximity of the joint solve.
_FAIR, _CURVED, _NEAR = 3.0, 2.0, 0.3
#: Largest distance, strain and number of folds (a share of the faces, and a number) of a result
#: that is solved again with more weight on what is too large.
_FAR, _STRAINED, _DOUBTFUL_FOLDS, _SOME_FOLDS = 1.6, 12.0, 0.03, 12
#: Largest distance of a point of the design from such a result.
_FARTHER = 2.5
#: Largest strain where the shape to begin with is known to hold on a copy.
_KNOWN = 200.0
#: Distance that is then aimed at, range of the factor on the weight of curvature, and number of
#: iterations.
_BELOW, _MORE, _AGAIN = 0.98, (1.2, 4.0), 12
#: How often a solve begins again from the design; the largest distance of a result after which it
#: does, the factor on the weight of curvature where the strain is too large, and that where it is
#: below some share of what is allowed, and the distance is too large.
_COLD, _NEAR_ENOUGH, _MUCH_MORE, _LESS, _UNUSED = 3, 1.15, 8.0, 0.6, 0.3
#: Factor on the weight of fairness where that of curvature grows much, or where there are facets.
_SMOOTHER = 2.5
#: By how much points inside faces may be farther away than vertices.
_INSIDE = 1.05
#: Factor on the weight of distances beyond those that are aimed at, where they are too large, and
#: the distance over the allowed one from which on.
_NEARER, _BARELY = 2.0, 1.02
#: Factor on the weight of the barrier against folds where faces are folded.
_FACING_MORE = 20.0
#: Excess up to which little is missing.
_CLOSE = 1.1
#: Ratio of what a result needs to the least before, up to which it becomes much less.
_PROGRESS = 0.8
#: Angle in degrees from which on an edge of a folded face is flipped.
_FOLDED = 90.0
#: Share of the allowed distance from which on points inside faces are measured, too.
_DOUBTFUL = 0.7


def options_for(distance: float) -> Options:
    """Return the settings of a joint solve within a distance."""
    own = Options().for_pieces()
    return replace(
        own,
        w_fairness=_FAIR * own.w_fairness,
        w_curvature=_CURVED * own.w_curvature,
        w_proximity=_NEAR * own.w_proximity,
        reach=_REACH * distance,
        w_reach=_WEIGHT,
        w_facing=_FACING,
    )


def tried(
    label: Ints,
    divided: Divided,
    pieces: Pieces,
    allowed: Allowed,
    start: Array | None = None,
    iterations: int | None = None,
    repairs: int = 1,
    executor: Executor = SERIAL,
    width: float = 0.0,
    options: Options | None = None,
    most: float = np.inf,
) -> Trial:
    """Solve and measure pieces.

    Parameters
    ----------
    label : ndarray of int
        Regions of the mesh that was divided.
    divided : Divided
        The mesh with vertices on seams.
    pieces : Pieces
        Its pieces, all of them disks.
    allowed : Allowed
    start : ndarray, (n, 3), optional
        Points of the divided mesh to begin with.
    iterations : int, optional
        Number of iterations from there.
    repairs : int
        How often a result that nearly holds is solved again; twice as often if little is missing,
        or what is missing becomes much less.
    executor : Executor
        Lays pieces flat; the result does not depend on it.
    width : float
        Of the diffusion that made the boundaries fair.
    options : Options, optional
        Of an earlier solve: the weights to begin with.
    most : float
        Excess up to which a result is solved again.
    """
    own, first = options_for(allowed.distance), start
    if options is not None:
        own = replace(options, reach=own.reach)
    # A shape to begin with is better than none, so that fewer solves begin again.
    known = first is not None
    tries = 1 if known else _COLD
    found: list[Trial] = []
    needs: list[float] = []
    corrections = Corrections(pieces, allowed.distance)
    if start is not None:
        begun = pieces.design.replaced(start)
        corrections.measure(begun, np.unique(faults.crossings(begun)))
    for number in range(2 * repairs + 1):
        begin = Start(start, iterations=iterations if start is not None else None)
        asked = Request("developable", "curvature", own, start=begin, verdict=False)
        try:
            result = solve_pieces(pieces, asked, corrections.constraints)
        except MeshError:
            result = None
        trial = _measured(label, divided, pieces, result, allowed, executor, width, own)
        found.append(trial)
        if trial.holds or result is None:
            break
        if start is first and number < tries:
            again = _begun_again(own, trial, known)
            if again is not None:
                own = again
                continue
        if not _repairable(trial, known) or (start is None and trial.worst > most):
            break
        needs.append(float(max(trial.distance.max(), trial.strain.max(), trial.folds.sum())))
        progress = needs[-1] <= _PROGRESS * min(needs[:-1], default=0.0)
        best = _best(found)
        if number >= repairs and best.worst > _CLOSE and not progress:
            break
        own = _stricter(own, trial)
        if best.worst <= _CLOSE:
            # Another try from where little was missing, with other weights.
            trial = best
        corrections.measure(trial.shape.design, trial.crossed)
        start, iterations = trial.untangled, _AGAIN
        pieces = _with_flips(trial)
    return _best(found)


def _best(found: list[Trial]) -> Trial:
    """Return the trial that needs least."""
    return min(found, key=lambda one: one.worst)


def _begun_again(options: Options, trial: Trial, known: bool) -> Options | None:
    """Return settings with which a solve that begins again may hold, where one before nearly did.

    None where that is not likely, as where it begins with a known shape and the strain is missing.
    A solve that goes on from its own shape with other weights folds more often.
    """
    far, strain = float(trial.distance.max()), float(trial.strain.max())
    if far > _NEAR_ENOUGH or strain > _KNOWN or trial.folds.sum() > _SOME_FOLDS:
        return None
    if strain > 1.0:
        if known:
            return None
        return replace(
            options,
            w_curvature=_MUCH_MORE * options.w_curvature,
            w_fairness=_SMOOTHER * options.w_fairness,
        )
    if far > 1.0 and options.reach is not None:
        less = _LESS if strain < _UNUSED else 1.0
        return replace(
            options, reach=options.reach * _BELOW / far, w_curvature=less * options.w_curvature
        )
    return None


def _repairable(trial: Trial, known: bool) -> bool:
    """Whether what is too large is so little that another solve from there may do."""
    far, strain = float(trial.distance.max()), float(trial.strain.max())
    folds = int(trial.folds.sum())
    most = _DOUBTFUL_FOLDS * len(trial.pieces.design.faces) + _SOME_FOLDS
    return (
        far <= _FARTHER
        and trial.outward <= _FAR
        and strain <= (_KNOWN if known or folds else _STRAINED)
        and folds <= most
    )


def _stricter(options: Options, trial: Trial) -> Options:
    """Return settings with more weight on what is too large."""
    far, strain = float(trial.distance.max()), float(trial.strain.max())
    if far > 1.0 and options.reach is not None:
        # Where only the design is far from the result, vertices are drawn (`Corrections`).
        far = min(far, max(trial.outward, _INSIDE))
        nearer = _NEARER if far > _BARELY else 1.0
        reach, weight = options.reach * _BELOW / far, nearer * options.w_reach
        options = replace(options, reach=reach, w_reach=weight)
    if trial.folds.any():
        options = replace(options, w_facing=_FACING_MORE * options.w_facing)
    elif trial.facets > 1.0:
        options = replace(options, w_fairness=_SMOOTHER * options.w_fairness)
    if strain > 1.0:
        more = float(np.clip(strain, *_MORE))
        options = replace(options, w_curvature=more * options.w_curvature)
    return options


def _measured(
    label: Ints,
    divided: Divided,
    pieces: Pieces,
    result: Result | None,
    allowed: Allowed,
    executor: Executor,
    width: float,
    options: Options,
) -> Trial:
    # Flips change the areas of pieces, and so perhaps their order.
    region = divided.label[[part.faces[0] for part in pieces.parts]]
    shape = solved(pieces, result)
    sheets = tuple(executor.map(laid, [part.mesh for part in shape.parts]))
    strain = np.array([np.inf if one is None else one.strain for one in sheets]) / allowed.strain
    far, outward = _away(shape, allowed)
    return Trial(
        label,
        divided,
        pieces,
        region,
        result,
        sheets,
        far,
        strain,
        allowed.built,
        outward,
        width,
        options,
    )


def _away(shape: Pieces, allowed: Allowed) -> tuple[Array, float]:
    """Return the largest distance of each piece (p,) from the design over the allowed one.

    Also return that of any vertex from the design.
    """
    design, near, most = allowed.design, allowed.near, allowed.distance
    distance = np.array([float(near.distances(p.mesh.vertices).max()) for p in shape.parts])
    outward = float(distance.max()) / most
    # And back: from the design to the nearest piece.
    surface = shape.opened.mesh
    face, away = Nearest(surface).nearest(design.vertices[design.used])
    np.maximum.at(distance, shape.of_vertex[surface.triangles[face, 0]], away)
    if _DOUBTFUL * most < distance.max() <= most:
        # Points inside faces may be farther away than all vertices.
        largest = metrics.largest_distance(design, shape.design)
        distance[distance.argmax()] = max(largest, float(distance.max()))
    return np.asarray(distance / most), outward


def _with_flips(trial: Trial) -> Pieces:
    """Flip the edges of a triangle mesh at which the solved pieces are folded."""
    shape, design = trial.shape, trial.pieces.design
    if not design.is_triangles:
        return trial.pieces
    mesh = shape.design
    he = mesh.half_edges
    k = he.interior
    bad = np.zeros(len(mesh.faces), bool)
    bad[trial.folded] = True
    f, g = he.face[k], he.face[he.twin[k]]
    seam = he.on(shape.edges)[k]
    some = bad[f] & bad[g] & ~seam & (metrics.dihedral_angles(mesh) > _FOLDED)
    if not some.any():
        return trial.pieces
    try:
        return cut(with_flips(design, k[some]), Edges(trial.pieces.edges))
    except MeshError:
        # A triangle would have no area.
        return trial.pieces
