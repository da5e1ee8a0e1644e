"""Constraints as a stage imposes them: eliminated unknowns and additional terms."""

from __future__ import annotations

from collections.abc import Sequence

from gso.constraints import Compiled, Pins
from gso.energy import Weighted
from gso.unknowns import Variables


class StageConstraints:
    """Constraints as they enter the stages of a plan.

    Parameters
    ----------
    constraints : Compiled
        The constraints.
    items : sequence of lists of Weighted, optional
        The terms of each of its parts, if they exist already.

    Attributes
    ----------
    terms : tuple of Weighted
        The soft constraints and the hard non-linear ones. The latter have `multipliers`
        (augmented Lagrangian): the last stage is repeated until they hold.
    """

    def __init__(self, constraints: Compiled, items: Sequence[list[Weighted]] | None = None):
        if items is None:
            items = [part.items(constraints.block) for part in constraints.parts]
        self.constraints = constraints
        self._items = items
        self.terms = tuple(item for own in items for item in own)

    def eliminate(self, variables: Variables) -> Variables:
        """Eliminate the hard linear constraints from unknowns."""
        reduction = self.constraints.reduction
        if reduction is None:
            return variables
        layout = variables.layout
        start, _, _ = layout.where(self.constraints.block)
        return variables.constrained(*reduction.maps(start, layout.size))

    def with_handles(self, constraints: Compiled) -> StageConstraints:
        """Return the same constraints with other positions of handles; multipliers stay.

        The parts of `constraints` must be those of this object, in the same order.
        """
        items = [
            part.items(constraints.block) if isinstance(part, Pins) else own
            for part, own in zip(constraints.parts, self._items, strict=True)
        ]
        return StageConstraints(constraints, items)
