"""What a search for regions does on the copy of a design: estimate, merge, divide and measure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gso import metrics
from gso.cut_pieces import Pieces
from gso.geometry.plane import Plane
from gso.seams.candidates import disks
from gso.seams.carrying import base_fields
from gso.seams.coarse_copy import TINY, CoarseCopy
from gso.seams.compact_patches import patches
from gso.seams.distance_estimate import DistanceEstimates
from gso.seams.kinds import edges_between
from gso.seams.merging import Merging
from gso.seams.options import PieceSettings
from gso.seams.potential import Potential
from gso.seams.regions import Divided, Regions, numbered
from gso.seams.remaining_time import RemainingTime
from gso.seams.symmetry import Mirror
from gso.seams.tree import Ground
from gso.seams.trial import Allowed, Trial
from gso.seams.trial_solve import tried
from gso.typing import Array, Flags, Ints

#: Share of what is allowed that pieces of the copy may use.
_ROOM = 0.95
#: Bounds on the estimated distance over the allowed one that are tried, in turn.
LEVELS = (0.6, 0.4, 0.27, 0.18, 0.12, 0.08)
#: Numbers of patches, and how much compact pieces are preferred.
_PATCHES, _COMPACT = (50, 100, 200, 400), (2.0, 5.0, 10.0)
#: How often regions far beyond a bound are halved, and the estimate over the bound from which on.
_HALVINGS, _BEYOND = 3, 3.0
#: Number of regions up to which they are tried before they are halved, too.
_FEW = 2
#: Range of the factor on the bound of a piece that is divided, and the excess up to which it is
#: divided in two.
_SMALLER, _LITTLE = (0.35, 0.8), 1.5
#: Width of the diffusion that makes boundaries fair: in mean edges of the copy, and in necks where
#: a smallest one is given.
_WIDTH, _NECK = 1.5, 0.4
#: Factors on the cost of seams along creases and wanted lines, and where they should not run.
_CHEAPER, _DEARER = 0.3, 20.0
#: Angle defect, in degrees, from which on a vertex is the apex of a cone.
_APEX = 60.0
#: Number of creases that meet at a corner at most.
_CORNER = 4
#: Area of a region over the mean, below which it goes to a neighbour at first.
_SMALL = 0.08
#: Area of a part over its region, and the least one over the whole, below which it goes to a
#: neighbour after a division.
_HALF_OF, _TINIEST = 0.3, 0.0012
#: Number of patches of regions that are divided.
_FINER = 200
#: Share of faces that seams should avoid from which on these regions are divided all the same.
_HALF = 0.5
#: Iterations of a solve that begins with the shape of another.
_ITERATIONS = 12
#: How often pieces that nearly hold are solved again.
_REPAIRS = 2


@dataclass(frozen=True, eq=False)
class CopySearch:
    """What the search knows about a design.

    Attributes
    ----------
    copy : CoarseCopy
    allowed : Allowed
        What pieces of the design may use.
    settings : PieceSettings
    plane : Plane or None
        Plane of symmetry that regions are to have.
    """

    copy: CoarseCopy
    allowed: Allowed
    settings: PieceSettings
    plane: Plane | None = None

    @cached_property
    def remaining(self) -> RemainingTime:
        """Says what is done, and how long the search is likely to go on."""
        return RemainingTime(self.settings.say)

    @cached_property
    def of_copy(self) -> Allowed:
        """What pieces of the copy may use."""
        distance = _ROOM * self.allowed.distance
        return replace(self.allowed, design=self.copy.mesh, distance=distance, built=False)

    @cached_property
    def joinable(self) -> Flags:
        """Whether each inner edge (e,) of the copy may vanish, and is not cut in any case."""
        he = self.copy.mesh.half_edges
        return ~he.on(self.copy.wanted_of_copy.kept)[he.interior]

    def neighbours(self, label: Ints) -> Ints:
        """Return the pairs (p, 2) of regions with a common boundary, none of it to be cut."""
        sides = np.sort(label[self.regions.beside[0]], axis=1)
        apart = sides[:, 0] != sides[:, 1]
        fixed = np.unique(sides[apart & ~self.joinable], axis=0).tolist()
        pairs = np.unique(sides[apart], axis=0).tolist()
        return np.array([p for p in pairs if p not in fixed], np.int64).reshape(-1, 2)

    @cached_property
    def ground(self) -> Ground:
        """The copy with what is asked of its seams."""
        mesh, lines, wanted = self.copy.mesh, self.copy.lines, self.copy.wanted_of_copy
        factor = np.where(wanted.avoided[mesh.edges].all(axis=1), _DEARER, 1.0)
        if len(lines):
            factor[mesh.edge_numbers(lines[:, 0], lines[:, 1])] = _CHEAPER
        return Ground.of(mesh, factor if (factor != 1.0).any() else None, wanted.kept)

    @cached_property
    def regions(self) -> Regions:
        """Regions of the copy."""
        return Regions(self.copy.mesh, self.copy.lines, self.copy.wanted_of_copy.avoided)

    @cached_property
    def base_regions(self) -> Regions:
        """Regions of the base."""
        return Regions(self.copy.smooth, self.copy.creases, self.copy.wanted.avoided)

    @cached_property
    def mirror(self) -> Mirror | None:
        """The plane of symmetry of the regions of the copy."""
        return None if self.plane is None else Mirror(self.regions, self.plane)

    @cached_property
    def base_mirror(self) -> Mirror | None:
        """The plane of symmetry of the regions of the base."""
        return None if self.plane is None else Mirror(self.base_regions, self.plane)

    @cached_property
    def estimate(self) -> DistanceEstimates:
        """Estimates the distance of faces, over the allowed one."""
        return DistanceEstimates(self.ground.estimates, self.regions, self.allowed.distance)

    @cached_property
    def width(self) -> float:
        """Width of the diffusion that makes boundaries fair."""
        least = _NECK * (self.settings.min_neck or 0.0)
        return max(_WIDTH * float(self.copy.mesh.edge_lengths.mean()), least)

    @cached_property
    def first_patches(self) -> list[Ints]:
        mesh, lines = self.copy.mesh, self.copy.lines
        return [patches(mesh, count, lines) for count in _PATCHES]

    def merged(
        self, label: Ints, level: Array, compact: float, ground: Ground | None = None
    ) -> Ints:
        """Merge regions up to a bound (m,) on the estimate, given for each face."""
        bound = np.log(np.maximum(level, 1e-12))

        def estimate(faces: Ints) -> float | None:
            found = self.estimate(faces)
            area = self.regions.face_area[faces]
            return found and found / float(np.exp(area @ bound[faces] / area.sum()))

        merging = Merging(ground or self.ground, label, 1.0, compact, estimate)
        return numbered(merging.run())

    def divided(self, level: float) -> list[Ints]:
        """Return regions for a bound on the estimate, the best first."""
        bound = np.full(len(self.copy.mesh.faces), level)
        found = []
        for label in self.first_patches:
            for compact in _COMPACT:
                own = self.regions.fair(self.merged(label, bound, compact), self.width)
                halved = self._in_halves(own, level)
                some = [halved] if int(own.max()) >= _FEW else [own, halved]
                found += [self.alike(self.without_small(one, _SMALL)) for one in some]
        found.sort(key=self.value)
        return [x for k, x in enumerate(found) if not any((x == y).all() for y in found[:k])]

    def fair(self, label: Ints, width: float) -> Ints:
        """Make the boundaries of regions fair that nearly are."""
        return self.regions.fair(label, width, rounds=1)

    def value(self, label: Ints) -> tuple[int, float, float]:
        """Rank regions by their number and the length of their boundaries."""
        faces, length = self.regions.beside
        seam = float(length[np.ptp(label[faces], axis=1) > 0].sum())
        size = float(np.sqrt(self.regions.face_area.sum()))
        return self.settings.value(int(label.max()) + 1, seam / size)

    def without_small(self, label: Ints, share: float = 0.0, tiny: float = TINY) -> Ints:
        """Merge small regions with their neighbours.

        They are smaller than a share of the mean, or so small that nobody would cut them: a share
        of the whole.
        """
        faces, length = self.regions.beside
        while True:
            size = np.bincount(label, self.regions.face_area)
            small = np.flatnonzero(size < max(share * size.mean(), tiny * size.sum()))
            a, b = label[faces].T
            for own in small[np.argsort(size[small], kind="stable")].tolist():
                out, back = (
                    x & self.joinable for x in ((a == own) & (b != own), (b == own) & (a != own))
                )
                shared = np.bincount(
                    np.r_[b[out], a[back]], np.r_[length[out], length[back]], len(size)
                )
                if shared.any():
                    label = numbered(np.where(label == own, shared.argmax(), label))
                    break
            else:
                return label

    def measured(
        self,
        label: Ints,
        width: float | None = None,
        most: float = np.inf,
        begin: Trial | None = None,
    ) -> Trial:
        """Solve and measure regions of the copy; repair them up to some excess.

        The solve may begin with the shape of another trial.
        """
        regions, width = self.regions, self.width if width is None else width
        fields = regions.fields(label, width)
        if self.mirror is not None:
            fields = self.mirror.symmetric(fields, self.mirror.partners(label))
        kept = self.copy.wanted_of_copy.kept
        divided = regions.cut_between(fields).along(kept, TINY)
        return tried(
            label,
            divided,
            self.opened(divided, kept, self.apexes),
            self.of_copy,
            None if begin is None else divided.moved_as(begin.divided, begin.untangled),
            _ITERATIONS,
            repairs=_REPAIRS,
            executor=self.settings.executor,
            width=width,
            most=most,
        )

    @cached_property
    def apexes(self) -> Ints:
        """Vertices of the copy at the apex of a cone, to which a piece has to be cut."""
        mesh = self.copy.mesh
        sharp = self.ground.potential.curvature > np.radians(_APEX)
        sharp &= ~mesh.half_edges.boundary_vertex
        number = np.bincount(self.copy.lines.ravel(), minlength=len(sharp))
        # Corners can be rounded; where more lines meet, they are the facets of a cone.
        sharp &= (number == 0) | (number > _CORNER)
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

    def opened(self, divided: Divided, kept: Ints, apexes: Ints) -> Pieces:
        """Cut between regions, along kept edges, to the apexes of cones, and until all is disks."""
        mesh, edges = divided.mesh, edges_between(divided.mesh, divided.label)
        edges = np.concatenate([edges, divided.lines(kept)])
        factor = None
        if self.plane is not None:
            # Cuts without a mirror image run in the plane of symmetry.
            away = np.abs(self.plane.height(mesh.vertices[mesh.edges].mean(axis=1)))
            factor = 1.0 + away / self.width
        ground = Ground.of(mesh, factor)
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

    def smaller(self, trial: Trial, excess: Array, halves: float = _LITTLE) -> Ints:
        """Divide the regions whose excess (k,) is more than one.

        Those with an excess up to `halves` are divided in two, others as the estimate says. Parts
        of regions that are small themselves may be smaller than others.
        """
        label, mesh = trial.label, self.copy.mesh
        if self.mirror is not None:
            excess = np.maximum(excess, excess[self.mirror.partners(label)])
        bad = excess > 1.0
        if not bad.any():
            return label
        level = np.zeros(len(label))
        for own in np.flatnonzero(bad):
            faces = np.flatnonzero(label == own)
            found = self.estimate(faces)
            found = LEVELS[0] if found is None else max(found, LEVELS[-1] / 2)
            level[faces] = found * float(np.clip(1.0 / excess[own], *_SMALLER))
        kept = np.concatenate([edges_between(mesh, label), self.copy.lines])
        finer = patches(mesh, max(_FINER, 4 * len(excess)), kept)
        start = numbered(np.where(bad[label], finer + len(excess), label))
        ground, regions = self.ground, self.regions
        avoided = np.asarray(self.copy.wanted_of_copy.avoided[mesh.faces].all(axis=1))
        if avoided[bad[label]].mean() > _HALF:
            # What seams should avoid is too large for one piece.
            ground = Ground.of(mesh, kept=ground.kept)
            regions = Regions(mesh, self.copy.lines)
        new = self.merged(start, level, _COMPACT[0], ground)
        new = self._in_two(label, new, bad & (excess <= halves))
        new = self._sides(label, new, trial.folds_only)
        fair = regions.fair(new, self.width, rounds=1)
        # The others stay as they are, since a solve that begins with their shape needs that.
        new = _inside(label, bad, new, fair)
        area = np.bincount(label, regions.face_area)
        tiny = float(np.clip(_HALF_OF * area[bad].min(initial=np.inf) / area.sum(), _TINIEST, TINY))
        return self.alike(self.without_small(regions.connected(numbered(new)), tiny=tiny))

    def _in_halves(self, label: Ints, level: float) -> Ints:
        """Divide regions that are far beyond a bound on the estimate at their silhouette.

        Where a region is thin, such as one side of an ear, diffusion gives it to its neighbour.
        """
        for _ in range(_HALVINGS):
            values = [self.estimate(np.flatnonzero(label == k)) for k in range(label.max() + 1)]
            bad = np.array([one is None or one > _BEYOND * level for one in values])
            if not bad.any():
                break
            new = self.fair(self._sides(label, label, bad), self.width)
            if np.array_equal(new, label):
                break
            label = new
        return label

    def _in_two(self, label: Ints, new: Ints, some: Flags) -> Ints:
        """Merge the parts of some regions (k,) that are divided until these are two.

        The pairs with the least estimate come first.
        """
        for own in np.flatnonzero(some):
            inside = label == own
            while len(parts := np.unique(new[inside])) > 2:
                pairs = self.neighbours(new)
                ranked = []
                for a, b in pairs[np.isin(pairs, parts).all(axis=1)].tolist():
                    found = self.estimate(np.flatnonzero((new == a) | (new == b)))
                    ranked.append((np.inf if found is None else found, a, b))
                if not ranked:
                    break
                _, a, b = min(ranked)
                new = np.where(new == b, a, new)
        return numbered(new)

    def _sides(self, label: Ints, new: Ints, some: Flags) -> Ints:
        """Divide some regions (k,) at the silhouette of what sticks out, such as a fin or an ear.

        There a developable piece around both sides is folded. The sides are those by the normals of
        faces, in the direction in which these differ most. Other faces keep their new region.
        """
        new, area = new.copy(), self.regions.face_area
        normals = metrics.face_normals(self.copy.mesh)
        for own in np.flatnonzero(some):
            inside = label == own
            size, normal = area[inside], normals[inside]
            mean = size @ normal / size.sum()
            spread = (normal - mean).T @ (size[:, None] * (normal - mean))
            side = (normal - mean) @ np.linalg.eigh(spread)[1][:, -1] > 0.0
            new[inside] = int(new.max()) + 1 + side
        return numbered(new)

    def alike(self, label: Ints) -> Ints:
        """Make regions symmetric if they are to be."""
        return label if self.mirror is None else self.without_small(self.mirror.alike(label))

    def base_fields(self, label: Ints, width: float) -> Array:
        """Diffuse regions of the copy on the base: fields (p, k)."""
        fields = base_fields(self.base_regions, self.regions, self.copy, label, width)
        if self.mirror is None or self.base_mirror is None:
            return fields
        return self.base_mirror.symmetric(fields, self.mirror.partners(label))


def _inside(label: Ints, some: Flags, new: Ints, fair: Ints) -> Ints:
    """Return new regions with fair boundaries inside some regions (k,); others keep their faces."""
    count = int(label.max()) + 1
    inside = some[label]
    # The regions that the fair ones are inside.
    own = np.full((int(fair.max()) + 1, count), 0)
    np.add.at(own, (fair[inside], label[inside]), 1)
    same = inside & (own.argmax(axis=1)[fair] == label)
    return np.where(same, count + fair, np.where(inside, count + int(fair.max()) + 1 + new, label))
