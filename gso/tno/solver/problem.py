"""The sum of weighted terms over given unknowns: energy, gradient, Gauss-Newton matrix.

The sparsity pattern of the matrix is computed once; an evaluation only fills in its values.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from gso.energy.base import Limit, Weighted
from gso.energy.losses import Loss
from gso.linalg.base import Pattern
from gso.tno.solver.assembly import Assembly, assemble, products
from gso.tno.solver.kernels import geometric_stiffness, kernel
from gso.typing import Array, Ints
from gso.unknowns import Layout, Variables


class _Values:
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
        run = kernel(self.item.term.residual, self.shape, len(self.constants), False)
        return run(coordinates[self.gather], self.constants)[0]

    def energy(self, residual: Array) -> float:
        """Weighted cost."""
        with np.errstate(over="ignore", invalid="ignore"):
            total = self.item.weight * float((self.item.loss.value(residual) @ self.weights).sum())
        return total if np.isfinite(total) else np.inf


class _Elements(_Values):
    """One weighted term on given unknowns, with the Jacobian by the unknowns (chain rule)."""

    def __init__(self, item: Weighted, variables: Variables):
        super().__init__(item, variables.layout)
        self._pull, self.columns = _pull_back(self.gather, variables)

    def linearise(self, coordinates: Array) -> tuple[Array, Array]:
        """Return residuals (r, e) and their Jacobian by the element's unknowns (r, q, e)."""
        run = kernel(self.item.term.residual, self.shape, len(self.constants), True)
        value, slope = run(coordinates[self.gather], self.constants)
        return value, self._pulled(slope)

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


def _pull_back(gather: Ints, variables: Variables):
    """Return the map from derivatives by coordinates to those by unknowns, and the unknowns.

    The map is None where every coordinate is a single unknown or fixed. The unknowns (q, e)
    of each element are padded with `variables.size`.
    """
    if variables.basis is None:
        return None, gather
    chosen = _chosen(variables)
    if chosen is not None:
        return None, chosen[gather]
    from scipy.sparse import csr_matrix

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


def _chosen(variables: Variables) -> Ints | None:
    """Return the unknown that each coordinate equals; None unless each is one, or fixed."""
    basis = variables.basis
    if basis is None:
        return np.arange(variables.size)
    count = np.diff(basis.indptr)
    if count.max(initial=0) > 1 or not (basis.data == 1.0).all():
        return None
    chosen = np.full(len(count), variables.size)
    chosen[count > 0] = basis.indices
    return chosen


class Problem:
    """Objective over unknowns.

    Parameters
    ----------
    items : sequence of Weighted
        The terms with their weights and losses.
    variables : Variables
        The unknowns.
    limits : sequence of callables
        Bounds on a step, see :data:`Limit`.
    like : Problem, optional
        A problem whose sparsity pattern is reused if it is the same.
    """

    def __init__(
        self,
        items: Sequence[Weighted],
        variables: Variables,
        limits: Sequence[Limit] = (),
        like: Problem | None = None,
    ):
        self.variables = variables
        self.limits = tuple(limits)
        used = _counted(items)
        self._elements = [_Elements(i, variables) for i in used if not i.quadratic]
        self._quadratic = _Quadratic(
            [_Elements(i, variables) for i in used if i.quadratic], variables
        )
        if like is not None and self._sparsity_of(like):
            self._assembly = like._assembly

    def _sparsity_of(self, other: Problem) -> bool:
        """Return whether the Gauss-Newton matrices have the same sparsity pattern."""
        if self.variables.size != other.variables.size:
            return False
        here, there = ([e.columns for e in p._elements] for p in (self, other))
        here += [self._quadratic.matrix.indptr, self._quadratic.matrix.indices]
        there += [other._quadratic.matrix.indptr, other._quadratic.matrix.indices]
        return len(here) == len(there) and all(map(np.array_equal, here, there))

    @cached_property
    def _assembly(self) -> Assembly:
        return assemble(
            self.variables.size, [e.columns for e in self._elements], self._quadratic.matrix
        )

    @cached_property
    def _constant(self) -> Array:
        values = np.zeros(self._assembly.pattern.nnz)
        values[self._assembly.quadratic] = self._quadratic.matrix.data
        return values

    @property
    def pattern(self) -> Pattern:
        """Sparsity pattern of the Gauss-Newton matrix."""
        return self._assembly.pattern

    @property
    def diagonal(self) -> Ints:
        """Positions of the diagonal among the matrix values."""
        return self._assembly.diagonal

    def with_loss(self, name: str, loss: Loss) -> Problem:
        """Return the problem with another loss of the non-quadratic terms of one name."""
        return self._with_elements(
            [e.with_loss(loss) if e.item.term.name == name else e for e in self._elements]
        )

    def refreshed(self, x: Array) -> Problem:
        """Return the problem with the constants at x: closest points, shifted targets."""
        coordinates = self.variables.points(x)
        return self._with_elements([e.refreshed(coordinates) for e in self._elements])

    def _with_elements(self, elements: list[_Elements]) -> Problem:
        """Return a problem with equivalent elements, which shares the sparsity pattern."""
        other = copy(self)
        other._elements = elements
        return other

    def by_term(self, x: Array) -> dict[str, float]:
        """Return the energy by term name, with updated constants; it sums to :meth:`energy`."""
        out = _by_term(self._elements, self.variables.points(x))
        for name, value in self._quadratic.by_term(x).items():
            out[name] = out.get(name, 0.0) + value
        return out

    def energy(self, x: Array) -> float:
        """Return the objective; infinity where it is not finite."""
        coordinates = self.variables.points(x)
        total = self._quadratic.energy(x)
        for element in self._elements:
            total += element.energy(element.residual(coordinates))
        return total if np.isfinite(total) else np.inf

    def linearise(self, x: Array) -> tuple[float, Array, Array]:
        """Return energy, gradient (n,) and values of the Gauss-Newton matrix's lower triangle."""
        coordinates = self.variables.points(x)
        n = self.variables.size
        total, gradient = self._quadratic.energy_and_gradient(x)
        values = self._constant.copy()
        places = self._assembly.scatter, self._assembly.repeated
        for element, scatter, repeated in zip(self._elements, *places, strict=True):
            residual, slope = element.linearise(coordinates)
            first, second = element.item.loss.weights(residual)
            factor = element.item.weight * element.weights
            total += element.energy(residual)
            pulled = np.einsum("re,rqe->qe", first * factor, slope, optimize=False)
            gradient += np.bincount(element.columns.ravel(), pulled.ravel(), n + 1)[:n]
            entries = products(slope, second * factor)
            turn = element.geometric_stiffness(coordinates)
            if turn is not None:
                entries += products(turn, np.maximum(first[: len(turn)], 0.0) * factor)
            entries.ravel()[repeated] *= 2.0
            values += np.bincount(scatter, entries.ravel(), len(values) + 1)[:-1]
        return total if np.isfinite(total) else np.inf, gradient, values

    def largest_step(self, x: Array, dx: Array) -> float:
        """Return the largest step along dx, at most 1, that crosses no limit."""
        if not self.limits:
            return 1.0
        coordinates, direction = self.variables.points(x), self.variables.direction(dx)
        return min(1.0, *(limit(coordinates, direction) for limit in self.limits))


class _Quadratic:
    """The sum of the quadratic terms: ``|A x - b|^2 / 2`` with constant A and b."""

    def __init__(self, elements: list[_Elements], variables: Variables):
        from scipy.sparse import csr_matrix

        n = variables.size
        rows, columns, entries, rhs, self.slices = [], [], [], [], []
        zero = np.zeros(n)
        start = variables.points(zero)
        base = 0
        for element in elements:
            residual, slope = element.linearise(start)
            root = np.sqrt(element.item.weight * element.weights)
            r, _, count = slope.shape
            row = base + np.arange(r * count).reshape(r, 1, count)
            keep = (slope != 0) & (element.columns < n)
            rows.append(np.broadcast_to(row, slope.shape)[keep])
            columns.append(np.broadcast_to(element.columns, slope.shape)[keep])
            entries.append((slope * root)[keep])
            rhs.append(-(residual * root).ravel())
            self.slices.append((element.item.term.name, slice(base, base + r * count)))
            base += r * count
        join = np.concatenate
        self.a = csr_matrix(
            (join(entries), (join(rows), join(columns))) if base else ([], ([], [])),
            shape=(base, n),
        )
        self.b = join(rhs) if base else np.zeros(0)
        self.at = self.a.T.tocsr()

    @cached_property
    def matrix(self) -> Any:
        """Lower triangle of ``A^T A``, CSC with sorted rows."""
        from scipy.sparse import tril

        lower = tril((self.at @ self.a).tocsc(), format="csc")
        lower.sort_indices()
        return lower

    def _residual(self, x: Array) -> Array:
        return self.a @ x - self.b

    def energy(self, x: Array) -> float:
        r = self._residual(x)
        return 0.5 * float(r @ r)

    def energy_and_gradient(self, x: Array) -> tuple[float, Array]:
        r = self._residual(x)
        return 0.5 * float(r @ r), self.at @ r

    def by_term(self, x: Array) -> dict[str, float]:
        r = self._residual(x)
        out: dict[str, float] = {}
        for name, part in self.slices:
            out[name] = out.get(name, 0.0) + 0.5 * float(r[part] @ r[part])
        return out


def energies(items: Sequence[Weighted], layout: Layout, coordinates: Array) -> dict[str, float]:
    """Return the energy by term name at given coordinates, with updated constants."""
    return _by_term([_Values(item, layout) for item in _counted(items)], coordinates)


def _by_term(terms: Sequence[_Values], coordinates: Array) -> dict[str, float]:
    out: dict[str, float] = {}
    for term in terms:
        term = term.refreshed(coordinates)
        name = term.item.term.name
        out[name] = out.get(name, 0.0) + term.energy(term.residual(coordinates))
    return out


def _counted(items: Sequence[Weighted]) -> list[Weighted]:
    """Return the active terms: those with a positive weight and at least one element."""
    return [i for i in items if i.weight > 0 and i.term.count]
