"""The solve of a task's plan, stage by stage, with history and timings."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gso.mesh.cutting import Cut
from gso.status import Progress, Status
from gso.tasks.base import Options, Plan, Request, Stage, same
from gso.tno.solver import Callback, Solution, Timings, minimise
from gso.tno.solver.augmented_lagrangian import tighten
from gso.tno.solver.problem import Problem, energies
from gso.typing import Array


@dataclass
class Outcome:
    """Final coordinates of a run, with status and energy.

    Where the surface is a B-spline, `spline` is the number of control points along both sides,
    and `fitted` the coordinates before the spline's own stage. Where the design was cut open
    to flatten it, `cut` says how. `stage` is the stage that was solved last.
    """

    blocks: dict[str, Array]
    status: Status
    energy: dict[str, float] = field(default_factory=dict)
    backend: str = ""
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
    spline: tuple[int, int] | None = None
    fitted: dict[str, Array] = field(default_factory=dict)
    cut: Cut | None = None
    stage: Stage | None = None

    def move(self, blocks: dict[str, Array]) -> None:
        """Replace the coordinates, and recompute the energy."""
        self.blocks = blocks
        if self.stage is not None:
            self.energy = objective(self.stage, self.stage.layout.pack(blocks))

    @property
    def points(self) -> Array:
        """Its surface (n, 3), or its flat image (n, 2) where it has no surface."""
        return self.blocks["surface"] if "surface" in self.blocks else self.blocks["flat"]


class End(NamedTuple):
    """Final state of the stages of a plan.

    `coordinates` belong to `stage`: the stage solved last, or the plan's last stage where the
    solve was cancelled. `given` are the coordinates before the plan's last stage, or None where
    that was not solved.
    """

    coordinates: Array
    given: Array | None
    stage: Stage
    solution: Solution


def objective(stage: Stage, coordinates: Array) -> dict[str, float]:
    """Return the objective of a stage by term, without terms that enforce hard constraints."""
    items = [item for item in stage.items if item.term.multipliers is None]
    return energies(items, stage.layout, coordinates)


class Run:
    """Solver of requests of one task, with history and timings over all of them.

    Attributes
    ----------
    guarded : bool
        Whether the start of the first request is dropped, there and in later requests, if the
        plan refuses it or its energy is above that of a cold start.
    budget : int or None
        Largest number of iterations of all solves together.
    tolerance : float
        Lower limit of the stages' tolerance where a start was given.
    refused : str
        Why that start was not used.
    """

    def __init__(
        self,
        module: ModuleType,
        callback: Callback | None,
        *,
        guarded: bool = False,
        budget: int | None = None,
        tolerance: float = 0.0,
    ):
        self.module = module
        self.callback = callback
        self.guarded = guarded
        self.budget = budget
        self.tolerance = tolerance
        self.refused = ""
        self._judged = False
        self._dropped: Array | None = None
        self.history: list[Progress] = []
        self.timings = Timings()
        self.iterations = 0

    def __call__(self, request: Request) -> Outcome:
        """Plan and solve the stages."""
        clock = time.perf_counter()
        plan = self._plan(request)
        self.timings.setup += time.perf_counter() - clock
        outcome = Outcome(
            {},
            plan.status or Status.CONVERGED,
            {"objective": 0.0},
            notes=tuple(plan.notes),
            details=plan.details,
            spline=plan.spline,
            cut=plan.cut,
        )
        if not plan.stages:
            outcome.blocks = plan.layout.split(plan.start)
            return outcome
        end = self.through(plan, request.options)
        coordinates, outcome.energy = self.guard(plan, end.stage, end.coordinates)
        coordinates = plan.finish(coordinates)
        outcome.blocks = plan.layout.split(coordinates)
        if plan.spline is not None and end.given is not None:
            outcome.fitted = plan.layout.split(end.given)
        outcome.notes += tuple(plan.remark(coordinates)) if plan.remark is not None else ()
        outcome.backend, outcome.stage = end.solution.backend, end.stage
        if plan.status is None or end.solution.status is Status.CANCELLED:
            outcome.status = end.solution.status
        return outcome

    def _plan(self, request: Request) -> Plan:
        """Return the task's plan, from the given start unless that is dropped."""
        if request.start is not None and request.start is self._dropped:
            request = replace(request, start=None)
        plan: Plan = self.module.plan(request)
        # Later requests have starts that a search chose.
        first, self._judged = not self._judged, True
        if not first or request.start is None:
            return plan
        self.refused = plan.refused
        if self.guarded and not self.refused:
            self.refused = self._worse(plan)
            if not self.refused and request.max_deviation is not None:
                # `stay_within` also solves without the bound.
                free = self.module.plan(replace(request, max_deviation=None))
                self.refused = self._worse(free)
        if not (self.guarded and self.refused):
            return plan
        self._dropped = request.start
        return self.module.plan(replace(request, start=None))

    @staticmethod
    def _worse(plan: Plan) -> str:
        """Say that the start has more energy than a cold start; empty if it has not."""
        if plan.unstarted is None or not plan.stages:
            return ""
        # The spline is fitted to the result of the stage before its own: compare there.
        stages = plan.stages if plan.spline is None else plan.stages[:-1]
        # Enter the first stage only once, for both the comparison and the solve.
        plan.start, stages[0].enter = stages[0].enter(plan.start), same
        warm, cold = (
            sum(objective(stages[-1], coordinates).values())
            for coordinates in (replace(plan, stages=stages).entered(), plan.unstarted())
        )
        if warm <= cold:
            return ""
        return f"its energy, {warm:.3g}, is above that of the start without it, {cold:.3g}"

    def through(self, plan: Plan, options: Options) -> End:
        """Solve the stages of a plan with at least one, the last one until hard terms hold."""
        coordinates, given = plan.start, None
        least = 0.0 if plan.unstarted is None else self.tolerance
        for number, stage in enumerate(plan.stages):
            stage.tolerance = max(stage.tolerance, least)
            clock = time.perf_counter()
            given, coordinates = coordinates, stage.enter(coordinates)
            self.timings.setup += time.perf_counter() - clock
            last = stage is plan.stages[-1]
            # A warm start is close to the solution: reserve iterations for the last stage.
            kept = 0 if last or plan.unstarted is None else plan.stages[-1].iterations
            solve = partial(self.solve, options, (number, len(plan.stages)), kept=kept)
            coordinates, solution = solve(stage, coordinates)
            if solution.status is Status.CANCELLED:
                break
            if stage.enough is not None and stage.enough(coordinates):
                break
        after = plan.stages[number + 1 :]
        if solution.status is Status.CANCELLED:
            # Transfer the coordinates to the last stage without solving.
            for stage in after:
                coordinates = stage.enter(coordinates)
        else:
            again = replace(stage, eps=stage.eps[-1:])
            coordinates, solution = tighten(
                stage.items,
                coordinates,
                solution,
                lambda items, at: solve(replace(again, items=list(items)), at),
            )
        return End(coordinates, None if after else given, stage, solution)

    def solve(
        self,
        options: Options,
        place: tuple[int, int],
        stage: Stage,
        coordinates: Array,
        *,
        kept: int = 0,
    ) -> tuple[Array, Solution]:
        """Solve one stage from coordinates, leaving `kept` iterations of the budget."""
        clock = time.perf_counter()
        variables = stage.variables(coordinates)
        problem = Problem(stage.items, variables, stage.limits)
        x = variables.project(coordinates)
        bounds = None if stage.bounds is None else stage.bounds(coordinates)
        if bounds is not None:
            x = np.clip(x, *bounds)
        self.timings.setup += time.perf_counter() - clock
        most = stage.iterations
        if self.budget is not None:
            most = min(most, max(self.budget - self.iterations - kept, 0))
        solution = minimise(
            problem,
            x,
            iterations=most,
            tolerance=stage.tolerance,
            eps=stage.eps,
            robust=stage.robust,
            bounds=bounds,
            method=options.method,
            backend=options.backend,
            threads=options.threads,
            callback=self.callback,
            stage=place,
            name=stage.name,
            timings=self.timings,
        )
        self.iterations += solution.iterations
        self.history += solution.history
        return variables.points(solution.x), solution

    @staticmethod
    def guard(plan: Plan, stage: Stage, coordinates: Array) -> tuple[Array, dict[str, float]]:
        """Return the coordinates and their energy, or the fallback's if that has less."""
        energy = objective(stage, coordinates)
        if plan.fallback is not None:
            other = objective(stage, plan.fallback)
            if not sum(energy.values()) <= sum(other.values()):
                return plan.fallback, other
        return coordinates, energy
