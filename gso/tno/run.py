"""Carry out a task's plan: stage after stage, with history and time kept."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.status import Progress, Status
from gso.tasks.base import Plan, Request
from gso.tno.problem import Problem
from gso.tno.solver import Callback, Solution, Timings, minimise
from gso.variables import free

Array = NDArray[np.float64]


@dataclass
class Outcome:
    """Coordinates that a run ended with, and how."""

    block: str
    points: Array
    status: Status
    energy: dict[str, float] = field(default_factory=dict)
    backend: str = ""
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)


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
        dim = 2 if plan.block == "flat" else 3
        coordinates, solution = plan.start, None
        for number, stage in enumerate(plan.stages):
            clock = time.perf_counter()
            coordinates = stage.enter(coordinates)
            variables = stage.variables(coordinates)
            problem = Problem(stage.items, variables, stage.limits)
            x = variables.project(coordinates)
            bounds = None if stage.bounds is None else stage.bounds(coordinates)
            self.timings.setup += time.perf_counter() - clock
            solution = self._solve(request, plan, number, problem, x, bounds)
            coordinates = variables.points(solution.x)
            if solution.status is Status.CANCELLED:
                coordinates = self._finish(plan, number, coordinates)
                break
        outcome = Outcome(
            plan.block,
            coordinates.reshape(-1, dim),
            plan.status or Status.CONVERGED,
            {"objective": 0.0},
            notes=tuple(plan.notes),
            details=plan.details,
        )
        if solution is not None:
            coordinates, outcome.energy = self._guard(request, plan, coordinates)
            outcome.points = plan.finish(coordinates).reshape(-1, dim)
            outcome.status, outcome.backend = solution.status, solution.backend
        return outcome

    def _solve(
        self,
        request: Request,
        plan: Plan,
        number: int,
        problem: Problem,
        x: Array,
        bounds: tuple[Array, Array] | None,
    ) -> Solution:
        stage, options = plan.stages[number], request.options
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
            stage=(number, len(plan.stages)),
            name=stage.name,
            timings=self.timings,
        )
        self.iterations += solution.iterations
        self.history += solution.history
        return solution

    @staticmethod
    def _finish(plan: Plan, number: int, coordinates: Array) -> Array:
        """Carry a cancelled solve to the last stage's coordinates."""
        for stage in plan.stages[number + 1 :]:
            coordinates = stage.enter(coordinates)
        return coordinates

    @staticmethod
    def _guard(request: Request, plan: Plan, coordinates: Array) -> tuple[Array, dict[str, float]]:
        """The result, unless the start has less of the final objective."""
        stage = plan.stages[-1]
        problem = Problem(stage.items, free(stage.layout))
        given = request.start if request.start is not None else request.mesh.vertices
        feasible = plan.block == "surface" and request.constraints.empty
        feasible &= request.start is None or plan.reach is None
        energy = problem.by_term(coordinates)
        if feasible and not sum(energy.values()) <= problem.energy(given.ravel()):
            return given.ravel(), problem.by_term(given.ravel())
        return coordinates, energy
