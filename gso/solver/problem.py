"""The sum of weighted terms over given unknowns: energy, gradient, Gauss-Newton matrix.

The sparsity pattern of the matrix is computed once; an evaluation only fills in its values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property

import numpy as np

from gso.energy.base import Limit, Weighted
from gso.energy.losses import Loss
from gso.linalg.base import Pattern
from gso.solver.assembly import Assembly, assemble
from gso.solver.elements import Elements, Kind, Values, kind
from gso.solver.quadratic import Quadratic
from gso.typing import Array, Ints
from gso.unknowns import Layout, Variables

#: Entries of a matrix from which its constant part is computed each time, to save memory.
_LARGE = 5_000_000


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
    counts : dict, optional
        Numbers of elements by :func:`kind` for which kernels are chosen, if they are more than
        the problem's own; see :func:`largest_counts`.
    """

    def __init__(
        self,
        items: Sequence[Weighted],
        variables: Variables,
        limits: Sequence[Limit] = (),
        like: Problem | None = None,
        counts: Mapping[Kind, int] | None = None,
    ):
        self.variables = variables
        self.limits = tuple(limits)
        used = [item for item in items if item.active]
        more = {} if counts is None else counts
        self._elements = [
            Elements(i, variables, more.get(kind(i.term, variables.layout), 0))
            for i in used
            if not i.quadratic
        ]
        self._quadratic = Quadratic(
            [Elements(i, variables) for i in used if i.quadratic], variables
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
        """Values of the quadratic terms, and a zero for what belongs to fixed coordinates."""
        values = np.zeros(self._assembly.pattern.nnz + 1)
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

    def _with_elements(self, elements: list[Elements]) -> Problem:
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
        n, assembly = self.variables.size, self._assembly
        # One entry past the end takes what belongs to fixed coordinates.
        gradient, values = np.zeros(n + 1), self._constant.copy()
        if len(values) > _LARGE:
            del self._constant
        total, gradient[:n] = self._quadratic.energy_and_gradient(x)
        for number, element in enumerate(self._elements):
            total += element.add(coordinates, assembly.places[number], gradient, values)
        total = total if np.isfinite(total) else np.inf
        return total, gradient[:-1], values[:-1]

    def largest_step(self, x: Array, dx: Array) -> float:
        """Return the largest step along dx, at most 1, that crosses no limit."""
        if not self.limits:
            return 1.0
        coordinates, direction = self.variables.points(x), self.variables.direction(dx)
        return min(1.0, *(limit(coordinates, direction) for limit in self.limits))


def largest_counts(problems: Iterable[tuple[Sequence[Weighted], Layout]]) -> dict[Kind, int]:
    """Return the largest number of elements of each kind in problems of given terms and layouts."""
    out: dict[Kind, int] = {}
    for items, layout in problems:
        for item in items:
            own = kind(item.term, layout)
            out[own] = max(out.get(own, 0), item.term.count)
    return out


def energies(
    items: Sequence[Weighted], layout: Layout, *coordinates: Array
) -> list[dict[str, float]]:
    """Return the energy by term name at each of given coordinates, with updated constants."""
    terms = [Values(item, layout) for item in items if item.active]
    return [_by_term(terms, at) for at in coordinates]


def _by_term(terms: Sequence[Values], coordinates: Array) -> dict[str, float]:
    out: dict[str, float] = {}
    for term in terms:
        term = term.refreshed(coordinates)
        name = term.item.term.name
        out[name] = out.get(name, 0.0) + term.energy(term.residual(coordinates))
    return out
