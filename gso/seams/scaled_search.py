"""The search for few pieces of a triangle mesh whose shape may change within a distance.

Regions are found on a copy at the scale of the distance (:mod:`gso.seams.coarse_copy`). An estimate
orders the candidates, and the joint solve of the pieces decides: the search begins with few
regions, divides those that do not hold what is allowed, and merges neighbours where there is room.
The boundaries between regions are then carried back to the design as curves through triangles,
and its pieces are solved from the shape of the copy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gso.cut_pieces import Pieces
from gso.mesh import Mesh
from gso.seams.candidates import disks
from gso.seams.carrying import base_fields, base_start
from gso.seams.coarse_copy import CoarseCopy
from gso.seams.compact_patches import patches
from gso.seams.cutting import cut
from gso.seams.distance_estimate import DistanceEstimates
from gso.seams.kinds import Edges, edges_between
from gso.seams.merging import Merging
from gso.seams.options import PieceSettings
from gso.seams.potential import Potential
from gso.seams.regions import Divided, Regions, numbered
from gso.seams.tree import Ground
from gso.seams.trial import Allowed, Trial, tried
from gso.typing import Array, Ints

#: Share of what is allowed that pieces of the copy may use.
_ROOM = 0.95
#: Bounds on the estimated distance over the allowed one that are tried, in turn.
_LEVELS = (0.6, 0.4, 0.27, 0.18, 0.12, 0.08)
#: Numbers of patches, and how much compact pieces are preferred.
_PATCHES, _COMPACT = (100, 200), (2.0, 5.0)
#: Share of the area in pieces that do not hold, or largest excess of these, up to which they alone
#: are divided.
_FEW, _LITTLE = 0.4, 1.5
#: Range of the factor on the bound of a piece that is divided.
_SMALLER = (0.35, 0.8)
#: Distance over the allowed one, and number of pieces, from which on a search is in vain.
_HOPELESS, _MANY = 20.0, 150
#: Width of the diffusion that makes boundaries fair, in mean edges of the copy.
_WIDTH = 1.5
#: Factor on the cost of seams along creases.
_CHEAPER = 0.3
#: Share of the pieces that take part in a round of merges, and the largest estimate.
_SHARE, _LIKELY = 0.25, 1.5
#: Angle defect, in degrees, from which on a vertex is the apex of a cone.
_APEX = 60.0
#: Area of a region over the mean, below which it goes to a neighbour at first.
_SMALL = 0.08
#: Area of a region over the whole below which it always goes to a neighbour.
_TINY = 0.003
#: Iterations of the solve of the design, from the shape of the copy.
_ITERATIONS = 16
#: How often these are solved again where they nearly hold.
_REPAIRS = 3


@dataclass(frozen=True, eq=False)
class _Search:
    """What the search knows about a design."""

    copy: CoarseCopy
    allowed: Allowed
    settings: PieceSettings

    @cached_property
    def of_copy(self) -> Allowed:
        """What pieces of the copy may use."""
        return replace(self.allowed, design=self.copy.mesh, distance=_ROOM * self.allowed.distance)

    @cached_property
    def beside(self) -> tuple[Ints, Array]:
        """Faces (e, 2) on both sides of each inner edge of the copy, and its length (e,)."""
        mesh, he = self.copy.mesh, self.copy.mesh.half_edges
        k = he.interior
        length = np.linalg.norm(mesh.vertices[he.origin[k]] - mesh.vertices[he.dest[k]], axis=1)
        return np.stack([he.face[k], he.face[he.twin[k]]], axis=1), length

    @cached_property
    def ground(self) -> Ground:
        mesh, lines = self.copy.mesh, self.copy.lines
        factor = None
        if len(lines):
            factor = np.ones(len(mesh.edges))
            factor[mesh.edge_numbers(lines[:, 0], lines[:, 1])] = _CHEAPER
        return Ground.of(mesh, factor)

    @cached_property
    def regions(self) -> Regions:
        return Regions(self.copy.mesh, self.copy.lines)

    @cached_property
    def estimate(self) -> DistanceEstimates:
        return DistanceEstimates(self.ground.estimates, self.regions, self.allowed.distance)

    @cached_property
    def width(self) -> float:
        return _WIDTH * float(self.copy.mesh.edge_lengths.mean())

    @cached_property
    def first_patches(self) -> list[Ints]:
        mesh, lines = self.copy.mesh, self.copy.lines
        return [patches(mesh, count, lines) for count in _PATCHES]

    def merged(self, label: Ints, level: Array, compact: float) -> Ints:
        """Merge regions up to a bound (m,) on the estimate, given for each face."""
        bound = np.log(np.maximum(level, 1e-12))

        def estimate(faces: Ints) -> float | None:
            found = self.estimate(faces)
            area = self.regions.face_area[faces]
            return found and found / float(np.exp(area @ bound[faces] / area.sum()))

        merging = Merging(self.ground, label, 1.0, compact, estimate)
        return numbered(merging.run())

    def divided(self, level: float) -> Ints:
        """Return the best regions for a bound on the estimate."""
        bound = np.full(len(self.copy.mesh.faces), level)
        found = []
        for label in self.first_patches:
            for compact in _COMPACT:
                own = self.regions.fair(self.merged(label, bound, compact), self.width)
                found.append(self.without_small(own, _SMALL))
        return min(found, key=self.value)

    def value(self, label: Ints) -> tuple[int, float, float]:
        """Rank regions by their number and the length of their boundaries."""
        faces, length = self.beside
        seam = float(length[np.ptp(label[faces], axis=1) > 0].sum())
        size = float(np.sqrt(self.regions.face_area.sum()))
        return self.settings.value(int(label.max()) + 1, seam / size)

    def without_small(self, label: Ints, share: float = 0.0) -> Ints:
        """Merge small regions with their neighbours.

        They are smaller than a share of the mean, or so small that nobody would cut them.
        """
        faces, length = self.beside
        while True:
            size = np.bincount(label, self.regions.face_area)
            small = np.flatnonzero(size < max(share * size.mean(), _TINY * size.sum()))
            a, b = label[faces].T
            for own in small[np.argsort(size[small], kind="stable")].tolist():
                out, back = (a == own) & (b != own), (b == own) & (a != own)
                shared = np.bincount(
                    np.r_[b[out], a[back]], np.r_[length[out], length[back]], len(size)
                )
                if shared.any():
                    label = numbered(np.where(label == own, shared.argmax(), label))
                    break
            else:
                return label

    def measured(self, label: Ints) -> Trial:
        """Solve and measure regions of the copy."""
        regions = self.regions
        divided = regions.cut_between(regions.fields(label, self.width))
        pieces = self.opened(divided, self.apexes)
        return tried(
            label,
            divided,
            pieces,
            self.of_copy,
            repairs=_REPAIRS - 1,
            executor=self.settings.executor,
        )

    @cached_property
    def apexes(self) -> Ints:
        """Vertices of the copy at the apex of a cone, to which a piece has to be cut."""
        mesh = self.copy.mesh
        sharp = self.ground.potential.curvature > np.radians(_APEX)
        sharp &= ~mesh.half_edges.boundary_vertex
        sharp[self.copy.lines] = False
        return np.flatnonzero(sharp)

    @cached_property
    def base_apexes(self) -> Ints:
        """The sharpest vertices of the base near the apexes of the copy."""
        base = self.copy.base
        if not len(self.apexes):
            return self.apexes
        curvature = np.where(base.half_edges.boundary_vertex, -np.inf, Potential(base).curvature)
        reach = float(self.copy.mesh.edge_lengths.mean())
        near = cKDTree(base.vertices).query_ball_point(self.copy.mesh.vertices[self.apexes], reach)
        own = self.copy.ids[self.apexes]
        sharpest = [
            max([int(vertex), *sorted(others)], key=lambda k: curvature[k])
            for vertex, others in zip(own, near, strict=True)
        ]
        return np.unique(sharpest)

    def opened(self, divided: Divided, apexes: Ints) -> Pieces:
        """Cut between regions, to the apexes of cones, and until all pieces are disks."""
        mesh, edges = divided.mesh, edges_between(divided.mesh, divided.label)
        ground = Ground.of(mesh)
        reached = mesh.half_edges.boundary_vertex.copy()
        reached[edges] = True
        own = mesh.components
        for apex in apexes.tolist():
            if not reached[own == own[apex]].any():
                # The first apex of a closed component: the others are joined to it.
                reached[apex] = True
            if reached[apex]:
                continue
            line = ground.paths.cheapest(apex, reached, np.ones(len(mesh.edges)))
            edges = np.concatenate([edges, np.stack([line[:-1], line[1:]], axis=1)])
            reached[line] = True
        return disks(ground, edges)

    def smaller(self, trial: Trial, excess: Array) -> Ints:
        """Divide the regions whose excess (k,) is more than one."""
        label, mesh = trial.label, self.copy.mesh
        bad = excess > 1.0
        level = np.zeros(len(label))
        for own in np.flatnonzero(bad):
            faces = np.flatnonzero(label == own)
            found = self.estimate(faces)
            found = _LEVELS[0] if found is None else max(found, _LEVELS[-1] / 2)
            level[faces] = found * float(np.clip(1.0 / excess[own], *_SMALLER))
        kept = np.concatenate([edges_between(mesh, label), self.copy.lines])
        finer = patches(mesh, max(_PATCHES[-1], 4 * len(excess)), kept)
        start = numbered(np.where(bad[label], finer + len(excess), label))
        new = self.merged(start, level, _COMPACT[0])
        return self.without_small(self.regions.fair(new, self.width, rounds=1))


def divided_within(design: Mesh, settings: PieceSettings) -> Trial:
    """Find few pieces of a triangle mesh that become developable within a distance.

    Parameters
    ----------
    design : Mesh
    settings : PieceSettings
        Its `max_deviation` is given.

    Returns
    -------
    Trial
        The best one of the design; it may not hold what is allowed.
    """
    if settings.max_deviation is None:
        raise ValueError("the search within a distance needs max_deviation")
    settings.say("a copy at the scale of the distance")
    allowed = Allowed(design, settings.max_deviation, settings.max_strain)
    search = _Search(CoarseCopy.of(design, allowed.distance), allowed, settings)
    best = _of_copy(search)
    return _of_design(search, best)


def _of_copy(search: _Search) -> Trial:
    """Return the best trial on the copy."""
    found: list[Trial] = []
    for level in _LEVELS:
        label = search.divided(level)
        if found and label.max() == found[-1].label.max():
            continue
        found += _refined(search, label, len(found))
        if found[-1].holds or _hopeless(found[-1]):
            break
    best = min(found, key=lambda one: _rank(one, search.settings))
    return _merged(search, best) if best.holds else best


def _refined(search: _Search, label: Ints, before: int) -> list[Trial]:
    """Try regions, and divide those that do not hold as long as these are few or nearly do."""
    found: list[Trial] = []
    while True:
        number = before + len(found) + 1
        search.settings.say(f"seams and shape, attempt {number}: {label.max() + 1} pieces")
        found.append(search.measured(label))
        trial, excess = found[-1], found[-1].of_regions()
        area = np.bincount(label, search.regions.face_area)
        few = area[excess > 1.0].sum() <= _FEW * area.sum() or excess.max() <= _LITTLE
        ends = trial.holds or _hopeless(trial) or not few
        if ends or len(found) > search.settings.effort.divisions:
            return found
        label = search.smaller(trial, excess)
        if np.array_equal(label, trial.label):
            return found


def _hopeless(trial: Trial) -> bool:
    """Whether pieces are so far away, or so many, that a further search is in vain."""
    return float(trial.distance.max()) > _HOPELESS or len(trial.pieces) > _MANY


def _rank(trial: Trial, settings: PieceSettings) -> tuple[float, ...]:
    value = settings.value(len(trial.pieces), trial.pieces.seam_length)
    return (max(float(trial.excess.max()), 1.0), *value)


def _merged(search: _Search, best: Trial) -> Trial:
    """Merge neighbours as long as all pieces hold what is allowed."""
    forbidden: set[tuple[bytes, bytes]] = set()
    solves = search.settings.effort.merges
    while solves > 0:
        pairs = _pairs(search, best, forbidden)
        if not pairs:
            break
        while pairs and solves > 0:
            solves -= 1
            search.settings.say(f"{len(best.pieces)} pieces, without {len(pairs)} of them")
            trial = search.measured(_joined(search, best.label, pairs))
            if trial.holds:
                best = trial
                break
            excess = trial.of_regions()
            failed = [
                pair
                for pair in pairs
                if excess[np.bincount(trial.label[best.label == pair[0]]).argmax()] > 1.0
            ]
            failed = failed or pairs
            forbidden |= {_name(best.label, pair) for pair in failed}
            pairs = [pair for pair in pairs if pair not in failed]
    return best


def _joined(search: _Search, label: Ints, pairs: list[tuple[int, int]]) -> Ints:
    out = label.copy()
    for a, b in pairs:
        out[label == b] = a
    return search.regions.fair(numbered(out), search.width, rounds=1)


def _name(label: Ints, pair: tuple[int, int]) -> tuple[bytes, bytes]:
    one, two = (np.packbits(label == k).tobytes() for k in pair)
    return one, two


def _pairs(
    search: _Search, trial: Trial, forbidden: set[tuple[bytes, bytes]]
) -> list[tuple[int, int]]:
    """Choose pairs of neighbours to merge, those with the least estimate first."""
    label = trial.label
    sides = np.sort(label[search.beside[0]], axis=1)
    ranked = []
    for one, two in np.unique(sides[sides[:, 0] != sides[:, 1]], axis=0).tolist():
        if _name(label, (one, two)) in forbidden:
            continue
        found = search.estimate(np.flatnonzero((label == one) | (label == two)))
        if found is not None and found <= _LIKELY:
            ranked.append((found, one, two))
    used: set[int] = set()
    out: list[tuple[int, int]] = []
    for _, one, two in sorted(ranked):
        if len(out) >= max(1, round(_SHARE * (label.max() + 1))):
            break
        if not used & {one, two}:
            used |= {one, two}
            out.append((one, two))
    return out


def _of_design(search: _Search, trial: Trial) -> Trial:
    """Carry regions back to the design, and solve its pieces from the shape of the copy.

    Regions that do not hold there are divided on the copy.
    """
    copy, settings = search.copy, search.settings
    base = Regions(copy.smooth, copy.creases)
    found: list[Trial] = []
    rounds = settings.effort.rounds
    for number in range(rounds):
        settings.say(f"the design's own pieces, attempt {number + 1}")
        fields = base_fields(base, search.regions, copy, trial.label, search.width)
        divided = base.cut_between(fields)
        smooth = search.opened(divided, search.base_apexes)
        start = base_start(copy, trial, smooth)
        design = smooth.design.replaced(divided.moved(copy.base.vertices))
        pieces = cut(design, Edges(smooth.edges))
        own = tried(
            trial.label,
            divided,
            pieces,
            search.allowed,
            start,
            _ITERATIONS,
            repairs=_REPAIRS,
            executor=settings.executor,
        )
        found.append(own)
        if own.holds or _hopeless(own) or number == rounds - 1:
            break
        label = search.smaller(trial, np.maximum(own.of_regions(), trial.of_regions()))
        if np.array_equal(label, trial.label):
            break
        trial = search.measured(label)
    return min(found, key=lambda one: _rank(one, settings))
