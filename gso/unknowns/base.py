"""Unknowns, and their affine map to the coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gso.linalg import spd
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


#: Number of components per row of every block.
DIMENSIONS = {"surface": 3, "flat": 2, "scale": 1}


@dataclass(frozen=True)
class Layout:
    """Named blocks of coordinates in one vector: ("surface", n, 3), ("flat", n, 2) ..."""

    blocks: tuple[tuple[str, int, int], ...]

    @property
    def size(self) -> int:
        """Length of the coordinate vector."""
        return sum(count * dim for _, count, dim in self.blocks)

    def where(self, name: str) -> tuple[int, int, int]:
        """Return (start, count, dim) of a block."""
        start = 0
        for block, count, dim in self.blocks:
            if block == name:
                return start, count, dim
            start += count * dim
        raise KeyError(name)

    @classmethod
    def of(cls, count: int, *names: str) -> Layout:
        """Make the layout of the blocks named, each with `count` rows."""
        return cls(tuple((name, count, DIMENSIONS[name]) for name in names))

    def split(self, coordinates: Array) -> dict[str, Array]:
        """Split the coordinate vector into arrays (count, dim) by block."""
        out, start = {}, 0
        for block, count, dim in self.blocks:
            out[block] = coordinates[start : start + count * dim].reshape(count, dim)
            start += count * dim
        return out

    def rows(self, name: str, index: Ints) -> Ints:
        """Return the positions (k * dim, e) in the coordinate vector of k rows (e, k) of a block.

        >>> Layout.of(9, "flat").rows("flat", np.array([[0, 4]])).ravel().tolist()
        [0, 1, 8, 9]
        """
        start, _, dim = self.where(name)
        # Half as wide where that is enough: on large meshes these are the largest arrays.
        kind = np.int32 if self.size < 2**31 else np.int64
        first: Ints = index.T.astype(kind) * kind(dim) + kind(start)
        return (first[:, None] + np.arange(dim, dtype=kind)[:, None]).reshape(-1, first.shape[1])

    def pack(self, blocks: dict[str, Array]) -> Array:
        """Concatenate arrays (count, dim) by block into the coordinate vector."""
        return np.concatenate([np.asarray(blocks[b], float).ravel() for b, _, _ in self.blocks])


#: Entries of the normal matrix below this, relative to its largest diagonal entry, are rounding
#: errors.
_ROUNDING = 1e-15


class Variables:
    """Unknowns x with coordinates ``offset + basis @ x``.

    Every kind of unknowns (free vertices, offsets along normals, spline coefficients,
    joint surface and plane) is such an affine map; the kinds differ in how they are
    built. Hard linear constraints are eliminated, which gives an affine map again.

    Parameters
    ----------
    layout : Layout
        The coordinates.
    basis : sparse matrix (layout.size, unknowns), or None
        None stands for the identity.
    offset : ndarray (layout.size,)
        Coordinates at x = 0; ignored with the identity.
    """

    def __init__(self, layout: Layout, basis: csr_matrix | None, offset: Array):
        self.layout = layout
        self.basis = basis
        self.offset = offset
        self.size = layout.size if basis is None else int(basis.shape[1])

    @cached_property
    def single(self) -> tuple[Ints, Array] | None:
        """The unknown of each coordinate and its share; None where one depends on several.

        The unknown of a fixed coordinate is the number of unknowns.
        """
        basis: Any = self.basis
        count = np.diff(basis.indptr)
        if count.max(initial=0) > 1:
            return None
        unknown = np.full(len(count), basis.shape[1], basis.indices.dtype)
        share = np.zeros(len(count))
        unknown[count > 0], share[count > 0] = basis.indices, basis.data
        return unknown, share

    def points(self, x: Array) -> Array:
        """Map unknowns x to the coordinate vector."""
        points: Array = x.copy() if self.basis is None else self.offset + self.basis @ x
        return points

    def direction(self, dx: Array) -> Array:
        """Map a change of the unknowns to the change of the coordinates."""
        change: Array = dx if self.basis is None else self.basis @ dx
        return change

    def project(self, coordinates: Array) -> Array:
        """Find the unknowns whose coordinates are closest in the least-squares sense."""
        if self.basis is None:
            same: Array = coordinates.copy()
            return same
        from scipy.sparse import identity

        rhs: Array = self.basis.T @ (coordinates - self.offset)
        gram = (self.basis.T @ self.basis).tocsc()
        diagonal = gram.diagonal()
        gram.data[np.abs(gram.data) <= _ROUNDING * diagonal.max(initial=0.0)] = 0.0
        gram.eliminate_zeros()
        if gram.nnz == np.count_nonzero(diagonal):
            return rhs / np.where(diagonal > 0, diagonal, 1.0)
        ridge = 1e-12 * diagonal.max()
        return spd(gram + ridge * identity(gram.shape[0], format="csc"))(rhs)

    def constrained(self, projection: csr_matrix, basis: csr_matrix, offset: Array) -> Variables:
        """Eliminate linear constraints: restrict the map to coordinates that satisfy them.

        The coordinates c of these unknowns are projected to ``offset + projection @ c``. If the
        unknowns are the coordinates themselves, `basis` is used instead of `projection`, and
        unknowns with empty columns are dropped.

        Parameters
        ----------
        projection, basis : csr_matrix, (layout.size, layout.size)
            Two matrices with the same range; see :meth:`gso.constraints.Reduction.maps`.
        offset : ndarray (layout.size,)
            Coordinates that satisfy the equations.
        """
        free = basis if self.basis is None else projection @ self.basis
        shift = offset if self.basis is None else offset + projection @ self.offset
        free = free.tocsc()
        free.eliminate_zeros()
        used = np.diff(free.indptr) > 0
        return Variables(self.layout, free[:, used].tocsr(), shift)
