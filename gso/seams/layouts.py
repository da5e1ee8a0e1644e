"""Cuts of a mesh along edges, compared by what is measured on the flat patterns of their pieces.

A piece is laid flat once. Another cut costs only what it changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso import metrics
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.seams.candidates import Candidate, fits
from gso.seams.cutting import cut
from gso.seams.kinds import Edges
from gso.seams.options import NARROWEST, PieceSettings
from gso.seams.potential import Potential
from gso.seams.sheets import Sheet, flattened
from gso.seams.tree import Ground
from gso.typing import Flags, Ints
from gso.verdict import Code

#: How much larger than the least area and width of a part pieces are to be.
_CLEAR = 1.2
#: Number of faces that a small piece counts as when it is laid flat.
_LEAST = 150
#: Share of the allowed strain that is aimed at before seams are straightened.
_ROOM = 0.94
#: What a piece without a pattern, and one that overlaps or is inverted, adds to the excess.
_NONE, _FOLDED = 10.0, 1.0


@dataclass(frozen=True)
class Part:
    """What is measured on one piece.

    Attributes
    ----------
    sheet : Sheet or None
    excess : float
        Zero if the pattern holds what is allowed; more, the farther it is from that.
    small, narrow : bool
        Whether the piece, or its narrowest place, is too small.
    """

    sheet: Sheet | None
    excess: float
    small: bool
    narrow: bool

    @property
    def faults(self) -> tuple[float, int, int]:
        """The excess, and whether the piece is too small and too narrow."""
        return self.excess, int(self.small), int(self.narrow)


Faults = tuple[float, int, int]


@dataclass(frozen=True, eq=False)
class Layout:
    """A mesh cut along edges.

    Attributes
    ----------
    cut : ndarray of bool, (e,)
        The edges of ``mesh.edges`` that are cut.
    label : ndarray of int, (m,)
        The piece of each face.
    corner : ndarray of int, (m, 3 or 4)
        The copy of the vertex at each corner, -1 for none.
    length : float
        What the seams cost, relative to the root of the area.
    """

    cut: Flags
    label: Ints
    corner: Ints
    length: float

    @cached_property
    def members(self) -> list[Ints]:
        """The faces of each piece."""
        order = np.argsort(self.label, kind="stable")
        return np.split(order, np.cumsum(np.bincount(self.label))[:-1])

    @cached_property
    def names(self) -> tuple[bytes, ...]:
        """What identifies each piece."""
        out = []
        for faces in self.members:
            local = np.unique(self.corner[faces], return_inverse=True)[1].astype(np.int32)
            out.append(faces.astype(np.int32).tobytes() + local.tobytes())
        return tuple(out)


class Layouts:
    """Measures pieces of a design, each once.

    Parameters
    ----------
    ground : Ground
    settings : PieceSettings
    most : int
        Number of faces that are laid flat at most, all pieces together.
    """

    def __init__(self, ground: Ground, settings: PieceSettings, most: int):
        self.ground, self.settings, self.left = ground, settings, most
        #: Strain that is aimed at: straight seams need some room.
        self.aim = (_ROOM if ground.mesh.is_triangles else 1.0) * settings.max_strain
        mesh, he = ground.mesh, ground.mesh.half_edges
        k = he.interior
        self.number = mesh.edge_numbers(he.origin[k], he.dest[k])
        self.sides = np.stack([he.face[k], he.face[he.twin[k]]], axis=1)
        self.inner = np.zeros(len(mesh.edges), bool)
        self.inner[self.number] = True
        #: Area of each face (m,).
        self.face_area = metrics.face_areas(mesh)
        self.root = float(np.sqrt(metrics.area(mesh)))
        cost = mesh.edge_lengths if ground.factor is None else mesh.edge_lengths * ground.factor
        self.cost = np.where(self.inner, cost, 0.0) / self.root
        self.kept = self.marked(ground.kept.reshape(-1, 2))
        self._known: dict[bytes, Part] = {}

    def of(self, cut_edges: Flags) -> Layout:
        """Cut along edges (e,), with those that stay, and without seams that end inside."""
        mesh, he = self.ground.mesh, self.ground.mesh.half_edges
        apart = self.pruned((cut_edges | self.kept) & self.inner)
        joined = ~apart[self.number]
        label = label_components(len(mesh.faces), *self.sides[joined].T)
        divided = np.ones(len(he.twin), bool)
        k = he.interior
        divided[k] = divided[he.twin[k]] = apart[self.number]
        after = he.twin[he.prev]
        same = np.flatnonzero((after >= 0) & ~divided[he.prev])
        corner = np.full(mesh.faces.shape, -1)
        corner[mesh.faces >= 0] = label_components(len(he.twin), same, after[same])
        return Layout(apart, label, corner, float(self.cost[apart].sum()))

    def marked(self, edges: Ints) -> Flags:
        """Mark edges (k, 2), given by their vertices, among all (e,)."""
        mesh = self.ground.mesh
        out = np.zeros(len(mesh.edges), bool)
        out[mesh.edge_numbers(edges[:, 0], edges[:, 1])] = True
        return out

    def between(self, label: Ints) -> Flags:
        """Mark the edges (e,) between pieces (m,)."""
        out = np.zeros(len(self.inner), bool)
        out[self.number] = label[self.sides[:, 0]] != label[self.sides[:, 1]]
        return out

    def pruned(self, cut_edges: Flags) -> Flags:
        """Leave out seams (e,) that end inside the surface; those that stay are left."""
        mesh, out = self.ground.mesh, np.array(cut_edges)
        rim = mesh.half_edges.boundary_vertex
        while True:
            some = np.flatnonzero(out)
            ends = mesh.edges[some]
            number = np.bincount(ends.ravel(), minlength=len(mesh.vertices))
            free = (number[ends] == 1) & ~rim[ends]
            loose = np.asarray(free.any(axis=1)) & ~self.kept[some]
            if not loose.any():
                return out
            out[some[loose]] = False

    def mesh_of(self, layout: Layout, piece: int) -> tuple[Mesh, Ints]:
        """Return a piece as a mesh, and its vertices in the design."""
        mesh, faces = self.ground.mesh, layout.members[piece]
        own = layout.corner[faces]
        real = own >= 0
        ids, local = np.unique(own[real], return_inverse=True)
        table = np.full(own.shape, -1)
        table[real] = local
        vertex = np.empty(len(ids), np.int64)
        vertex[local] = mesh.faces[faces][real]
        return Mesh(mesh.vertices[vertex], table), vertex

    def part(self, layout: Layout, piece: int) -> Part:
        """Measure a piece."""
        name = layout.names[piece]
        if name not in self._known:
            mesh, _ = self.mesh_of(layout, piece)
            disk = len(mesh.boundary_loops) == 1 and mesh.euler_characteristic == 1
            sheet = None
            if disk:
                self.left -= max(len(mesh.faces), _LEAST)
                sheet = flattened(mesh)
            self._known[name] = self._part(mesh, sheet)
        return self._known[name]

    def strain(self, layout: Layout, piece: int) -> float:
        """Return the largest strain of a piece; infinite without a pattern."""
        sheet = self.part(layout, piece).sheet
        return np.inf if sheet is None else sheet.strain

    def _part(self, mesh: Mesh, sheet: Sheet | None) -> Part:
        area = metrics.area(mesh)
        small = area < _CLEAR * float(Code.SMALL.info.limit or 0.0) * self.root**2
        if sheet is None:
            return Part(None, _NONE, small, False)
        settings, root = self.settings, float(np.sqrt(area))
        excess = max(float(np.log(max(sheet.strain, 1e-300) / settings.max_strain)), 0.0)
        if not sheet.sound:
            excess += _FOLDED
        if settings.max_size is not None and not fits(sheet, settings.max_size):
            excess += _FOLDED
        least = _CLEAR * float(Code.NARROW.info.limit or 0.0) * self.ground.mesh.size
        small = small or sheet.mean_width < least
        if settings.min_size is not None:
            small = small or sheet.size[0] < settings.min_size
        neck = max(NARROWEST * root, settings.min_neck or 0.0)
        return Part(sheet, excess, small, sheet.neck(1.01 * neck) < neck)

    def estimate(self, layout: Layout, piece: int) -> float:
        """Estimate the largest strain of a piece; infinite where it is no disk."""
        mesh, _ = self.mesh_of(layout, piece)
        if len(mesh.boundary_loops) != 1 or mesh.euler_characteristic != 1:
            return np.inf
        scale = Potential(mesh).solve(mesh.half_edges.boundary_vertex)
        return 0.5 * float(np.ptp(scale))

    def faults(self, layout: Layout) -> Faults:
        """Add up the faults of all pieces."""
        return total([self.part(layout, k) for k in range(len(layout.names))])

    def value(self, layout: Layout) -> tuple[float, float, float]:
        """Rank seams by :meth:`PieceSettings.value`."""
        return self.settings.value(len(layout.names), layout.length)

    def better(self, new: Layout, old: Layout, likely: float = np.inf) -> bool:
        """Tell whether a cut is better than another one, by the pieces that differ.

        Parameters
        ----------
        new, old : Layout
        likely : float
            Ratio of the estimated strain to the bound up to which pieces are laid flat.
        """
        changed, gone = self.changed(new, old), self.changed(old, new)
        limit = total([self.part(old, k) for k in gone])
        improves = self.value(new) < self.value(old)
        if not improves and limit == (0.0, 0, 0):
            return False
        most = max([self.aim, *(self.strain(old, k) for k in gone)])
        if likely < np.inf:
            unknown = [k for k in changed if new.names[k] not in self._known]
            if any(self.estimate(new, k) > likely * most for k in unknown):
                return False
        found: list[Part] = []
        for k in sorted(changed, key=lambda k: len(new.members[k])):
            found.append(self.part(new, k))
            if total(found)[0] > limit[0] or self.strain(new, k) > most:
                return False
        now = total(found)
        return now < limit or (now == limit and improves)

    @staticmethod
    def changed(new: Layout, old: Layout) -> list[int]:
        """List the pieces of a cut that are none of another one."""
        before = set(old.names)
        return [k for k, name in enumerate(new.names) if name not in before]

    def candidate(self, layout: Layout) -> Candidate:
        """Return the pieces with their patterns."""
        mesh = self.ground.mesh
        pieces = cut(mesh, Edges(mesh.edges[layout.cut]))
        of = layout.label[[int(piece.faces[0]) for piece in pieces]]
        sheets: list[Sheet | None] = []
        for piece, k in zip(pieces, of.tolist(), strict=True):
            sheet = self.part(layout, k).sheet
            if sheet is None:
                sheets.append(None)
                continue
            flat = np.empty((len(piece.mesh.vertices), 2))
            real = piece.mesh.faces >= 0
            flat[piece.mesh.faces[real]] = sheet.flat[sheet.mesh.faces[real]]
            sheets.append(Sheet(piece.mesh, flat))
        return Candidate(pieces, tuple(sheets))


def total(parts: list[Part]) -> Faults:
    """Add up faults; excesses that differ by rounding are equal."""
    excess = round(sum(part.excess for part in parts), 6)
    return excess, sum(part.small for part in parts), sum(part.narrow for part in parts)
