"""Unknowns and the points they make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


#: Components of a row of every block.
DIMENSIONS = {"surface": 3, "flat": 2}


@dataclass(frozen=True)
class Layout:
    """Named blocks of coordinates in one vector: ("surface", n, 3), ("flat", n, 2) ..."""

    blocks: tuple[tuple[str, int, int], ...]

    @property
    def size(self) -> int:
        """Length of the coordinate vector."""
        return sum(count * dim for _, count, dim in self.blocks)

    def where(self, name: str) -> tuple[int, int, int]:
        """(start, count, dim) of a block."""
        start = 0
        for block, count, dim in self.blocks:
            if block == name:
                return start, count, dim
            start += count * dim
        raise KeyError(name)

    @classmethod
    def of(cls, count: int, *names: str) -> Layout:
        """Layout of the blocks named, each with `count` rows."""
        return cls(tuple((name, count, DIMENSIONS[name]) for name in names))

    def split(self, coordinates: Array) -> dict[str, Array]:
        """Arrays (count, dim) by block."""
        out, start = {}, 0
        for block, count, dim in self.blocks:
            out[block] = coordinates[start : start + count * dim].reshape(count, dim)
            start += count * dim
        return out

    def columns(self, name: str, rows: Ints) -> Ints:
        """Positions (..., dim) in the coordinate vector of rows (...) of a block."""
        start, _, dim = self.where(name)
        return start + np.asarray(rows)[..., None] * dim + np.arange(dim)

    def pack(self, blocks: dict[str, Array]) -> Array:
        """Coordinate vector from arrays (count, dim) by block."""
        return np.concatenate([np.asarray(blocks[b], float).ravel() for b, _, _ in self.blocks])


class Variables:
    """Unknowns x that make coordinates ``offset + basis @ x``.

    Every kind of unknowns (free vertices, offsets along normals, spline coefficients,
    joint surface and plane) is such an affine map; the kinds differ in how they are
    built. Coordinates that a constraint fixes have an empty row and the wanted value as
    offset, so hard constraints are eliminated here.

    Parameters
    ----------
    layout : Layout
        The coordinates.
    basis : sparse matrix (layout.size, unknowns), or None
        None stands for the identity.
    offset : ndarray (layout.size,)
        Coordinates at x = 0; with the identity they are the fixed part only.
    """

    def __init__(self, layout: Layout, basis: csr_matrix | None, offset: Array):
        self.layout = layout
        self.basis = basis
        self.offset = offset
        self.size = layout.size if basis is None else int(basis.shape[1])

    def points(self, x: Array) -> Array:
        """Coordinate vector of unknowns x."""
        return x.copy() if self.basis is None else self.offset + self.basis @ x

    def direction(self, dx: Array) -> Array:
        """Change of the coordinates for a change of the unknowns."""
        return dx if self.basis is None else self.basis @ dx

    def project(self, coordinates: Array) -> Array:
        """Unknowns whose points are closest (least squares) to the coordinates."""
        if self.basis is None:
            return coordinates.copy()
        from scipy.sparse import identity
        from scipy.sparse.linalg import splu

        rhs = self.basis.T @ (coordinates - self.offset)
        gram = (self.basis.T @ self.basis).tocsc()
        diagonal = gram.diagonal()
        if gram.nnz == np.count_nonzero(diagonal):
            return rhs / np.where(diagonal > 0, diagonal, 1.0)
        ridge = 1e-12 * diagonal.max()
        return splu((gram + ridge * identity(gram.shape[0], format="csc")).tocsc()).solve(rhs)

    def fixing(self, columns: Ints, values: Array) -> Variables:
        """The same unknowns with some coordinates held at values."""
        if len(columns) == 0:
            return self
        from scipy.sparse import diags, identity

        basis = identity(self.size, format="csr") if self.basis is None else self.basis
        free = np.ones(self.layout.size)
        free[columns] = 0.0
        offset = np.where(free > 0, self.offset, 0.0)
        offset[columns] = values
        held = (diags(free) @ basis).tocsc()
        held.eliminate_zeros()
        used = np.diff(held.indptr) > 0
        return Variables(self.layout, held[:, used].tocsr(), offset)
