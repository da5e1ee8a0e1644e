"""Terms that hold exactly: the method of multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.terms.base import Array, Term

#: Weight of an equation that must hold: stiff beside every task's energy, and no stiffer, as
#: the shifts do the rest.
STIFF = 100.0


class Shifts:
    """Shifts of a term's residuals: multipliers over the term's weight.

    After each solve the residual is added to its shift, which counts as part of it in the
    next one, so that residuals go to zero at a finite weight (Hestenes 1969; Powell 1969).

    Parameters
    ----------
    term : Term
        Its last constants are the shifts, one per residual. It has one block, whose
        coordinates are the first of the layout.
    dim : int
        Components of a point of that block.
    """

    def __init__(self, term: Term, dim: int):
        self._term = term
        self._constants = term.constants.copy()
        ((_, index),) = term.stencil
        self._rows = [[dim * ids + d for d in range(dim)] for ids in index.T]

    def constants(self, coordinates: Array) -> Array:
        """Constants with the shifts of now."""
        return self._constants

    def push(self, coordinates: Array) -> float:
        """Add what is left of the residuals; returns the largest."""
        points = [tuple(coordinates[row] for row in rows) for rows in self._rows]
        value = np.stack(self._term.residual(points, self._constants))
        shift = self._constants[-len(value) :]
        left = float(np.abs(value - shift).max(initial=0.0))
        shift[...] = value
        return left

    def scale(self, factor: float) -> None:
        """Multiply the shifts: the weights of all other terms were."""
        rows = len(self._term.residual([(0.0,) * len(r) for r in self._rows], self._constants))
        self._constants[-rows:] *= factor


def hardened(term: Term, dim: int) -> Term:
    """A term whose residuals go to zero as solves are repeated; arguments as for `Shifts`."""
    shifts = Shifts(term, dim)
    return replace(term, refresh=shifts.constants, multipliers=shifts)
