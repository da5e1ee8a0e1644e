"""The few kinds of equations on vertices that all constraints consist of.

Hard `Pins`, `Relations` and `OnPlane` are linear, and are eliminated from the unknowns (see
:mod:`gso.constraints.linear`). The others are terms. A new kind of part derives from
:class:`Part`; it gives its equivalent linear parts or its terms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np

from gso import geometry
from gso.energy import STIFF, Term, Weighted, curve, equation, hardened, length, planarity, position
from gso.hierarchy import Transfer
from gso.mesh import Frame, Polylines
from gso.typing import Array, Flags, Ints

P = TypeVar("P", bound="Part")


@dataclass(frozen=True)
class Part:
    """Equations of one constraint.

    Attributes
    ----------
    owner : int
        Number of the constraint.
    """

    #: Fields of vertex numbers, (k,) or (k, .), and other fields with a row for each equation.
    INDICES: ClassVar[tuple[str, ...]] = ("ids",)
    ROWS: ClassVar[tuple[str, ...]] = ()
    #: Fields that are positions, and fields that are lengths.
    POSITIONS: ClassVar[tuple[str, ...]] = ()
    LENGTHS: ClassVar[tuple[str, ...]] = ()

    owner: int

    def mapped(self: P, frame: Frame, order: Ints) -> P:
        """Return the part in the unit of a frame, with vertex i numbered ``order[i]``."""
        new = {name: order[getattr(self, name)] for name in self.INDICES}
        new |= {name: frame.to_unit(getattr(self, name)) for name in self.POSITIONS}
        return replace(self, **new, **{n: getattr(self, n) / frame.scale for n in self.LENGTHS})

    def kept(self: P, rows: Flags) -> P:
        """Return the part with only those equations that a mask (k,) selects."""
        return replace(self, **{n: getattr(self, n)[rows] for n in (*self.INDICES, *self.ROWS)})

    def on(self, transfer: Transfer) -> Part | None:
        """Return equations like these on a coarser copy of the design; None if it has none.

        They lead the solve on coarser meshes, so they may be approximate. A soft part without them
        is left out there. A hard part without them means that the solve has no coarser meshes.
        """
        return None

    def violation(self, points: Array) -> Array:
        """Return the violation of each equation (a length) by vertices (n, dim)."""
        raise NotImplementedError

    @property
    def hard(self) -> bool:
        """Whether the equations must hold exactly."""
        return getattr(self, "weight", None) is None

    @property
    def vertices(self) -> Ints:
        """Vertices of each equation, (k, .)."""
        return np.column_stack([getattr(self, name) for name in self.INDICES])

    @property
    def count(self) -> int:
        """Number of equations."""
        return len(self.vertices)

    @property
    def anchored(self) -> bool:
        """Whether the equations refer to absolute positions."""
        return True

    @property
    def linear(self) -> tuple[Part, ...]:
        """Equivalent `Pins`, `Relations` and `OnPlane`, which are eliminated from the unknowns."""
        return ()

    def items(self, block: str) -> list[Weighted]:
        """Return the terms of equations that are not eliminated, on a block of coordinates."""
        return []

    def soft_term(self, block: str) -> Term | None:
        """Return a soft term of weight one by which a start approaches the constraint."""
        return None

    def targets(self, points: Array) -> tuple[Ints, Array] | None:
        """Return the vertices (k,) and positions (k, dim) near points that satisfy soft equations.

        None where the equations are eliminated, or give no positions.
        """
        return None


@dataclass(frozen=True)
class Pins(Part):
    """Vertices `ids` (k,) are at `positions` (k, dim); the part is soft if it has a weight."""

    ROWS = POSITIONS = ("positions",)

    ids: Ints
    positions: Array
    weight: float | None = None

    def on(self, transfer: Transfer) -> Pins | None:
        ids, rows = _kept(transfer, self.ids)
        if not len(ids):
            return None
        return replace(self, ids=ids, positions=self.positions[rows] + transfer.shift[ids])

    def violation(self, points: Array) -> Array:
        return np.asarray(np.linalg.norm(points[self.ids] - self.positions, axis=1))

    @property
    def linear(self) -> tuple[Part, ...]:
        return (self,) if self.hard else ()

    def items(self, block: str) -> list[Weighted]:
        if self.weight is None:
            return []
        weights = np.full(len(self.ids), self.weight)
        return [Weighted(position.build(self.ids, self.positions, weights, block=block), 1.0)]

    def soft_term(self, block: str) -> Term:
        return position.build(self.ids, self.positions, np.ones(len(self.ids)), block=block)

    def targets(self, points: Array) -> tuple[Ints, Array] | None:
        return None if self.hard else (self.ids, self.positions)


@dataclass(frozen=True)
class Relations(Part):
    """``p[second] = anchor + matrix (p[first] - anchor)``, `matrix` orthogonal."""

    INDICES = ("first", "second")
    POSITIONS = ("anchor",)

    first: Ints
    second: Ints
    matrix: Array
    anchor: Array

    def on(self, transfer: Transfer) -> Relations | None:
        first, second = transfer.place(self.first), transfer.place(self.second)
        # A vertex whose partner is not in the coarser mesh would be free.
        if ((first < 0) != (second < 0)).any() or not (first >= 0).any():
            return None
        return replace(self, first=first[first >= 0], second=second[first >= 0])

    def violation(self, points: Array) -> Array:
        image = self.anchor + (points[self.first] - self.anchor) @ self.matrix.T
        return np.asarray(np.linalg.norm(points[self.second] - image, axis=1))

    @property
    def is_glue(self) -> bool:
        """Whether the part makes vertices coincide."""
        return bool((self.matrix == np.eye(len(self.matrix))).all())

    @property
    def anchored(self) -> bool:
        return not self.is_glue

    @property
    def linear(self) -> tuple[Part, ...]:
        return (self,)

    def soft_term(self, block: str) -> Term:
        dim, count = len(self.matrix), len(self.first)
        shift = self.anchor - self.matrix @ self.anchor
        each = np.concatenate([-self.matrix, np.eye(dim), shift[:, None]], axis=1)
        index = np.repeat(self.vertices, dim, axis=0)
        return equation.build(index, np.tile(each, (count, 1)), block=block)


@dataclass(frozen=True)
class OnPlane(Part):
    """Vertices `ids` lie on the plane (or line) through `anchor` with a unit `normal`."""

    POSITIONS = ("anchor",)

    ids: Ints
    normal: Array
    anchor: Array

    @property
    def offset(self) -> float:
        """The value of ``normal . x`` on the plane."""
        return float(self.anchor @ self.normal)

    def on(self, transfer: Transfer) -> OnPlane:
        # A plane of symmetry may lie between two rows of vertices.
        return replace(self, ids=_kept(transfer, self.ids)[0])

    def violation(self, points: Array) -> Array:
        return np.abs((points[self.ids] - self.anchor) @ self.normal)

    @property
    def linear(self) -> tuple[Part, ...]:
        return (self,)

    def soft_term(self, block: str) -> Term:
        row = np.r_[self.normal, self.normal @ self.anchor]
        return equation.build(self.vertices, np.tile(row, (len(self.ids), 1)), block=block)


L = TypeVar("L", bound="OnLines")


@dataclass(frozen=True)
class OnLines(Part):
    """Vertices `ids` lie on polylines."""

    ids: Ints
    lines: Polylines
    weight: float | None = None

    def mapped(self: L, frame: Frame, order: Ints) -> L:
        return replace(super().mapped(frame, order), lines=self.lines.mapped(frame))

    def on(self, transfer: Transfer) -> OnLines | None:
        ids, _ = _kept(transfer, self.ids)
        return replace(self, ids=ids) if len(ids) else None

    def violation(self, points: Array) -> Array:
        distance: Array = np.linalg.norm(
            points[self.ids] - self.lines.nearest(points[self.ids]).points, axis=1
        )
        return distance

    def items(self, block: str) -> list[Weighted]:
        term = curve.build(self.ids, self.lines, block=block, weight=self.weight)
        return [Weighted(term, STIFF if self.hard else 1.0)]

    def soft_term(self, block: str) -> Term:
        return curve.build(self.ids, self.lines, block=block, weight=1.0)

    def targets(self, points: Array) -> tuple[Ints, Array]:
        return self.ids, self.lines.nearest(points[self.ids]).points


@dataclass(frozen=True)
class Straight(OnLines):
    """Vertices `ids` lie on a line segment, which is straight on the surface: a ruling."""

    @property
    def ends(self) -> Array:
        """Both ends of the segment, (2, dim)."""
        return np.stack([self.lines.start[0], self.lines.end[-1]])


@dataclass(frozen=True)
class Planar(Part):
    """Quads (k, 4), each planar."""

    INDICES = ("quads",)

    quads: Ints
    weight: float | None = None

    def on(self, transfer: Transfer) -> Planar | None:
        """Constrain the quads of the copy whose corners are all corners of these quads."""
        faces = transfer.coarse.faces
        if faces.shape[1] == 3:
            return None
        ids, _ = _kept(transfer, np.unique(self.quads))
        inner = np.isin(faces, ids).all(axis=1)
        return replace(self, quads=faces[inner]) if inner.any() else None

    def violation(self, points: Array) -> Array:
        corners = (tuple(points[self.quads[:, k]].T) for k in range(4))
        return np.asarray(np.abs(geometry.diagonal_distance(*corners)))

    @property
    def anchored(self) -> bool:
        return False

    def items(self, block: str) -> list[Weighted]:
        return _imposed(planarity.build(self.quads, weight=self.weight or 1.0), self, block)


@dataclass(frozen=True)
class Lengths(Part):
    """Pairs of vertices (k, 2) are `lengths` (k,) apart."""

    INDICES = ("pairs",)
    ROWS = LENGTHS = ("lengths",)

    pairs: Ints
    lengths: Array
    weight: float | None = None

    def on(self, transfer: Transfer) -> Lengths | None:
        """Constrain the edges of the copy, and pairs of its vertices that are in the design's.

        Lengths of edges change by the same factors as those of the design's edges around them.
        """
        points, near = transfer.fine.vertices, transfer.near
        a, b = self.pairs.T
        usual = np.linalg.norm(points[a] - points[b], axis=1)
        factor = self.lengths / np.maximum(usual, 1e-300)
        n = len(points)
        count = np.bincount(self.pairs.ravel(), minlength=n)
        mean = np.bincount(self.pairs.ravel(), np.repeat(factor, 2), n) / np.maximum(count, 1)
        edges = transfer.coarse.edges
        edges = edges[(count[near[edges]] > 0).all(axis=1)]
        first, second = transfer.coarse.vertices[edges].transpose(1, 0, 2)
        lengths = np.linalg.norm(first - second, axis=1) * mean[near[edges]].mean(axis=1)
        ends = transfer.place(self.pairs)
        both = (ends >= 0).all(axis=1)
        first, second = transfer.coarse.vertices[ends[both]].transpose(1, 0, 2)
        bars = np.linalg.norm(first - second, axis=1) * factor[both]
        pairs = np.concatenate([edges, ends[both]])
        if not len(pairs):
            return None
        return replace(self, pairs=pairs, lengths=np.concatenate([lengths, bars]))

    def violation(self, points: Array) -> Array:
        a, b = (points[self.pairs[:, k]] for k in (0, 1))
        return np.asarray(np.abs(np.linalg.norm(a - b, axis=1) - self.lengths))

    @property
    def anchored(self) -> bool:
        return False

    def items(self, block: str) -> list[Weighted]:
        weight = self.weight or 1.0
        term = length.build(self.pairs, self.lengths, block=block, weight=weight)
        return _imposed(term, self, block)

    def soft_term(self, block: str) -> Term:
        return length.build(self.pairs, self.lengths, block=block)


def _kept(transfer: Transfer, ids: Ints) -> tuple[Ints, Flags]:
    """Return the vertices of a copy that stand for some of the vertices `ids`, and which."""
    places = transfer.place(ids)
    rows = places >= 0
    return places[rows], rows


def _imposed(term: Term, part: Part, block: str) -> list[Weighted]:
    """Return a term of a part, with multipliers if the part is hard."""
    if not part.hard:
        return [Weighted(term, 1.0)]
    return [Weighted(hardened(term), STIFF)]
