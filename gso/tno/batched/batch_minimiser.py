"""The iteration for many surfaces: each stops by itself, and the others go on without it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from gso.energy.losses import Loss
from gso.solver import Timings
from gso.solver.directions import GaussNewton, LevenbergMarquardt, adapt_damping
from gso.solver.line_search import ends_next, falls
from gso.tno.batched.batch_problem import Problem
from gso.tno.batched.batch_steps import armijo, direction
from gso.tno.batched.stage_batch import CONVERGED, MAX_ITERATIONS, STALLED


@dataclass
class Minima:
    """The results of a minimisation.

    Attributes
    ----------
    x : Tensor, (n, B)
        Best unknowns.
    energy : Tensor, (B,)
    code : Tensor of int, (B,)
        Why each surface ended.
    iterations : Tensor of int, (B,)
    energies, steps : list of Tensor, (B,)
        Energy and step length after each iteration, the start included; NaN after the end.
    """

    x: Tensor
    energy: Tensor
    code: Tensor
    iterations: Tensor
    energies: list[Tensor] = field(default_factory=list)
    steps: list[Tensor] = field(default_factory=list)


def minimise(
    problem: Problem,
    x: Tensor,
    *,
    iterations: int,
    tolerance: float,
    continuation: Sequence[Loss] = (),
    continued: str = "",
    method: str = "gauss-newton",
    timings: Timings | None = None,
) -> Minima:
    """Minimise problems from x, as :func:`gso.solver.minimise` does for one.

    Parameters
    ----------
    problem : Problem
    x : Tensor, (n, B)
        Start.
    iterations, tolerance : int, float
        Largest number of iterations, and relative decrease of the energy at which to stop.
    continuation : sequence of stacked losses
        Losses by iteration of the terms named `continued`; the last one holds from then on.
    continued : str
    method : {"gauss-newton", "levenberg-marquardt"}
    timings : Timings, optional
        Where to add the seconds spent.
    """
    timings = Timings() if timings is None else timings
    last = len(continuation) - 1
    marquardt = method == "levenberg-marquardt"
    damping = torch.full_like(x[0], (LevenbergMarquardt if marquardt else GaussNewton)().damping)
    solver = problem.structure.solver()

    def with_loss(problem: Problem, iteration: int) -> Problem:
        if last < 0:
            return problem
        return problem.with_loss(continued, continuation[min(iteration, last)])

    clock = time.perf_counter()
    whole = with_loss(problem, last)
    out = Minima(
        x.clone(),
        whole.energy(x),
        torch.full(x.shape[1:], MAX_ITERATIONS, device=x.device),
        torch.full(x.shape[1:], iterations, device=x.device),
    )
    out.energies.append(out.energy.clone())
    out.steps.append(torch.zeros_like(out.energy))
    timings.search += time.perf_counter() - clock
    live, current = torch.arange(x.shape[1], device=x.device), problem
    ready = torch.ones_like(live, dtype=torch.bool)
    for k in range(iterations):
        begun = time.perf_counter()
        settled = k >= last
        if k <= last:
            current = with_loss(current, k)
        energy, gradient, values = current.linearise(x)
        linearised = time.perf_counter()
        step = direction(solver, values, problem.structure.diagonal, gradient, damping)
        solved = time.perf_counter()
        slope = (gradient * step).sum(dim=0)
        longest = current.largest_step(x, step)
        x, value, length = armijo(current, x, step, energy, slope, longest)
        if marquardt:
            damping = adapt_damping(damping, length)
        if settled:
            _keep_best(out, live, x, value)
        for history, now in ((out.energies, value), (out.steps, length)):
            history.append(torch.full_like(out.energy, torch.nan).index_copy_(0, live, now))
        if settled:
            enough, well = falls(energy, value, length, -0.5 * slope, tolerance)
            end = ~enough & ready
            ready = ends_next(length, enough)
            on = torch.nonzero(~end).ravel()
            if len(on) < len(live):
                ended = live[end]
                out.code[ended] = torch.where(well[end], CONVERGED, STALLED)
                out.iterations[ended] = k + 1
                live, x, damping = live[on], x.index_select(1, on), damping[on]
                ready = ready[on]
                current = current.of_surfaces(on)
        timings.evaluate += linearised - begun
        timings.factor += solved - linearised
        timings.search += time.perf_counter() - solved
        if not len(live):
            break
    if iterations <= last:
        # Every surface is still there.
        _keep_best(out, live, x, whole.energy(x))
    return out


def _keep_best(out: Minima, live: Tensor, x: Tensor, value: Tensor) -> None:
    """Take the points with less energy than the best ones so far."""
    best = out.energy.index_select(0, live)
    better = value < best
    out.energy.index_copy_(0, live, torch.where(better, value, best))
    out.x.index_copy_(1, live, torch.where(better, x, out.x.index_select(1, live)))
