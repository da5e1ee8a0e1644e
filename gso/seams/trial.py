"""A division of a design into regions, solved and measured piece by piece.

:mod:`gso.seams.trial_solve` makes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso import faults, metrics
from gso.cut_pieces import Pieces
from gso.mesh import Mesh, Nearest
from gso.mesh.topology import neighbour_means
from gso.result import Result
from gso.seams.candidates import Candidate
from gso.seams.cutting import cut
from gso.seams.facets import FACETS, facet_ratio
from gso.seams.inverted_faces import inverted_at_seams
from gso.seams.kinds import Edges
from gso.seams.regions import Divided
from gso.seams.sheets import Sheet
from gso.seams.splitting import apart
from gso.tasks.developable import Options
from gso.typing import Array, Flags, Ints
from gso.verdict import Code

#: What a folded face adds to a piece's excess, and the exponent and largest value of that of the
#: strain, which says less than the distance how much smaller a piece has to be.
_FOLD, _ROOT, _MOST = 0.02, 0.25, 2.5
#: Rounds in which vertices of folds move between their neighbours.
_ROUNDS = 10


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
    divided : Divided
        That mesh, with triangles on seams divided.
    pieces : Pieces
        The pieces of the regions.
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
    outward : float
        Largest distance of a vertex from the design over the allowed one.
    width : float
        Of the diffusion that made the boundaries fair.
    options : Options
        Of the solve.
    """

    label: Ints
    divided: Divided
    pieces: Pieces
    region: Ints
    result: Result | None
    sheets: tuple[Sheet | None, ...]
    distance: Array
    strain: Array
    built: bool
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
    def crossed(self) -> Ints:
        """The faces that pass through others."""
        return np.unique(faults.crossings(self.shape.design))

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
        out = np.maximum(self.too_large, self.facets if self.facets > 1.0 else 0.0)
        if not self.built:
            return out
        crossed = self._number(self.crossed)
        return np.maximum(out, np.where(crossed > 0, _faulty(crossed), 0.0))

    @cached_property
    def too_large(self) -> Array:
        """What smaller pieces may need less of (p,), over what is allowed."""
        strain = np.where(
            self.strain > 1.0, np.minimum(np.maximum(self.strain, 1.0) ** _ROOT, _MOST), 0.0
        )
        folds = np.where(self.folds > 0, _faulty(self.folds), 0.0)
        slivers = np.where(self.slivers > 0, _faulty(self.slivers), 0.0)
        return np.asarray(np.max([self.distance, strain, folds, slivers], axis=0))

    @cached_property
    def facets(self) -> float:
        """Mean angle between faces inside pieces over that of a design which counts as smooth."""
        return 0.0 if self.result is None else facet_ratio(self.result) / FACETS

    @property
    def holds(self) -> bool:
        """Whether all pieces hold what is allowed."""
        return self.worst <= 1.0

    @cached_property
    def worst(self) -> float:
        """The largest excess of a piece."""
        return float(self.excess.max())

    @property
    def folds_only(self) -> Flags:
        """Whether each region (k,) has folds, and holds the distance."""
        folds, distance = self.of_regions(self.folds), self.of_regions(self.distance)
        return np.asarray((folds > 0) & (distance <= 1.0))

    @cached_property
    def untangled(self) -> Array:
        """The solved points (n, 3), with the vertices of folded faces between their neighbours.

        Those on seams move to the middle of their neighbours on the seam, if there are two.
        """
        shape, mesh = self.shape, self.shape.design
        points, n = mesh.vertices.copy(), len(mesh.vertices)
        on, rim = np.zeros(n, bool), mesh.half_edges.boundary_vertex
        on[shape.edges] = True
        inner, along = (neighbour_means(edges, n) for edges in (mesh.edges, shape.edges))
        some = np.zeros(n, bool)
        some[mesh.faces[self.folded]] = True
        free = some & ~on & ~rim
        seam = some & (np.bincount(shape.edges.ravel(), minlength=n) == 2) & ~rim
        for _ in range(_ROUNDS):
            moved = points.copy()
            moved[free] = (inner @ points)[free]
            moved[seam] = (along @ points)[seam]
            points = 0.5 * (points + moved)
        return np.asarray(points)

    def of_regions(self, value: Array | Ints | None = None) -> Array:
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
        return solved(self.pieces, self.result)


def _faulty(number: Ints) -> Array:
    """Return the excess of pieces with a number of faulty faces."""
    return np.asarray(np.minimum(1.0 + _FOLD * number, _MOST))


def solved(pieces: Pieces, result: Result | None) -> Pieces:
    """Return pieces after a solve, if there was one."""
    return pieces if result is None or result.pieces is None else result.pieces
