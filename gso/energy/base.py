"""The data structure of energy terms: stencil, residual, weights, constants."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from gso.energy.losses import Loss, Squared
from gso.typing import Array, Ints, S, Vec


class Residual(Hashable, Protocol):
    """Residuals of one element, from the component tuples of its points and its constants."""

    def __call__(self, points: Sequence[Vec[S]], constants: Sequence[S], /) -> Vec[S]: ...


class Vectors(Hashable, Protocol):
    """Plane vectors of one element whose lengths its first residuals compare."""

    def __call__(
        self, points: Sequence[Vec[S]], constants: Sequence[S], /
    ) -> tuple[Vec[S], ...]: ...


#: ``limit(coordinates, direction) -> largest step``: a step limit for the line search.
Limit = Callable[[Array, Array], float]


def _no_constants() -> Array:
    return np.empty((0, 0))


class Multipliers(Protocol):
    """Lagrange multipliers of a hard constraint that is a term (method of multipliers)."""

    def update(self, blocks: Mapping[str, Array]) -> float:
        """Update the multipliers with the current residuals; return the largest (a length)."""

    def scale(self, factor: float) -> None:
        """Rescale the multipliers when the weights of all other terms are scaled."""


@dataclass(frozen=True)
class Term:
    """Energy term: elements of one kind that share a residual function.

    Attributes
    ----------
    name : str
        Term name; the energies of terms with the same name are reported together.
    residual : callable
        ``residual(points, constants) -> tuple``: the residuals of one element from the
        component tuples of its points (in the order of `stencil`) and its constants.
    stencil : tuple of (block, indices (e, k))
        Rows of each block of coordinates ("surface", "flat", ...) that the elements use.
    constants : ndarray, (c, e)
        Constants of each element.
    weights : ndarray, (e,)
        Weight of each element. Terms that average over the surface use weights that sum
        to one, so that the same task weights suit every resolution.
    linear : bool
        Whether the residual is affine in the points: its Jacobian is then evaluated once.
    vectors : callable, optional
        ``vectors(points, constants)`` returns plane vectors (u, v), one for each of the first
        residuals in their order, where that residual is the length of the vector minus a
        constant. Rotating such a vector does not change the residual to first order, so
        Gauss-Newton has no geometric stiffness in that direction and overshoots. With the
        vectors, the second derivative of the length is added wherever the loss derivative
        makes it positive (projected Newton).
    refresh : callable, optional
        ``refresh(blocks) -> constants``: new constants before every linearisation, for closest
        points and for shifted targets. The coordinates are arrays (n, dim) by block.
    multipliers : Multipliers, optional
        For hard constraints: after each solve they shift the targets that `refresh` returns by
        the remaining residuals, so that the next solve reduces them.
    """

    name: str
    residual: Residual
    stencil: tuple[tuple[str, Ints], ...]
    weights: Array
    constants: Array = field(default_factory=_no_constants)
    linear: bool = False
    vectors: Vectors | None = None
    refresh: Callable[[Mapping[str, Array]], Array] | None = None
    multipliers: Multipliers | None = None

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.weights)

    @property
    def by_element(self) -> Array:
        """The constants (c, e); (0, e) where there are none."""
        return self.constants if self.constants.size else np.empty((0, self.count))

    def renumbered(self, block: str, row: Ints) -> Term:
        """Copy the term with row k of a block renumbered to ``row[k]``."""
        stencil = tuple((b, row[ids] if b == block else ids) for b, ids in self.stencil)
        return replace(self, stencil=stencil)


def mean_weights(count: int) -> Array:
    """Return equal weights that sum to one."""
    return np.full(count, 1.0 / max(count, 1))


@dataclass(frozen=True)
class Weighted:
    """A term with its weight in the objective and the loss of its residuals."""

    term: Term
    weight: float
    loss: Loss = field(default_factory=Squared)

    @property
    def active(self) -> bool:
        """Whether it counts: its weight is positive, and it has elements."""
        return self.weight > 0 and self.term.count > 0

    @property
    def quadratic(self) -> bool:
        """Whether its part of the energy is a quadratic function of the unknowns."""
        fixed = self.term.linear and self.term.refresh is None
        return fixed and isinstance(self.loss, Squared)
