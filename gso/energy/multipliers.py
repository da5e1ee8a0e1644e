"""Hard constraints as terms: the method of multipliers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gso.energy.base import Term
from gso.typing import Array

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
        Its last constants are the shifts, one per residual.
    """

    def __init__(self, term: Term):
        self._term, self._count = term, 0
        self._constants: Array = term.constants.copy()

    def constants(self, blocks: Mapping[str, Array]) -> Array:
        """Return the constants with the current shifts; the coordinates are ignored."""
        return self._constants

    def update(self, blocks: Mapping[str, Array]) -> float:
        """Add the current residuals to the shifts; return the largest residual."""
        points = [tuple(blocks[b][ids].T) for b, index in self._term.stencil for ids in index.T]
        value = np.stack(self._term.residual(points, list(self._constants)))
        self._count = len(value)
        shift = self._constants[-len(value) :]
        left = float(np.abs(value - shift).max(initial=0.0))
        shift[...] = value
        return left

    def scale(self, factor: float) -> None:
        """Multiply the shifts, as the weights of all other terms were."""
        self._constants[len(self._constants) - self._count :] *= factor


def hardened(term: Term) -> Term:
    """Make a soft term a hard constraint with multipliers; argument as for :class:`Shifts`."""
    shifts = Shifts(term)
    return replace(term, refresh=shifts.constants, multipliers=shifts)
