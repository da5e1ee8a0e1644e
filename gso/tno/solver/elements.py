"""Weighted terms on coordinates and unknowns: residuals, Jacobians, their part of the matrix."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from gso.energy.base import Weighted
from gso.energy.losses import Loss
from gso.tno.solver import loops
from gso.tno.solver.assembly import Places, products
from gso.tno.solver.kernels import geometric_stiffness, kernel
from gso.typing import Array, Ints
from gso.unknowns import Layout, Variables

#: Elements per block of the compiled loops: their Jacobians then stay in the processor's cache.
_BLOCK = 2048


_NONE = np.empty((0, 0))
_NO_INTS = np.empty(0, np.int64)


class Values:
    """One weighted term on given coordinates: gathers, residuals, energy."""

    def __init__(self, item: Weighted, layout: Layout):
        term = item.term
        columns, shape = [], []
        for block, index in term.stencil:
            dim = layout.where(block)[2]
            shape += [dim] * index.shape[1]
            columns.append(layout.columns(block, index).reshape(len(index), -1))
        self.item, self.layout = item, layout
        self.gather = np.ascontiguousarray(np.concatenate(columns, axis=1).T)
        self.constants = term.constants if term.constants.size else np.empty((0, term.count))
        self.shape = tuple(shape)
        self.weights = term.weights

    def refreshed(self, coordinates: Array) -> Any:
        """Return the term with those constants updated that depend on the coordinates."""
        if self.item.term.refresh is None:
            return self
        other = copy(self)
        other.constants = self.item.term.refresh(self.layout.split(coordinates))
        return other

    def with_loss(self, loss: Loss) -> Any:
        """Return the term with another loss."""
        other = copy(self)
        other.item = replace(self.item, loss=loss)
        return other

    def residual(self, coordinates: Array) -> Array:
        """Residuals (r, e)."""
        key = self.item.term.residual, self.shape, len(self.constants)
        loop = loops.residual(*key, self.item.term.count)
        if loop is None:
            return kernel(*key, False)(coordinates[self.gather], self.constants)[0]
        out = np.empty((loop.rows, self.item.term.count))
        loop.run(coordinates, self.gather, self._constants, 0, out.shape[1], out, _NONE)
        return out

    @property
    def _constants(self) -> Array:
        return np.ascontiguousarray(self.constants, np.float64)

    def energy(self, residual: Array) -> float:
        """Weighted cost."""
        with np.errstate(over="ignore", invalid="ignore"):
            total = self.item.weight * float((self.item.loss.value(residual) @ self.weights).sum())
        return total if np.isfinite(total) else np.inf


class Elements(Values):
    """One weighted term on given unknowns, with the Jacobian by the unknowns (chain rule)."""

    def __init__(self, item: Weighted, variables: Variables):
        super().__init__(item, variables.layout)
        self._pull, self.columns = _pull_back(self.gather, self.shape, variables)
        self._chain = _Chain(self._pull, self.gather.shape)

    def linearise(self, coordinates: Array) -> tuple[Array, Array]:
        """Return residuals (r, e) and their Jacobian by the element's unknowns (r, q, e)."""
        run = kernel(self.item.term.residual, self.shape, len(self.constants), True)
        value, slope = run(coordinates[self.gather], self.constants)
        return value, self._pulled(slope)

    def add(self, coordinates: Array, places: Places, gradient: Array, values: Array) -> float:
        """Add gradient and Gauss-Newton matrix, and return the energy.

        Parameters
        ----------
        coordinates : ndarray
        places : Places
            Where the element matrices' entries are.
        gradient, values : ndarray, (n + 1,) and (nnz + 1,)
            Changed in place. The last entries take what belongs to fixed coordinates.
        """
        term, loss = self.item.term, self.item.loss
        factor = self.item.weight * self.weights
        key = self.shape, len(self.constants)
        loop = loops.jacobian(term.residual, *key, term.count)
        bend = None if term.vectors is None else loops.stiffness(term.vectors, *key, term.count)
        if loop is None or (bend is None and term.vectors is not None):
            return self._add(coordinates, places, gradient, values, factor)
        count, q = term.count, len(self.columns)
        residual = np.empty((loop.rows, count))
        given = coordinates, self.gather, self._constants
        slope = np.empty((min(_BLOCK, count), loop.rows * len(self.gather)))
        target = (factor, self.columns, places.by_element, places.doubled, *self._chain.parts)
        chained = self._pull is not None
        add = loops.adder(loop.rows, len(self.gather), q, chained)
        for start in range(0, count, _BLOCK):
            stop = min(start + _BLOCK, count)
            loop.run(*given, start, stop, residual, slope)
            first, second = (np.ascontiguousarray(w) for w in loss.weights(residual[:, start:stop]))
            work = np.empty((loop.rows, q))
            add(slope, first, second, *target, start, gradient, values, work)
            if bend is not None:
                turn = np.empty((stop - start, bend.rows * len(self.gather)))
                length, work = np.empty((bend.rows, count)), np.empty((bend.rows, q))
                bend.run(*given, start, stop, length, turn)
                push = np.maximum(first[: bend.rows], 0.0)
                none = np.zeros_like(push)
                turned = loops.adder(bend.rows, len(self.gather), q, chained)
                turned(turn, none, push, *target, start, gradient, values, work)
        return self.energy(residual)

    def _add(
        self, coordinates: Array, places: Places, gradient: Array, values: Array, factor: Array
    ) -> float:
        """Do the work of :meth:`add` by array operations."""
        residual, slope = self.linearise(coordinates)
        first, second = self.item.loss.weights(residual)
        pulled = np.einsum("re,rqe->qe", first * factor, slope, optimize=False)
        gradient += np.bincount(self.columns.ravel(), pulled.ravel(), len(gradient))
        entries = products(slope, second * factor)
        turn = self.geometric_stiffness(coordinates)
        if turn is not None:
            entries += products(turn, np.maximum(first[: len(turn)], 0.0) * factor)
        entries.ravel()[places.repeated] *= 2.0
        values += np.bincount(places.scatter, entries.ravel(), len(values))
        return self.energy(residual)

    def geometric_stiffness(self, coordinates: Array) -> Array | None:
        """Return rows h (t, q, e): ``h h^T`` is the geometric stiffness of the first residuals."""
        vectors = self.item.term.vectors
        if vectors is None:
            return None
        run = geometric_stiffness(vectors, self.shape, len(self.constants))
        return self._pulled(run(coordinates[self.gather], self.constants)[1])

    def _pulled(self, slope: Array) -> Array:
        if self._pull is None:
            return slope
        q = len(self.columns)
        return np.stack([(self._pull @ s.ravel()).reshape(q, -1) for s in slope])


class _Chain:
    """The chain rule, element by element."""

    def __init__(self, pull: Any, shape: tuple[int, int]):
        self._pull, self._shape = pull, shape

    @cached_property
    def parts(self) -> tuple[bool, Ints, Ints, Array]:
        """Whether there is one; begin, unknown and share of the parts of each coordinate."""
        if self._pull is None:
            return False, _NO_INTS, _NO_INTS, np.empty(0)
        by_coordinate = self._pull.tocsc()
        k, count = self._shape
        size = np.diff(by_coordinate.indptr).reshape(k, count).T
        begin = np.r_[0, np.cumsum(size)]
        order = np.repeat(by_coordinate.indptr[:-1].reshape(k, count).T.ravel(), size.ravel())
        order = order + np.arange(begin[-1]) - np.repeat(begin[:-1], size.ravel())
        unknown = by_coordinate.indices[order] // count
        return True, begin, unknown.astype(np.int64), by_coordinate.data[order]


def _pull_back(gather: Ints, shape: tuple[int, ...], variables: Variables):
    """Return the map from derivatives by coordinates to those by unknowns, and the unknowns.

    The map is None where every coordinate is a single unknown or fixed. The unknowns (q, e)
    of each element are padded with `variables.size`.
    """
    if variables.basis is None:
        return None, gather
    from scipy.sparse import csr_matrix

    found = single(variables.basis)
    if found is not None:
        if (variables.basis.data == 1.0).all():
            return None, found[0][gather]
        direct = _by_point(gather, shape, variables.size, *found)
        if direct is not None:
            return direct
    k, count = gather.shape
    part = variables.basis[gather.T.ravel()].tocoo()
    element = part.row // k
    key, at = np.unique(element * np.int64(variables.size) + part.col, return_inverse=True)
    owner, column = key // variables.size, key % variables.size
    start = np.searchsorted(owner, np.arange(count + 1))
    place = np.arange(len(key)) - start[owner]
    q = int(np.diff(start).max()) if len(key) else 1
    columns = np.full((q, count), variables.size)
    columns[place, owner] = column
    pull = csr_matrix(
        (part.data, (place[at] * count + element, (part.row % k) * count + element)),
        shape=(q * count, k * count),
    )
    return pull, columns


def _by_point(gather: Ints, shape: tuple[int, ...], size: int, unknown: Ints, share: Array):
    """Return map and unknowns where every point moves with one unknown, as along a normal.

    `size` is the number of unknowns; the last two are what :func:`single` returns. None where
    points move otherwise, or where two points of an element share their unknown.
    """
    from scipy.sparse import csr_matrix

    (k, count), dim = gather.shape, shape[0]
    if any(d != dim for d in shape):
        return None
    by_point = unknown[gather].reshape(k // dim, dim, count)
    columns = by_point.min(axis=1)
    if not ((by_point == columns[:, None]) | (by_point == size)).all():
        return None
    ordered = np.sort(columns, axis=0)
    if ((ordered[1:] == ordered[:-1]) & (ordered[1:] < size)).any():
        return None
    place = (np.arange(k) * count).reshape(-1, 1, dim) + np.arange(count)[:, None]
    values = share[gather].reshape(k // dim, dim, count).transpose(0, 2, 1)
    pull = csr_matrix(
        (values.ravel(), place.ravel(), dim * np.arange(columns.size + 1)),
        shape=(columns.size, k * count),
    )
    return pull, columns


def single(basis: Any) -> tuple[Ints, Array] | None:
    """Return the unknown of each coordinate, or their number if it is fixed, and its share.

    None if a coordinate depends on several.
    """
    count = np.diff(basis.indptr)
    if count.max(initial=0) > 1:
        return None
    unknown, share = np.full(len(count), basis.shape[1]), np.zeros(len(count))
    unknown[count > 0], share[count > 0] = basis.indices, basis.data
    return unknown, share
