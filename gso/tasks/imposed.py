"""Constraints as a stage imposes them: eliminated unknowns and additional terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.constraints import Compiled, Lengths, OnLines, Pins, Planar
from gso.energy import Weighted, curve, length, planarity, position
from gso.energy.multipliers import STIFF, hardened
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
        self.terms = tuple(_terms(constraints) if terms is None else terms)

    def eliminate(self, variables: Variables) -> Variables:
        """Eliminate the hard linear constraints from unknowns."""
        reduction = self.constraints.reduction
        if reduction is None:
            return variables
        layout = variables.layout
        start, _, _ = layout.where(self.constraints.block)
        return variables.following(*reduction.maps(start, layout.size))

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


def _terms(c: Compiled) -> list[Weighted]:
    block, dim = c.block, 2 if c.flat else 3
    out = []
    for hard in (False, True):
        factor = STIFF if hard else 1.0
        terms = []
        for p in c.of(Planar, hard=hard):
            terms.append(planarity.build(p.quads, weight=p.weight or 1.0))
        for e in c.of(Lengths, hard=hard):
            terms.append(length.build(e.pairs, e.lengths, block=block, weight=e.weight or 1.0))
        if hard:
            terms = [hardened(t, dim) for t in terms]
        terms += [curve.build(p, block=block) for p in c.of(OnLines, hard=hard)]
        out += [Weighted(t, factor) for t in terms]
    for pin in c.of(Pins, hard=False):
        weights = np.full(len(pin.ids), pin.weight)
        out.append(Weighted(position.build(pin.ids, pin.positions, weights, block=block), 1.0))
    return out
