"""The search for few pieces of a triangle mesh.

Regions are found on a copy at the scale of the allowed distance (:mod:`gso.seams.coarse_copy`). An
estimate orders the candidates, and the joint solve of the pieces decides: the search begins with
few regions, divides those that do not hold what is allowed, and merges neighbours where there is
room. The boundaries between regions are then carried back to the design as curves through
triangles, and its pieces are solved from the shape of the copy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.errors import MeshError
from gso.geometry.plane import Plane
from gso.mesh import Mesh
from gso.seams.budgets import Budgets
from gso.seams.carrying import base_start
from gso.seams.coarse_copy import TINY, CoarseCopy
from gso.seams.copy_search import LEVELS, CopySearch
from gso.seams.crease_lines import feature_edges
from gso.seams.cutting import cut
from gso.seams.kinds import Edges
from gso.seams.options import PieceSettings
from gso.seams.region_merges import Merges
from gso.seams.symmetry import symmetric_points
from gso.seams.trial import Allowed, Trial
from gso.seams.trial_solve import tried
from gso.seams.wanted import Wanted
from gso.typing import Flags, Ints

#: Share of the area in pieces that do not hold, or largest excess of these, up to which they alone
#: are divided.
_FEW, _LITTLE = 0.4, 1.5
#: Excess up to which a first solve of a division is repaired.
_NEARLY = 1.15
#: Excess of all of some divisions from which on others with as many pieces are not tried, and the
#: share of the area in pieces that do not hold from which on one division is enough for that.
_FAR, _ENOUGH, _ALL = 2.3, 3, 0.95
#: How often a division is solved again from where it is, and the largest ratio of its excess.
_PURSUITS, _LESS = 3, 0.97
#: Excess up to which a finer division is solved again before it is divided further.
_BARELY = 1.05
#: Distance over the allowed one, and number of pieces, from which on a search is in vain.
_HOPELESS, _MANY = 20.0, 150
#: Number of pieces for each feature from which on seams along its creases are tried.
_FEW_FEATURES = 3
#: Number of pieces that these may cost for each feature.
_FOR_CREASES = 2
#: Iterations of the solve of the design, from the shape of the copy, and the factor on the weight
#: of fairness, since the design has finer faces.
_ITERATIONS, _FAIRER = 30, 4.0
#: Faces of the design over those of the copy from which on its weights grow, and the power of that:
#: curvature and fairness of finer meshes weigh less.
_FINE, _POWER = 4.0, 3.0
#: How often few regions of a trial are divided before an earlier one is tried.
_REFINED = 3
#: Excess of facets up to which pieces that have nothing else too large are taken: more solves, or
#: smaller pieces, rarely have fewer.
_PLEATED = 1.2
#: Number of pieces in all divisions of one bound that are tried, and least number of divisions:
#: where pieces are many, fewer are tried.
_IN_ALL, _LEAST_WAYS = 150, 2
#: Number of pieces, and share of the area in those that do not hold, relative to that with bounds
#: before, from which on no lower bound is tried.
_MANY_AT_FIRST, _NO_BETTER = 20, 0.9
#: Number of pieces over those that are too many from which on merging them does not help.
_MERGED = 1.5
#: How often these are solved again where they nearly hold.
_REPAIRS = 3
#: Share of a region's area that two regions have in common which are the same.
_SAME = 0.95


def divided_within(
    design: Mesh,
    settings: PieceSettings,
    wanted: Wanted | None = None,
    plane: Plane | None = None,
) -> Trial:
    """Find few pieces of a triangle mesh that become developable within a distance.

    Parameters
    ----------
    design : Mesh
    settings : PieceSettings
    wanted : Wanted, optional
        What is asked of the seams.
    plane : Plane, optional
        Plane of symmetry that they are to have.

    Returns
    -------
    Trial
        The best one of the design; it may not hold what is allowed.
    """
    if settings.max_deviation is None:
        raise ValueError("the search within a distance needs max_deviation")
    settings.say("a copy at the scale of the distance")
    allowed = Allowed(design, settings.max_deviation, settings.max_strain)
    copy = CoarseCopy.of(design, allowed.distance, wanted)
    search = CopySearch(copy, allowed, settings, plane)
    return _of_design(*_along_creases(search, wanted, _of_copy(search)))


def _along_creases(
    search: CopySearch, wanted: Wanted | None, trials: list[Trial]
) -> tuple[CopySearch, list[Trial]]:
    """Search again for seams along creases around features, such as a nose.

    They are taken if that costs little.
    """
    best, allowed = trials[-1], search.allowed
    if not best.holds:
        return search, trials
    edges, features = feature_edges(allowed.design)
    if not 0 < features <= max(1, len(best.pieces) // _FEW_FEATURES):
        return search, trials
    search.settings.say(f"seams along the creases around features: {features}")
    wanted = wanted or Wanted.nothing(allowed.design)
    wanted = replace(wanted, kept=np.concatenate([wanted.kept, edges]))
    along = replace(search, copy=CoarseCopy.of(allowed.design, allowed.distance, wanted))
    others = _of_copy(along)
    more = len(others[-1].pieces) - len(best.pieces)
    missing = [Budgets(some[-1], search.settings).missing for some in (others, trials)]
    if others[-1].holds and more <= _FOR_CREASES * features and missing[0] <= missing[1]:
        return along, others
    return search, trials


def _of_copy(search: CopySearch) -> list[Trial]:
    """Return the trials on the copy that hold, the best last; the best one if none does."""
    effort = search.settings.effort
    found: list[Trial] = []
    least = np.inf
    for number, level in enumerate(LEVELS, 1):
        labels = [one for one in search.divided(level) if not _known(one, found)]
        # Other bounds may take as many solves as those before.
        others = (len(LEVELS) - number) * max(len(found) // max(number - 1, 1), 1)
        fewest = int(labels[0].max()) + 1 if labels else 1
        _check_fewer(search, fewest)
        ways = max(_LEAST_WAYS, min(effort.variants, _IN_ALL // fewest))
        some = _first(search, labels[:ways], others)
        if some and not some[-1].holds:
            best = min(some, key=lambda one: one.worst)
            some += (more := _pursued(search, best))
            best = min([best, *more], key=lambda one: one.worst)
            some += _refined(search, best, others)
        found += some
        if any(one.holds for one in found) or (found and _hopeless(found[-1])):
            break
        failed = min((_failed(search, one) for one in some), default=1.0)
        many = bool(some) and len(some[0].pieces) > _MANY_AT_FIRST
        if many and failed > _NO_BETTER * least:
            break
        least = min(least, failed)
    best = min(found, key=lambda one: _rank(one, search.settings))
    if not best.holds and not _hopeless(best):
        # Most of the design holds in no division: go on with the one that holds in most places.
        best = min(found, key=lambda one: _failed(search, one))
        found += _refined(search, best, 0, most=1.0)
        best = min(found, key=lambda one: _rank(one, search.settings))
    if not best.holds:
        return [best]
    merges = Merges(search, best)
    merges.run(effort.merges)
    merges.meet(effort.budgets)
    return merges.found


def _check_fewer(search: CopySearch, fewest: int) -> None:
    """Raise a MeshError if so many pieces, of divisions that are tried next, will stay too many."""
    most = search.settings.fewer_than
    if most is not None and fewest > _MERGED * most:
        raise MeshError(f"the pieces will not be fewer than {most}: divisions begin with {fewest}")


def _known(label: Ints, found: list[Trial]) -> bool:
    return any(np.array_equal(label, one.label) for one in found)


def _first(search: CopySearch, labels: list[Ints], others: int) -> list[Trial]:
    """Try divisions until one holds, which is the last one then.

    So many solves may follow with other bounds.
    """
    effort = search.settings.effort
    found: list[Trial] = []
    for number, label in enumerate(labels, 1):
        pieces = int(label.max()) + 1
        possible = len(labels) - number + effort.divisions + others + effort.merges
        said = f"seams, way {number} of {len(labels)}: {pieces} pieces"
        search.remaining.of_copy(said, possible)
        found.append(search.measured(label, most=_NEARLY))
        far = min(one.worst for one in found) > _FAR
        enough = _ENOUGH if min(_failed(search, one) for one in found) < _ALL else 1
        if found[-1].holds or (far and number >= enough):
            break
    return found


def _pursued(search: CopySearch, trial: Trial) -> list[Trial]:
    """Solve a division again from where it is, as long as it needs less and less."""
    found: list[Trial] = []
    while len(found) < _PURSUITS and not trial.holds and trial.worst <= _FAR:
        search.remaining.of_copy(f"shape of {len(trial.pieces)} pieces", _PURSUITS - len(found))
        found.append(search.measured(trial.label, trial.width, begin=trial))
        if found[-1].worst > _LESS * trial.worst:
            break
        trial = found[-1]
    return found


def _refined(search: CopySearch, trial: Trial, others: int, most: float = _FEW) -> list[Trial]:
    """Divide regions that do not hold, as long as these are few or nearly do.

    Few are those with up to some share of the area. So many solves may follow with other bounds.
    """
    found: list[Trial] = []
    effort = search.settings.effort
    while len(found) < effort.divisions:
        few = _failed(search, trial) <= most or trial.worst <= _LITTLE
        if trial.holds or _hopeless(trial) or not few:
            break
        label = search.smaller(trial, trial.of_regions(trial.too_large))
        if np.array_equal(label, trial.label):
            break
        possible = effort.divisions - len(found) - 1 + others + effort.merges
        search.remaining.of_copy(f"seams and shape: {label.max() + 1} pieces", possible)
        found.append(search.measured(label, begin=trial))
        if 1.0 < found[-1].worst <= _BARELY:
            # So little is missing that another solve is likely to do.
            found += _pursued(search, found[-1])
        trial = found[-1]
    return found


def _failed(search: CopySearch, trial: Trial) -> float:
    """Return the share of the area in regions that do not hold."""
    area = np.bincount(trial.label, search.regions.face_area)
    return float(area[trial.of_regions() > 1.0].sum() / area.sum())


def _hopeless(trial: Trial) -> bool:
    """Whether pieces are so far away, or so many, that a further search is in vain."""
    return float(trial.distance.max()) > _HOPELESS or len(trial.pieces) > _MANY


def _rank(trial: Trial, settings: PieceSettings) -> tuple[float, ...]:
    value = settings.value(len(trial.pieces), trial.pieces.seam_length)
    missing = Budgets(trial, settings, 1.0).missing
    return (max(trial.worst, 1.0), missing, *value)


def _of_design(search: CopySearch, trials: list[Trial]) -> Trial:
    """Carry regions back to the design, and solve its pieces from the shape of the copy.

    Where regions do not hold there, those of an earlier trial of the copy may; or else they are
    divided.
    """
    settings = search.settings
    found: list[Trial] = []
    trial, others = trials[-1], trials[:-1]
    begin: Trial | None = None
    refined = 0
    rounds = settings.effort.rounds
    for number in range(rounds):
        # The first attempt is mostly the last.
        possible = rounds - number - 1 if number else 0
        search.remaining.of_design(f"the design's own pieces, attempt {number + 1}", possible)
        own = _carried(search, trial, begin)
        found.append(own)
        if own.holds or _hopeless(own) or number == rounds - 1:
            break
        excess = own.of_regions(own.too_large)
        some = (excess > 1.0).any()
        if not some and not len(own.crossed) and own.facets <= _PLEATED:
            break
        while others and _has(others[-1].label, trial.label, excess > 1.0):
            others.pop()
        refined += 1
        if others and refined > (_REFINED if _failed(search, own) <= _FEW else 0):
            trial, begin, refined = others.pop(), None, 0
            continue
        # Parts that only pass through each other are solved again.
        # One piece too many stays, since pieces of the design are not merged.
        label = search.smaller(own, excess, np.inf) if some else trial.label
        if some and np.array_equal(label, trial.label):
            break
        trial, begin = replace(trial, label=label), own
    return min(found, key=lambda one: _rank(one, settings))


def _carried(search: CopySearch, trial: Trial, begin: Trial | None) -> Trial:
    """Carry the regions of a trial back to the design, and solve them.

    The solve begins with the shape of the trial, or with that of an earlier one of the design.
    """
    copy = search.copy
    fields = search.base_fields(trial.label, trial.width)
    divided = search.base_regions.cut_between(fields).along(copy.wanted.kept, TINY)
    smooth = search.opened(divided, copy.wanted.kept, search.base_apexes)
    if begin is None:
        start = base_start(copy, trial, smooth)
    else:
        start = divided.moved_as(begin.divided, begin.untangled)
    if search.plane is not None:
        start = symmetric_points(smooth.design, start, search.plane)
    design = smooth.design.replaced(divided.moved(copy.base.vertices))
    own = trial.options
    finer = max(1.0, len(divided.mesh.faces) / (_FINE * len(copy.mesh.faces))) ** _POWER
    options = replace(
        own,
        w_fairness=_FAIRER * finer * own.w_fairness,
        w_curvature=finer * own.w_curvature,
        w_reach=finer * own.w_reach,
    )
    return tried(
        trial.label,
        divided,
        cut(design, Edges(smooth.edges)),
        search.allowed,
        start,
        _ITERATIONS,
        repairs=_REPAIRS,
        executor=search.settings.executor,
        width=trial.width,
        options=options,
    )


def _has(label: Ints, other: Ints, bad: Flags) -> bool:
    """Whether a division has about the same region as each bad one of another."""
    for own in np.flatnonzero(bad):
        inside = other == own
        common = np.bincount(label[inside])
        best = int(common.argmax())
        if common[best] < _SAME * max(int(inside.sum()), int((label == best).sum())):
            return False
    return True
