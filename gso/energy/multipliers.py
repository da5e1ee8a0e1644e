"""Hard constraints as terms: the method of multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.energy.base import Array, Term

#: Weight of a hard constraint: large compared with every task's energy, but moderate, as the
#: multipliers reduce the remaining residual.
STIFF = 100.0


class Shifts:
    """Lagrange multipliers of a term divided by its weight, as shifts of its residuals.

    After each solve the residual is added to its shift. The next solve minimises the shifted
    residual, so that residuals go to zero at a finite weight (Hestenes 1969; Powell 1969).

    Parameters
    ----------
    term : Term
        Its last constants are the shifts, one per residual. Its only block is the first of
        the layout.
    dim : int
        Components of a point of that block.
    """

    def __init__(self, term: Term, dim: int):
        self._term = term
        self._constants = term.constants.copy()
        ((_, index),) = term.stencil
        self._rows = [[dim * ids + d for d in range(dim)] for ids in index.T]

    def constants(self, coordinates: Array) -> Array:
        """Return the constants with the current shifts; the coordinates are ignored."""
        return self._constants

    def update(self, coordinates: Array) -> float:
        """Add the current residuals to the shifts; return the largest residual."""
        points = [tuple(coordinates[row] for row in rows) for rows in self._rows]
        value = np.stack(self._term.residual(points, self._constants))
        shift = self._constants[-len(value) :]
        left = float(np.abs(value - shift).max(initial=0.0))
        shift[...] = value
        return left

    def scale(self, factor: float) -> None:
        """Multiply the shifts, as the weights of all other terms were."""
        rows = len(self._term.residual([(0.0,) * len(r) for r in self._rows], self._constants))
        self._constants[-rows:] *= factor


def hardened(term: Term, dim: int) -> Term:
    """Make a soft term a hard constraint with multipliers; arguments as for :class:`Shifts`."""
    shifts = Shifts(term, dim)
    return replace(term, refresh=shifts.constants, multipliers=shifts)
