"""The solve of a task's plans, stage by stage, with history and timings."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.status import Progress, Status
from gso.tasks.base import Options, Plan, Request, Solution, Stage, same
from gso.tno.solver import Callback, Minimum, Timings, minimise
from gso.tno.solver.augmented_lagrangian import tighten
from gso.tno.solver.minimiser import says_no
from gso.tno.solver.problem import Problem, energies, largest_counts
from gso.typing import Array
from gso.unknowns import control_points


def objective(stage: Stage, *coordinates: Array) -> list[dict[str, float]]:
    """Return the objective of a stage by term at each of given coordinates.

    Terms that enforce hard constraints do not belong to it.
    """
    items = [item for item in stage.items if item.term.multipliers is None]
    return energies(items, stage.layout, *coordinates)


@dataclass(frozen=True)
class Reached:
    """The state after some stages of a plan.

    Attributes
    ----------
    stage : Stage
        The stage solved last, or the plan's last stage where the solve was cancelled.
    coordinates : ndarray
        Coordinates of that stage.
    entered : ndarray or None
        Coordinates before the plan's last stage; None where that was not solved.
    minimum : Minimum
        Its result.
    energies : tuple of dict, optional
        The objective of the stage by term at `coordinates` and at the plan's fallback, where they
        are known.
    """

    stage: Stage
    coordinates: Array
    entered: Array | None
    minimum: Minimum
    energies: tuple[dict[str, float], dict[str, float]] | None = None


class Run:
    """Solver of requests of one task for one design, with history and timings over all of them.

    Parameters
    ----------
    module : module
        The task.
    analysis : Analysis
        Its analysis of the design and the constraints.
    callback : callable, optional
        Called after each iteration.
    guarded : bool
        Whether :meth:`usable_start` refuses a start with more energy than a cold start.
    budget : int or None
        Largest number of iterations of all solves together.
    tolerance : float
        Lower limit of the stages' tolerance where a start was given.
    lay_out : callable, optional
        Flattens a surface, for searches that bound its strain.

    Attributes
    ----------
    start_refused : str
        Why the start was not used; empty if it was.
    converting : float
        Seconds that plans took to make their results from the solutions of their stages.
    """

    def __init__(
        self,
        module: ModuleType,
        analysis: Any,
        callback: Callback | None = None,
        *,
        guarded: bool = False,
        budget: int | None = None,
        tolerance: float = 0.0,
        lay_out: Callable[[Mesh], Pattern | None] = lambda surface: None,
    ):
        self.module = module
        self.analysis = analysis
        self.callback = callback
        self.guarded = guarded
        self.budget = budget
        self.tolerance = tolerance
        self._lay_out = lay_out
        self.start_refused = ""
        self._planned: tuple[Request, Plan] | None = None
        self._problem: Problem | None = None
        self.history: list[Progress] = []
        self.timings = Timings()
        self.iterations = 0
        self.converting = 0.0

    def lay_out(self, surface: Mesh) -> Pattern | None:
        """Flatten a surface."""
        clock = time.perf_counter()
        pattern = self._lay_out(surface)
        self.timings.setup += time.perf_counter() - clock
        return pattern

    def __call__(self, request: Request) -> Solution:
        """Plan and solve the stages."""
        clock = time.perf_counter()
        made, self._planned = self._planned, None
        if made is not None and made[0] is request:
            plan = made[1]
        else:
            plan = self.module.plan(self.analysis, request)
        self.timings.setup += time.perf_counter() - clock
        return self.solve(plan, request.options)

    def solve(self, plan: Plan, options: Options) -> Solution:
        """Solve the stages of a plan, and post-process the coordinates."""
        solution = self._solution(plan, options)
        if plan.convert is None or solution.status is Status.CANCELLED:
            return solution
        clock = time.perf_counter()
        solution = plan.convert(solution, self._told)
        self.converting += time.perf_counter() - clock
        return solution

    def _told(self, progress: Progress) -> bool:
        """Report an iteration of a conversion; return whether to go on."""
        return self.callback is None or not says_no(self.callback(progress))

    def _solution(self, plan: Plan, options: Options) -> Solution:
        if not plan.stages:
            return _finished(plan, plan.start, plan.status or Status.CONVERGED)
        return self.concluded(plan, self.through(plan, options))

    def concluded(self, plan: Plan, reached: Reached) -> Solution:
        """Return the solution of a plan whose stages have been solved."""
        coordinates, energy = _guard(plan, reached)
        status = reached.minimum.status
        if plan.status is not None and status is not Status.CANCELLED:
            status = plan.status
        solution = _finished(plan, coordinates, status, energy, reached.stage)
        if plan.result_notes is not None:
            solution.notes += tuple(plan.result_notes(plan.finish(coordinates)))
        solution.backend = reached.minimum.backend
        if plan.spline is not None:
            x = reached.minimum.x
            if reached.entered is None or coordinates is not reached.coordinates:
                x = plan.stages[-1].unknowns(coordinates).project(coordinates)
            solution.spline = control_points(plan.layout, plan.spline, x)
            if reached.entered is not None:
                solution.fitted = plan.layout.split(reached.entered)["surface"]
        return solution

    def usable_start(self, *requests: Request) -> bool:
        """Return whether a start is to be used for requests that differ in bounds only.

        It is not if a plan refuses it, or, with `guarded`, if its energy is above that of a
        cold start. :attr:`start_refused` says why.
        """
        for number, request in enumerate(requests):
            if request.start is None:
                return True
            clock = time.perf_counter()
            plan = self.module.plan(self.analysis, request)
            if number == 0:
                self.start_refused = plan.start_refused
            if self.guarded and not self.start_refused:
                plan = _entered(plan)
                self.start_refused = _worse(plan)
            if number == 0:
                self._planned = (request, plan)
            self.timings.setup += time.perf_counter() - clock
        return not (self.guarded and self.start_refused)

    def continue_from(self, other: Run) -> None:
        """Continue the history, the timings and the count of iterations of another run."""
        self.history, self.timings = other.history, other.timings
        self.iterations = other.iterations

    def moved(self, solution: Solution, blocks: dict[str, Array]) -> Solution:
        """Return a solution at other coordinates, with the energy that they have."""
        stage = solution.stage
        if stage is None:
            return replace(solution, blocks=blocks)
        coordinates = stage.layout.pack(blocks)
        return replace(
            solution,
            blocks=blocks,
            coordinates=coordinates,
            energy=objective(stage, coordinates)[0],
        )

    def through(self, plan: Plan, options: Options) -> Reached:
        """Solve the stages of a plan with at least one, the last one until hard terms hold."""
        coordinates, entered = plan.start, None
        least = 0.0 if plan.cold_start is None else self.tolerance
        stages = plan.stages
        # Coarser grids use the kernels of the finest, which are compiled if that one is large.
        counts = largest_counts((stage.items, stage.layout) for stage in stages)
        for number, stage in enumerate(stages):
            clock = time.perf_counter()
            entered, coordinates = coordinates, stage.enter(coordinates)
            self.timings.setup += time.perf_counter() - clock
            last = number == len(stages) - 1
            # A warm start is close to the solution: reserve iterations for the last stage.
            reserved = 0 if last or plan.cold_start is None else stages[-1].iterations
            solve = partial(
                self.minimise,
                options,
                replace(stage, tolerance=max(stage.tolerance, least)),
                place=(number, len(stages)),
                reserved=reserved,
                counts=counts,
            )
            coordinates, minimum = solve(coordinates)
            if minimum.status is Status.CANCELLED:
                break
            if stage.finished is not None and stage.finished(coordinates):
                break
            # Stages of another mesh have another pattern.
            if not last and stages[number + 1].layout != stage.layout:
                self._problem = None
        after = stages[number + 1 :]
        if minimum.status is Status.CANCELLED:
            # Transfer the coordinates to the last stage without solving.
            for stage in after:
                coordinates = stage.enter(coordinates)
        else:
            coordinates, minimum = tighten(
                stage.items,
                stage.layout,
                coordinates,
                minimum,
                lambda items, at: solve(at, items=items),
            )
        self._problem = None
        return Reached(stage, coordinates, None if after else entered, minimum)

    def minimise(
        self,
        options: Options,
        stage: Stage,
        coordinates: Array,
        *,
        items: Any = None,
        place: tuple[int, int] = (0, 1),
        reserved: int = 0,
        counts: Any = None,
    ) -> tuple[Array, Minimum]:
        """Minimise the objective of one stage from coordinates.

        Parameters
        ----------
        options : Options
            Settings of the solver.
        stage : Stage
            The stage.
        coordinates : ndarray
            Its initial coordinates.
        items : sequence of Weighted, optional
            Terms in place of the stage's, without continuation.
        place : (int, int)
            Index and number of stages, for the callback.
        reserved : int
            Iterations of the budget to leave for later stages.
        counts : dict, optional
            As for :class:`gso.tno.solver.problem.Problem`.
        """
        clock = time.perf_counter()
        variables = stage.unknowns(coordinates)
        again = items is not None
        # The stage before may have the same sparsity pattern, as with other directions of offsets.
        before, self._problem = self._problem, None
        wanted = items if again else stage.items
        problem = Problem(wanted, variables, stage.limits, like=before, counts=counts)
        del before
        self._problem = problem
        x = variables.project(coordinates)
        bounds = None if stage.bounds is None else stage.bounds(coordinates)
        if bounds is not None:
            x = np.clip(x, *bounds)
        self.timings.setup += time.perf_counter() - clock
        most = stage.iterations
        if self.budget is not None:
            most = min(most, max(self.budget - self.iterations - reserved, 0))
        minimum = minimise(
            problem,
            x,
            iterations=most,
            tolerance=stage.tolerance,
            continuation=stage.continuation[-1:] if again else stage.continuation,
            continued=stage.continued,
            bounds=bounds,
            method=options.method,
            backend=options.backend,
            threads=options.threads,
            callback=self.callback,
            stage=place,
            name=stage.name,
            timings=self.timings,
        )
        self.iterations += minimum.iterations
        self.history += minimum.history
        return variables.points(minimum.x), minimum


def _finished(
    plan: Plan,
    coordinates: Array,
    status: Status,
    energy: dict[str, float] | None = None,
    stage: Stage | None = None,
) -> Solution:
    """Return the solution of a plan at the coordinates of its last stage."""
    done = coordinates if stage is None else plan.finish(coordinates)
    return Solution(
        plan.layout.split(done),
        status,
        {"objective": 0.0} if energy is None else energy,
        coordinates,
        notes=tuple(plan.notes),
        details=dict(plan.details),
        cut=plan.cut,
        stage=stage,
    )


def _guard(plan: Plan, reached: Reached) -> tuple[Array, dict[str, float]]:
    """Return the coordinates and their energy, or the fallback's if that has less."""
    stage, coordinates = reached.stage, reached.coordinates
    if plan.fallback is None:
        return coordinates, (reached.energies or objective(stage, coordinates))[0]
    energy, other = reached.energies or objective(stage, coordinates, plan.fallback)
    if not sum(energy.values()) <= sum(other.values()):
        return plan.fallback, other
    return coordinates, energy


def _entered(plan: Plan) -> Plan:
    """Return an equivalent plan whose start is that of its first stage."""
    if not plan.stages:
        return plan
    first, *others = plan.stages
    return replace(
        plan, start=first.enter(plan.start), stages=[replace(first, enter=same), *others]
    )


def _worse(plan: Plan) -> str:
    """Say that the start has more energy than a cold start; empty if it has not."""
    if plan.cold_start is None or not plan.stages:
        return ""
    # A spline is fitted to the result of the stage before its own: compare there.
    stages = plan.stages if plan.spline is None else plan.stages[:-1]
    coordinates = plan.start
    for stage in stages:
        coordinates = stage.enter(coordinates)
    found = objective(stages[-1], coordinates, plan.cold_start())
    warm, cold = (sum(energy.values()) for energy in found)
    if warm <= cold:
        return ""
    return f"its energy, {warm:.3g}, is above that of the start without it, {cold:.3g}"
