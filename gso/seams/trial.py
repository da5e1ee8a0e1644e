"""A division of a design into regions, solved and measured piece by piece."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gso import faults, metrics
from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.executors import SERIAL, Executor
from gso.mesh import Mesh, Nearest
from gso.mesh.topology import edge_keys, neighbour_means, pair_keys
from gso.result import Result
from gso.seams.candidates import Candidate
from gso.seams.corrections import Corrections
from gso.seams.cutting import cut
from gso.seams.facets import FACETS, facet_ratio
from gso.seams.inverted_faces import inverted_at_seams
from gso.seams.joint_solve import solve_pieces
from gso.seams.kinds import Edges
from gso.seams.regions import Divided, with_flips
from gso.seams.sheets import Sheet, laid
from gso.seams.splitting import apart
from gso.tasks.developable import Options
from gso.tasks.request import Request
from gso.tasks.start import Start
from gso.typing import Array, Flags, Ints
from gso.verdict import Code

#: Share of the allowed distance beyond which the solver penalises it, and the weight of that.
_REACH, _WEIGHT = 0.9, 5000.0
#: Weight of a barrier against folds.
_FACING = 0.05
#: Factors on the weights of fairness, curvature and proximity of the joint solve.
_FAIR, _CURVED, _NEAR = 3.0, 2.0, 0.3
#: What a folded face adds to a piece's excess, and the exponent and largest value of that of the
#: strain, which says less than the distance how much smaller a piece has to be.
_FOLD, _ROOT, _MOST = 0.02, 0.25, 2.5
#: Largest distance, strain and number of folds (a share of the faces, and a number) of a result
#: that is solved again with more weight on what is too large.
_FAR, _STRAINED, _DOUBTFUL_FOLDS, _SOME_FOLDS = 1.6, 12.0, 0.03, 12
#: Largest distance of a point of the design from such a result.
_FARTHER = 2.5
#: Largest strain where the shape to begin with is known to hold on a copy.
_KNOWN = 200.0
#: Distance that is then aimed at, factor on the weight of curvature, number of iterations, and the
#: rounds in which vertices of folds move between their neighbours.
_BELOW, _MORE, _AGAIN, _ROUNDS = 0.98, (1.2, 4.0), 12, 10
#: How often a solve begins again from the design; the largest distance of a result after which it
#: does, the factor on the weight of curvature where the strain is too large, and that where it is
#: below some share of what is allowed, and the distance is too large.
_COLD, _NEAR_ENOUGH, _MUCH_MORE, _LESS, _UNUSED = 3, 1.15, 8.0, 0.6, 0.3
#: Factor on the weight of fairness where that of curvature grows much, or where there are facets.
_SMOOTHER = 2.5
#: By how much points inside faces may be farther away than vertices.
_INSIDE = 1.05
#: Factor on the weight of distances beyond those that are aimed at, where they are too large.
_NEARER = 2.0
#: Range of the factor on the weight of fairness where faces are folded, and what each of them adds.
_FAIRER, _SHARE_OF_FOLDS = (2.5, 8.0), 0.15
#: Excess up to which little is missing.
_CLOSE = 1.08
#: Ratio of what a result needs to the least before, up to which it becomes much less.
_PROGRESS = 0.8
#: Angle in degrees from which on an edge of a folded face is flipped.
_FOLDED = 90.0
#: Share of the allowed distance from which on points inside faces are measured, too.
_DOUBTFUL = 0.7


@dataclass(frozen=True, eq=False)
class Allowed:
    """What pieces are measured by: largest distance from a design, and strain.

    What is to be `built` does not pass through itself; a copy of the design may.
    """

    design: Mesh
    distance: float
    strain: float
    built: bool = True

    @cached_property
    def near(self) -> Nearest:
        """The closest points of the design."""
        return Nearest(self.design)


@dataclass(frozen=True, eq=False)
class Trial:
    """Regions of a mesh with the joint solve of their pieces.

    Attributes
    ----------
    label : ndarray of int, (m,)
        The region of each face of the mesh that was divided.
    pieces : Pieces
        The pieces of the regions; triangles on seams are divided.
    region : ndarray of int, (p,)
        The region of each piece.
    result : Result or None
        The joint solve; None where no vertex is inside a piece.
    sheets : tuple of Sheet or None
        The pattern of each piece; None where there is none.
    distance, strain : ndarray, (p,)
        Largest distance of each piece from the design, and strain of its pattern, over what is
        allowed.
    built : bool
        Whether the pieces are to be built.
    crossed : ndarray of int
        Faces that pass through others, if they are.
    outward : float
        Largest distance of a vertex from the design over the allowed one.
    width : float
        Of the diffusion that made the boundaries fair.
    options : Options
        Of the solve.
    """

    label: Ints
    pieces: Pieces
    region: Ints
    result: Result | None
    sheets: tuple[Sheet | None, ...]
    distance: Array
    strain: Array
    built: bool
    crossed: Ints
    outward: float
    width: float
    options: Options

    @cached_property
    def folded(self) -> Ints:
        """The faces that are folded inside pieces or onto others, and are not in the design."""
        before = faults.folded(self.pieces.opened.mesh)
        found = np.setdiff1d(faults.folded(self.shape.opened.mesh), before)
        if self.result is None or self.result.pieces is None:
            return found
        return np.union1d(found, inverted_at_seams(self.result))

    @cached_property
    def folds(self) -> Ints:
        """Number of these of each piece (p,)."""
        return self._number(self.folded)

    @cached_property
    def slivers(self) -> Ints:
        """Number of pairs of faces that overlap in patterns (p,) which lose too small parts for it.

        Patterns of a copy, which is not to be built, may overlap.
        """
        out = np.zeros(len(self.sheets), np.int64)
        if not self.built:
            return out
        least = (Code.SMALL.info.limit or 0.0) * metrics.area(self.shape.design)
        for k, sheet in enumerate(self.sheets):
            if sheet is not None and len(sheet.overlaps):
                parts = cut(sheet.mesh, Edges(apart(sheet)))
                if min(metrics.area(part.mesh) for part in parts) < least:
                    out[k] = len(sheet.overlaps)
        return out

    def _number(self, faces: Ints) -> Ints:
        """Count faces of each piece (p,)."""
        return np.bincount(self.shape.of_face[faces], minlength=len(self.region))

    @cached_property
    def excess(self) -> Array:
        """What each piece (p,) needs over what is allowed: up to 1 it holds."""
        crossed = self._number(self.crossed)
        return np.maximum(self.too_large, np.where(crossed > 0, _faulty(crossed), 0.0))

    @cached_property
    def too_large(self) -> Array:
        """What smaller pieces may need less of (p,), over what is allowed."""
        strain = np.where(
            self.strain > 1.0, np.minimum(np.maximum(self.strain, 1.0) ** _ROOT, _MOST), 0.0
        )
        folds = np.where(self.folds > 0, _faulty(self.folds), 0.0)
        slivers = np.where(self.slivers > 0, _faulty(self.slivers), 0.0)
        facets = np.full(len(self.region), self.facets if self.facets > 1.0 else 0.0)
        return np.asarray(np.max([self.distance, strain, folds, slivers, facets], axis=0))

    @cached_property
    def facets(self) -> float:
        """Mean angle between faces inside pieces over that of a design which counts as smooth."""
        return 0.0 if self.result is None else facet_ratio(self.result) / FACETS

    @property
    def holds(self) -> bool:
        """Whether all pieces hold what is allowed."""
        return bool((self.excess <= 1.0).all())

    @property
    def folds_only(self) -> Flags:
        """Whether each region (k,) has folds, and holds the distance."""
        out = np.zeros((2, int(self.label.max()) + 1), bool)
        np.logical_or.at(out[0], self.region, self.folds > 0)
        np.logical_or.at(out[1], self.region, self.distance > 1.0)
        return np.asarray(out[0] & ~out[1])

    @cached_property
    def untangled(self) -> Array:
        """The solved points (n, 3), those of folded faces between their neighbours."""
        return _untangled(self)

    def of_regions(self, value: Array | None = None) -> Array:
        """Return the largest excess, or other value, of the pieces of each region (k,)."""
        out = np.zeros(int(self.label.max()) + 1)
        np.maximum.at(out, self.region, self.excess if value is None else value)
        return out

    @cached_property
    def lengths(self) -> Array:
        """Length of each pattern (p,); infinite where there is none."""
        return np.array([np.inf if sheet is None else sheet.size[0] for sheet in self.sheets])

    def necks(self, limit: float) -> Array:
        """Return the width of each piece's narrowest place, or a limit where that is less."""
        return Candidate(self.shape, self.sheets).necks(limit)

    @property
    def shape(self) -> Pieces:
        """The pieces after the solve."""
        return _solved(self.pieces, self.result)


def _faulty(number: Ints) -> Array:
    """Return the excess of pieces with a number of faulty faces."""
    return np.asarray(np.minimum(1.0 + _FOLD * number, _MOST))


def _solved(pieces: Pieces, result: Result | None) -> Pieces:
    """Return pieces after a solve, if there was one."""
    return pieces if result is None or result.pieces is None else result.pieces


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
    own, known = options_for(allowed.distance), start is not None
    if options is not None:
        own = replace(options, reach=own.reach)
    first, found = start, list[Trial]()
    needs: list[float] = []
    corrections = Corrections(pieces, allowed.distance)
    if start is not None:
        corrections.measure(pieces.design.replaced(start))
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
        # As long as it has not gone on from its own shape.
        fresh = start is first and number < (_COLD if first is None else 1)
        # Where it began with a shape, that is as far as the distance alone is missing.
        fresh &= first is None or bool(trial.strain.max() <= 1.0)
        again = _begun_again(own, trial) if fresh else None
        if again is not None:
            own = again
            continue
        if not _repairable(trial, known) or (start is None and trial.excess.max() > most):
            break
        needs.append(float(max(trial.distance.max(), trial.strain.max())))
        if number >= repairs and needs[-1] > max(_CLOSE, _PROGRESS * min(needs[:-1], default=0.0)):
            break
        own = _stricter(own, trial)
        corrections.measure(trial.shape.design)
        start, iterations = trial.untangled, _AGAIN
        pieces = _with_flips(trial)
    return min(found, key=lambda one: float(one.excess.max()))


def _begun_again(options: Options, trial: Trial) -> Options | None:
    """Return settings with which a solve from the design may hold, where one from there nearly did.

    None where that is not likely. A solve that goes on from a shape with other weights folds more
    often than one that begins again.
    """
    far, strain = float(trial.distance.max()), float(trial.strain.max())
    if far > _NEAR_ENOUGH or strain > _KNOWN or trial.folds.sum() > _SOME_FOLDS:
        return None
    if strain > 1.0:
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
        reach, weight = options.reach * _BELOW / far, _NEARER * options.w_reach
        options = replace(options, reach=reach, w_reach=weight)
    if trial.folds.any():
        fairer = float(np.clip(_SHARE_OF_FOLDS * trial.folds.sum(), *_FAIRER))
        options = replace(options, w_fairness=fairer * options.w_fairness)
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
    shape = _solved(pieces, result)
    sheets = tuple(executor.map(laid, [part.mesh for part in shape.parts]))
    strain = np.array([np.inf if one is None else one.strain for one in sheets]) / allowed.strain
    far, outward = _away(shape, allowed)
    crossed = np.unique(faults.crossings(shape.design)) if allowed.built else np.empty(0, np.int64)
    return Trial(
        label,
        pieces,
        region,
        result,
        sheets,
        far,
        strain,
        allowed.built,
        crossed,
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
    seam = np.isin(
        edge_keys(he.origin[k], he.dest[k], len(mesh.vertices)),
        pair_keys(shape.edges, len(mesh.vertices)),
    )
    some = bad[f] & bad[g] & ~seam & (metrics.dihedral_angles(mesh) > _FOLDED)
    if not some.any():
        return trial.pieces
    try:
        return cut(with_flips(design, k[some]), Edges(trial.pieces.edges))
    except MeshError:
        # A triangle would have no area.
        return trial.pieces


def _untangled(trial: Trial) -> Array:
    """Return the solved points (n, 3) with the vertices of folded faces between their neighbours.

    Those on seams move to the middle of their neighbours on the seam, if there are two.
    """
    shape, mesh = trial.shape, trial.shape.design
    points, n = mesh.vertices.copy(), len(mesh.vertices)
    on, rim = np.zeros(n, bool), mesh.half_edges.boundary_vertex
    on[shape.edges] = True

    inner, along = (neighbour_means(edges, n) for edges in (mesh.edges, shape.edges))
    some = np.zeros(n, bool)
    some[mesh.faces[trial.folded]] = True
    free = some & ~on & ~rim
    seam = some & (np.bincount(shape.edges.ravel(), minlength=n) == 2) & ~rim
    for _ in range(_ROUNDS):
        moved = points.copy()
        moved[free] = (inner @ points)[free]
        moved[seam] = (along @ points)[seam]
        points = 0.5 * (points + moved)
    return np.asarray(points)
