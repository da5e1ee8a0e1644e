"""Carry out a task's plan: stage after stage, with history and time kept."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.status import Progress, Status
from gso.tasks.base import Options, Plan, Request, Stage
from gso.tno.problem import Problem
from gso.tno.solver import Callback, Solution, Timings, minimise
from gso.tno.tighten import tighten
from gso.variables import free

Array = NDArray[np.float64]


@dataclass
class Outcome:
    """Coordinates that a run ended with, and how.

    Where the surface is a B-spline: with how many control points, and the coordinates that
    it was fitted to before its own stage.
    """

    blocks: dict[str, Array]
    status: Status
    energy: dict[str, float] = field(default_factory=dict)
    backend: str = ""
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
    spline: tuple[int, int] | None = None
    fitted: dict[str, Array] = field(default_factory=dict)

    @property
    def points(self) -> Array:
        """Its surface (n, 3), or its flat image (n, 2) where that is all there is."""
        return self.blocks["surface"] if "surface" in self.blocks else self.blocks["flat"]


class Run:
    """Solves requests of one task, keeping history and time across several of them."""

    def __init__(self, module: ModuleType, callback: Callback | None):
        self.module = module
        self.callback = callback
        self.history: list[Progress] = []
        self.timings = Timings()
        self.iterations = 0

    def __call__(self, request: Request) -> Outcome:
        """Plan and solve the stages."""
        clock = time.perf_counter()
        plan: Plan = self.module.plan(request)
        self.timings.setup += time.perf_counter() - clock
        coordinates, solution, stage = plan.start, None, None
        given, number = coordinates, 0
        for number, stage in enumerate(plan.stages):
            clock = time.perf_counter()
            given, coordinates = coordinates, stage.enter(coordinates)
            self.timings.setup += time.perf_counter() - clock
            place = number, len(plan.stages)
            coordinates, solution = self.solve(request.options, place, stage, coordinates)
            if solution.status is Status.CANCELLED:
                coordinates = self._finish(plan, number, coordinates)
                break
            if stage.enough is not None and stage.enough(coordinates):
                break
        if solution is not None and stage is not None:
            solve = partial(self.solve, request.options, place)
            coordinates, solution = tighten(stage, coordinates, solution, solve)
        outcome = Outcome(
            plan.layout.split(coordinates),
            plan.status or Status.CONVERGED,
            {"objective": 0.0},
            notes=tuple(plan.notes),
            details=plan.details,
            spline=plan.spline,
        )
        if plan.spline is not None and number == len(plan.stages) - 1:
            outcome.fitted = plan.layout.split(given)
        if solution is not None and stage is not None:
            if solution.status is Status.CANCELLED:
                stage = plan.stages[-1]
            coordinates, outcome.energy = self.guard(plan, stage, coordinates)
            coordinates = plan.finish(coordinates)
            outcome.blocks = plan.layout.split(coordinates)
            outcome.notes += tuple(plan.remark(coordinates)) if plan.remark is not None else ()
            outcome.backend = solution.backend
            if plan.status is None or solution.status is Status.CANCELLED:
                outcome.status = solution.status
        return outcome

    def solve(
        self, options: Options, place: tuple[int, int], stage: Stage, coordinates: Array
    ) -> tuple[Array, Solution]:
        """Solve one stage from coordinates."""
        clock = time.perf_counter()
        variables = stage.variables(coordinates)
        problem = Problem(stage.items, variables, stage.limits)
        x = variables.project(coordinates)
        bounds = None if stage.bounds is None else stage.bounds(coordinates)
        self.timings.setup += time.perf_counter() - clock
        solution = minimise(
            problem,
            x,
            iterations=stage.iterations,
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
    def _finish(plan: Plan, number: int, coordinates: Array) -> Array:
        """Carry a cancelled solve to the last stage's coordinates."""
        for stage in plan.stages[number + 1 :]:
            coordinates = stage.enter(coordinates)
        return coordinates

    @staticmethod
    def guard(plan: Plan, stage: Stage, coordinates: Array) -> tuple[Array, dict[str, float]]:
        """The result, unless what it must not be worse than has less of the objective."""
        problem = Problem(stage.items, free(stage.layout))
        energy = problem.by_term(coordinates)
        if plan.fallback is not None and not sum(energy.values()) <= problem.energy(plan.fallback):
            return plan.fallback, problem.by_term(plan.fallback)
        return coordinates, energy
