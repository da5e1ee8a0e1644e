"""Constraints as a stage imposes them: eliminated unknowns and additional terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gso.constraints import Compiled, Pins
from gso.energy import Weighted
from gso.unknowns import Variables


class Imposed:
    """Constraints as they enter the stages of a plan.

    Parameters
    ----------
    constraints : Compiled
        The constraints.
    terms : sequence of Weighted, optional
        Their terms, if they exist already.

    Attributes
    ----------
    terms : sequence of Weighted
        The soft constraints and the hard non-linear ones. The latter have `multipliers`
        (augmented Lagrangian): the last stage is repeated until they hold.
    """

    def __init__(self, constraints: Compiled, terms: Sequence[Weighted] | None = None):
        self.constraints = constraints
        if terms is None:
            terms = [i for p in constraints.parts for i in p.items(constraints.block)]
        self.terms = tuple(terms)

    def eliminate(self, variables: Variables) -> Variables:
        """Eliminate the hard linear constraints from unknowns."""
        reduction = self.constraints.reduction
        if reduction is None:
            return variables
        layout = variables.layout
        start, _, _ = layout.where(self.constraints.block)
        return variables.constrained(*reduction.maps(start, layout.size))

    def moved(self, constraints: Compiled) -> Imposed:
        """Return the same constraints with other positions of handles; multipliers stay."""
        pins = iter(constraints.of(Pins, hard=False))
        terms = []
        for item in self.terms:
            if item.term.name == "position":
                targets = next(pins).positions.T.copy()
                item = replace(item, term=replace(item.term, constants=targets))
            terms.append(item)
        return Imposed(constraints, terms)
