"""What a term is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gso.terms.losses import Loss, Squared

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Residual = Callable[[Sequence[tuple[Any, ...]], Sequence[Any]], tuple[Any, ...]]

#: ``limit(coordinates, direction) -> largest step``: what a step must not cross.
Limit = Callable[[Array, Array], float]


def _no_constants() -> Array:
    return np.empty((0, 0))


class Multipliers(Protocol):
    """What makes a term hold exactly when solves are repeated."""

    def push(self, coordinates: Array) -> float:
        """Take up what is left of the residuals; returns the largest (a length)."""

    def scale(self, factor: float) -> None:
        """Follow a change of the weight of all other terms."""


@dataclass(frozen=True)
class Term:
    """Elements of one kind that share a residual.

    Attributes
    ----------
    name : str
        Term name; elements of the same name are reported together.
    residual : callable
        ``residual(points, constants) -> tuple``: the residuals of one element from the
        component tuples of its points (in the order of `stencil`) and its constants.
    stencil : tuple of (block, indices (e, k))
        Which rows of which block of coordinates ("surface", "flat", ...) each element
        uses.
    constants : ndarray, (c, e)
        Constants of each element.
    weights : ndarray, (e,)
        Weight of each element. Terms that average over the surface use weights that sum
        to one, so that one set of task weights serves every resolution.
    linear : bool
        The residual is affine in the points: its Jacobian is evaluated once.
    vectors : callable, optional
        ``vectors(points, constants)`` returns, for the first residuals in their order, the
        plane vector (u, v) whose length minus a constant the residual is. Turning such a
        vector does not change the residual to first order, so Gauss-Newton sees no
        stiffness there and overshoots; with the vectors it keeps the second derivative
        of the length wherever the loss pulls (projected Newton).
    refresh : callable, optional
        ``refresh(coordinates) -> constants``: new constants before every linearisation, from
        the coordinate vector; for closest points, and for targets that are moved by hand.
    multipliers : Multipliers, optional
        For what must hold exactly: after a solve they move the targets that `refresh` gives
        by what is left, so that the next solve leaves less.
    """

    name: str
    residual: Residual
    stencil: tuple[tuple[str, Ints], ...]
    weights: Array
    constants: Array = field(default_factory=_no_constants)
    linear: bool = False
    vectors: Residual | None = None
    refresh: Callable[[Array], Array] | None = None
    multipliers: Multipliers | None = None

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.weights)

    def renumbered(self, block: str, row: Ints) -> Term:
        """The term on other rows of a block: what was row k is ``row[k]``."""
        stencil = tuple((b, row[ids] if b == block else ids) for b, ids in self.stencil)
        return replace(self, stencil=stencil)


def mean_weights(count: int) -> Array:
    """Equal weights that sum to one."""
    return np.full(count, 1.0 / max(count, 1))


@dataclass(frozen=True)
class Weighted:
    """A term, its weight in the objective, and what its residuals cost."""

    term: Term
    weight: float
    loss: Loss = field(default_factory=Squared)

    @property
    def quadratic(self) -> bool:
        """Its part of the energy is a quadratic function of the unknowns."""
        fixed = self.term.linear and self.term.refresh is None
        return fixed and isinstance(self.loss, Squared)
