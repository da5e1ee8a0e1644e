"""The iteration: linearise, factorise, line search, until the energy no longer falls."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gso import linalg
from gso.energy.losses import Loss
from gso.linalg.base import Solver
from gso.solver.directions import METHODS, GaussNewton
from gso.solver.line_search import armijo, ends_next, foretold, relative_decrease
from gso.solver.problem import Problem
from gso.status import Progress, Status
from gso.typing import Array, Flags

Callback = Callable[[Progress], object]


@dataclass
class Timings:
    """Seconds by phase, summed over a solve."""

    setup: float = 0.0
    evaluate: float = 0.0
    factor: float = 0.0
    search: float = 0.0

    def as_dict(self) -> dict[str, float]:
        """Phases by name."""
        return dict(vars(self))

    def scaled(self, factor: float) -> Timings:
        """Return a share of them."""
        return Timings(**{phase: factor * seconds for phase, seconds in vars(self).items()})

    def add(self, other: Timings) -> None:
        """Add those of another solve."""
        for phase, seconds in vars(other).items():
            setattr(self, phase, getattr(self, phase) + seconds)


@dataclass
class Minimum:
    """The result of a minimisation."""

    x: Array
    energy: float
    status: Status
    iterations: int
    backend: str
    history: list[Progress] = field(default_factory=list)


class Cancelled(Exception):
    """The callback returned False."""


def minimise(
    problem: Problem,
    x: Array,
    *,
    iterations: int,
    tolerance: float = 1e-4,
    remaining: float = 0.0,
    continuation: Sequence[Loss] = (),
    continued: str = "",
    bounds: tuple[Array, Array] | None = None,
    method: str = "gauss-newton",
    direction: GaussNewton | None = None,
    backend: str | None = None,
    solver: Solver | None = None,
    threads: int = 1,
    callback: Callback | None = None,
    stage: tuple[int, int] = (0, 1),
    name: str = "",
    timings: Timings | None = None,
) -> Minimum:
    """Minimise a problem from x; the energy returned is never above that of x.

    Parameters
    ----------
    problem : Problem
        Objective over unknowns.
    x : ndarray
        Start.
    iterations : int
        Largest number of iterations.
    tolerance : float
        Stop when an iteration with the last loss of `continuation` lowers the energy by less
        than this share of it; not the first such iteration after a shortened step.
    remaining : float
        Stop when all further iterations together would lower the energy by less than this share
        of it, as the last two decreases foretell, or after one iteration a third of its decrease.
    continuation : sequence of Loss
        Losses by iteration of the terms named `continued`. The last one holds for all later
        iterations and for the energy returned.
    continued : str
        Name of these terms.
    bounds : (ndarray, ndarray), optional
        Smallest and largest value of every unknown; x must respect them.
    method : {"gauss-newton", "levenberg-marquardt"}
        How the direction of a step is computed.
    direction : GaussNewton, optional
        A direction that continues with its damping, instead of that of `method`.
    backend : str, optional
        Linear backend; the fastest installed one when not given.
    solver : Solver, optional
        A linear solver that has already analysed the problem's sparsity pattern.
    threads : int
        BLAS threads around factorisations; 0 leaves them alone.
    callback : callable, optional
        Called with each :class:`gso.Progress`; returning False stops the solve.
    stage : (int, int)
        Index and number of stages, for the callback.
    name : str
        Name of the stage, for the callback.
    timings : Timings, optional
        Where to add the seconds spent.
    """
    timings = Timings() if timings is None else timings
    clock = time.perf_counter()
    if solver is None:
        solver = linalg.choose(problem.pattern, backend)
    timings.setup += time.perf_counter() - clock
    direction = METHODS[method]() if direction is None else direction
    last = len(continuation) - 1
    history: list[Progress] = []

    def report(iteration: int, energy: float, step: float) -> None:
        by_term = current.by_term(x) if callback is not None else {}
        progress = Progress(*stage, iteration, iterations, energy, by_term, step, name)
        history.append(progress)
        if callback is not None and says_no(callback(progress)):
            raise Cancelled

    def continued_to(problem: Problem, iteration: int) -> Problem:
        """Return a problem with the loss of an iteration."""
        if not continuation:
            return problem
        return problem.with_loss(continued, continuation[min(iteration, last)])

    project = None if bounds is None else partial(np.clip, a_min=bounds[0], a_max=bounds[1])
    clock = time.perf_counter()
    current = continued_to(problem, last).refreshed(x)
    best, best_energy = x, current.energy(x)
    timings.search += time.perf_counter() - clock
    status = Status.MAX_ITERATIONS
    if not len(x):
        # Constraints fix every vertex: there are no unknowns.
        status, iterations = Status.CONVERGED, 0
    done, ready, gained = 0, True, 0.0
    try:
        report(0, best_energy, 0.0)
        with linalg.blas_threads(threads):
            for k in range(iterations):
                settled = k >= last
                t0 = time.perf_counter()
                current = continued_to(problem, k).refreshed(x)
                energy, gradient, values = current.linearise(x)
                t1 = time.perf_counter()
                if bounds is not None:
                    held = _at_bound(x, gradient, bounds)
                    gradient = np.where(held, 0.0, gradient)
                    values[problem.diagonal[held]] += _STIFF * values[problem.diagonal].max()
                d = direction.step(solver, values, problem.diagonal, gradient)
                t2 = time.perf_counter()
                longest = problem.largest_step(x, d)
                x, value, step = armijo(
                    current.energy, x, d, energy, gradient, project=project, longest=longest
                )
                direction.accepted(step)
                done = k + 1
                if settled and value < best_energy:
                    best, best_energy = x, value
                timings.evaluate += t1 - t0
                timings.factor += t2 - t1
                timings.search += time.perf_counter() - t2
                report(done, value, step)
                expected = -0.5 * float(gradient @ d)
                end = relative_decrease(energy, value, step, expected, tolerance)
                if settled and end and ready:
                    status = end
                    break
                fell = energy - value
                least = remaining * abs(value)
                if settled and not k:
                    gained = fell / _NEXT
                if step >= 1.0 and gained > 0 and foretold(gained, fell) < least:
                    status = Status.CONVERGED
                    break
                gained = fell if settled and step >= 1.0 else 0.0
                ready = ends_next(step, end is None)
    except Cancelled:
        status = Status.CANCELLED
    if done <= last:
        value = continued_to(current, last).energy(x)
        if value < best_energy:
            best, best_energy = x, value
    return Minimum(best, best_energy, status, done, solver.name, history)


#: Decrease of the energy by the second iteration, relative to the first, that is expected: all
#: further ones then lower it by a third of the first. That is the median of solves on grids of
#: 128 x 128 and 256 x 256 that start from solves on coarser ones.
_NEXT = 0.25
#: Diagonal entry, relative to the largest one, that keeps an unknown at its bound.
_STIFF = 1e6


def says_no(answer: object) -> bool:
    """Return whether a callback's answer ends the solve: only False does, None does not."""
    return isinstance(answer, bool | np.bool_) and not answer


def _at_bound(x: Array, gradient: Array, bounds: tuple[Array, Array]) -> Flags:
    """Return the mask of unknowns at a bound beyond which the energy would fall."""
    low, high = bounds
    width = high - low
    margin = 1e-6 * np.where(np.isfinite(width), width, 0.0)
    return ((x <= low + margin) & (gradient > 0)) | ((x >= high - margin) & (gradient < 0))
