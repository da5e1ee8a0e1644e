"""Directions and line searches of many surfaces, each with its own damping and step."""

from __future__ import annotations

import torch
from torch import Tensor

from gso.solver.directions import HOPELESS, raise_damping
from gso.solver.line_search import DECREASE, SHORTEST, shorten
from gso.tno.batched.batch_problem import Problem
from gso.tno.batched.cholesky import BlockBanded


def direction(
    solver: BlockBanded, values: Tensor, diagonal: Tensor, gradient: Tensor, damping: Tensor
) -> Tensor:
    """Solve for the damped Gauss-Newton directions (n, B).

    Surfaces whose matrix is not positive definite are solved again with more damping, as by
    :meth:`gso.solver.directions.GaussNewton.step`; the others are not.

    Parameters
    ----------
    solver : BlockBanded
    values : Tensor, (nnz, B)
        Values of the matrices; changed in place.
    diagonal : Tensor of int, (n,)
        Rows of the diagonal in them.
    gradient : Tensor, (n, B)
    damping : Tensor, (B,)
        Relative damping of each surface.
    """
    own = values.index_select(0, diagonal)
    used = own > 0
    typical = torch.where(used, own, 0.0).sum(dim=0) / used.sum(dim=0).clamp(min=1)
    typical = typical.clamp(min=1e-300)
    out = torch.empty_like(gradient)
    which = torch.arange(gradient.shape[1], device=gradient.device)
    while len(which):
        diagonals = own + damping * typical
        values.index_copy_(0, diagonal, diagonals)
        failed = solver.factor(values)
        found = -solver.solve(gradient)
        failed |= ~(torch.isfinite(found).all(dim=0) & ((found * gradient).sum(dim=0) <= 0))
        damping = raise_damping(damping)
        hopeless = failed & (damping > HOPELESS)
        # The gradient's direction, where no damping helps.
        steepest = -gradient / diagonals.amax(dim=0).clamp(min=1e-300)
        out[:, which] = torch.where(hopeless, steepest, found)
        left = torch.nonzero(failed & ~hopeless).ravel()
        if len(left):
            values, gradient, own = (t.index_select(1, left) for t in (values, gradient, own))
            damping, typical = damping[left], typical[left]
        which = which[left]
    return out


def armijo(
    problem: Problem, x: Tensor, step: Tensor, energy: Tensor, slope: Tensor, longest: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Backtrack each surface until its energy falls in proportion to the slope.

    The rules are those of :func:`gso.solver.line_search.armijo`. Surfaces that have found
    their step are not evaluated again.

    Parameters
    ----------
    problem : Problem
    x, step : Tensor, (n, B)
        Current points and directions.
    energy, slope : Tensor, (B,)
        Energies at x, and their slopes along the directions.
    longest : Tensor, (B,)
        Steps to try first.

    Returns
    -------
    x, energy, length : Tensor
        The accepted points, energies and step lengths; the old ones with length 0 where there is
        no step.
    """
    length = torch.zeros_like(energy)
    reached, value = x, energy
    t, least = longest, SHORTEST * longest.clamp(max=1.0)
    which, some = None, problem
    while True:
        own = slice(None) if which is None else which
        candidate = x[:, own] + t * step[:, own]
        found = some.energy(candidate)
        rise, down = found - energy[own], t * slope[own]
        good = found <= energy[own] + DECREASE * down
        if which is None:
            reached, value = torch.where(good, candidate, x), torch.where(good, found, energy)
            length = torch.where(good, t, length)
        else:
            taken = which[good]
            reached[:, taken], value[taken], length[taken] = (
                candidate[:, good],
                found[good],
                t[good],
            )
        t = shorten(t, rise, down)
        left = torch.nonzero(~good & (t >= least)).ravel()
        if not len(left):
            return reached, value, length
        which = left if which is None else which[left]
        t, least = t[left], least[left]
        some = some.of_surfaces(left)
