"""Weighted terms on coordinates and unknowns: residuals, Jacobians, their part of the matrix."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gso.energy.base import Residual, Term, Weighted
from gso.energy.losses import Loss
from gso.solver import loops
from gso.solver.assembly import Places, products
from gso.solver.chain import chain_rule
from gso.solver.kernels import geometric_stiffness, kernel
from gso.typing import Array
from gso.unknowns import Layout, Variables

#: Elements per block of the compiled loops: their Jacobians then stay in the processor's cache.
_BLOCK = 2048


_NONE = np.empty((0, 0))
_ALL = slice(None)

V = TypeVar("V", bound="Values")

#: Residual function, dimensions of the points, number of constants.
Kind = tuple[Residual, tuple[int, ...], int]


def kind(term: Term, layout: Layout) -> Kind:
    """Return the kind of a term's elements: terms of one kind share their kernels."""
    shape = [layout.where(block)[2] for block, index in term.stencil for _ in range(index.shape[1])]
    return term.residual, tuple(shape), len(term.constants)


class Values:
    """One weighted term on given coordinates: gathers, residuals, energy.

    Parameters
    ----------
    item : Weighted
    layout : Layout
    among : int
        Number of elements for which kernels are chosen, if that is more than the term's own.
    """

    def __init__(self, item: Weighted, layout: Layout, among: int = 0):
        term = item.term
        self.item, self.layout = item, layout
        self.among = max(among, term.count)
        self.gather = np.concatenate([layout.rows(block, index) for block, index in term.stencil])
        self.constants = term.by_element
        self.shape = kind(term, layout)[1]
        self.weights = term.weights

    def refreshed(self: V, coordinates: Array) -> V:
        """Return the term with those constants updated that depend on the coordinates."""
        if self.item.term.refresh is None:
            return self
        other = copy(self)
        other.constants = self.item.term.refresh(self.layout.split(coordinates))
        return other

    def with_loss(self: V, loss: Loss) -> V:
        """Return the term with another loss."""
        other = copy(self)
        other.item = replace(self.item, loss=loss)
        return other

    def residual(self, coordinates: Array) -> Array:
        """Residuals (r, e)."""
        key = self.item.term.residual, self.shape, len(self.constants)
        loop = loops.residual(*key, self.among)
        if loop is None:
            return kernel(*key, False)(coordinates.take(self.gather), self.constants)[0]
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

    def __init__(self, item: Weighted, variables: Variables, among: int = 0):
        super().__init__(item, variables.layout, among)
        self._chain, self.columns = chain_rule(self.gather, self.shape, variables)

    def linearise(self, coordinates: Array, at: slice = _ALL) -> tuple[Array, Array]:
        """Return residuals (r, e) and their Jacobian by the unknowns (r, q, e) of some elements."""
        run = kernel(self.item.term.residual, self.shape, len(self.constants), True)
        value, slope = run(coordinates.take(self.gather[:, at]), self.constants[:, at])
        return value, self._chain.pull(slope, at)

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
        loop = loops.jacobian(term.residual, *key, self.among)
        bend = None if term.vectors is None else loops.stiffness(term.vectors, *key, self.among)
        if loop is None or (bend is None and term.vectors is not None):
            return self._add(coordinates, places, gradient, values, factor)
        count, q = term.count, len(self.columns)
        residual = np.empty((loop.rows, count))
        given = coordinates, self.gather, self._constants
        slope = np.empty((min(_BLOCK, count), loop.rows * len(self.gather)))
        rule = self._chain.kind
        target = (
            *(factor, self.columns, places.by_element, places.doubled),
            *(rule, self.gather, *self._chain.parts),
        )
        add = loops.adder(loop.rows, len(self.gather), q, rule)
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
                turned = loops.adder(bend.rows, len(self.gather), q, rule)
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
        return self._chain.pull(run(coordinates.take(self.gather), self.constants)[1])
