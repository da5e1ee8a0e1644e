"""The solve of a task's plans, stage by stage, with history and timings."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from gso.energy import Weighted
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.pipeline.case import Case
from gso.solver import Callback, Minimum, Timings, minimise
from gso.solver.augmented_lagrangian import tighten
from gso.solver.elements import Kind
from gso.solver.problem import Problem, energies, largest_counts
from gso.status import Progress, Status
from gso.tasks.base import Analysis, Options, Plan, Solution, Stage, same
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import control_points


def objective(stage: Stage, *coordinates: Array) -> list[dict[str, float]]:
    """Return the objective of a stage by term at each of given coordinates.

    Terms that enforce hard constraints do not belong to it.
    """
    items = [item for item in stage.items if item.term.multipliers is None]
    return energies(items, stage.layout, *coordinates)


@dataclass(frozen=True)
class PlanState:
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
    case : Case
        The design and the request. Its start says whether :meth:`usable_start` refuses points
        with more energy than a cold start, and bounds iterations and tolerance.
    callback : callable, optional
        Called after each iteration.
    lay_out : callable, optional
        Flattens a surface, for searches that bound its strain.

    Attributes
    ----------
    start_refused : str
        Why the start was not used; empty if it was.
    """

    def __init__(
        self,
        case: Case,
        callback: Callback | None = None,
        *,
        lay_out: Callable[[Mesh], Pattern | None] = lambda surface: None,
    ):
        self.case = case
        self.callback = callback
        self.lay_out = lay_out
        self.start_refused = ""
        self._planned: tuple[Request[Options], Plan] | None = None
        self._problem: Problem | None = None
        self.history: list[Progress] = []
        self.timings = Timings()
        self.iterations = 0

    @property
    def analysis(self) -> Analysis:
        """The task's analysis of the design."""
        return self.case.analysis

    def plan(self, request: Request[Options]) -> Plan:
        """Plan a request in the solver's frame."""
        return self.case.task.plan(self.analysis, request)

    def solve(self, request: Request[Options]) -> Solution:
        """Solve a request from its start if that is usable, by a search where it has limits."""
        search = self.case.task.formulations[request.formulation].search
        if request.limits.given and search is not None:
            return search(self, request)
        return self(request if self.usable_start(request) else replace(request, x0=None))

    def __call__(self, request: Request[Options]) -> Solution:
        """Plan and solve the stages, and post-process the coordinates."""
        clock = time.perf_counter()
        known, self._planned = self._planned, None
        plan = known[1] if known is not None and known[0] is request else self.plan(request)
        self.timings.setup += time.perf_counter() - clock
        if not plan.stages:
            solution = solution_at(plan, plan.start, plan.status or Status.CONVERGED)
        else:
            solution = self.conclude(plan, self.solve_stages(plan, request.options))
        solution.formulation = request.formulation
        return solution

    def conclude(self, plan: Plan, state: PlanState) -> Solution:
        """Return the solution of a plan whose stages have been solved."""
        coordinates, energy = _guard(plan, state)
        status = state.minimum.status
        if plan.status is not None and status is not Status.CANCELLED:
            status = plan.status
        solution = solution_at(plan, coordinates, status, energy, state.stage)
        if plan.result_notes is not None:
            solution.notes += tuple(plan.result_notes(plan.finish(coordinates)))
        solution.backend = state.minimum.backend
        if plan.spline is not None:
            x = state.minimum.x
            if state.entered is None or coordinates is not state.coordinates:
                x = plan.stages[-1].unknowns(coordinates).project(coordinates)
            solution.spline = control_points(plan.layout, plan.spline, x)
            if state.entered is not None:
                solution.fitted = plan.layout.split(state.entered)["surface"]
        return solution

    def usable_start(self, *requests: Request[Options]) -> bool:
        """Return whether a start is to be used for requests that differ in bounds only.

        It is not if a plan refuses it, or, with a guarded start, if its energy is above that of
        a cold start. :attr:`start_refused` says why.
        """
        guarded = self.case.request.start.guarded
        for number, request in enumerate(requests):
            if request.x0 is None:
                return True
            clock = time.perf_counter()
            plan = self.plan(request)
            if number == 0:
                self.start_refused = plan.start_refused
            if guarded and not self.start_refused:
                plan, self.start_refused = _against_cold_start(_enter_first(plan))
            if number == 0:
                self._planned = (request, plan)
            self.timings.setup += time.perf_counter() - clock
        return not (guarded and self.start_refused)

    def continue_from(self, other: Run) -> None:
        """Continue the history, the timings and the count of iterations of another run."""
        self.history, self.timings = other.history, other.timings
        self.iterations = other.iterations

    def evaluate(self, solution: Solution, blocks: dict[str, Array]) -> Solution:
        """Return a solution at other coordinates, with the energy that they have."""
        stage = solution.stage
        if stage is None:
            return replace(solution, blocks=blocks)
        coordinates = stage.layout.pack(blocks)
        energy = objective(stage, coordinates)[0]
        return replace(solution, blocks=blocks, coordinates=coordinates, energy=energy)

    def solve_stages(self, plan: Plan, options: Options) -> PlanState:
        """Solve the stages of a plan with at least one, the last one until hard terms hold."""
        coordinates, entered = plan.start, None
        start = self.case.request.start
        begun = plan.cold_start is not None
        least = start.tolerance if begun else 0.0
        # A cold solve is the same whether there was a start that was dropped or not.
        remaining = start.remaining if begun or start.points is None else 0.0
        stages, further = list(plan.stages), 0
        # Coarser grids use the kernels of the finest, which are compiled if that one is large.
        counts = largest_counts((stage.items, stage.layout) for stage in stages)
        for number, stage in enumerate(stages):
            clock = time.perf_counter()
            entered, coordinates = coordinates, stage.enter(coordinates)
            self.timings.setup += time.perf_counter() - clock
            last = number >= len(plan.stages) - 1
            # A warm start is close to the solution: reserve iterations for the last stage.
            reserved = plan.stages[-1].iterations if begun and not last else 0
            solve = partial(
                self.minimise,
                options,
                replace(stage, tolerance=max(stage.tolerance, least)),
                place=(number, len(stages)),
                reserved=reserved,
                remaining=remaining if last else 0.0,
                counts=counts,
            )
            coordinates, minimum = solve(coordinates)
            if minimum.status is Status.CANCELLED:
                break
            if stage.finished is not None and stage.finished(coordinates):
                del stages[number + 1 :]
            whole = number == len(stages) - 1
            if whole and plan.further is not None and self.case.request.verdict:
                another = plan.further(further, coordinates)
                stages += [] if another is None else [another]
                further += 1
            # Stages of another mesh have another pattern.
            if number + 1 < len(stages) and stages[number + 1].layout != stage.layout:
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
        return PlanState(stage, coordinates, None if after else entered, minimum)

    def minimise(
        self,
        options: Options,
        stage: Stage,
        coordinates: Array,
        *,
        items: Sequence[Weighted] | None = None,
        place: tuple[int, int] = (0, 1),
        reserved: int = 0,
        remaining: float = 0.0,
        counts: Mapping[Kind, int] | None = None,
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
        remaining : float
            As for :func:`gso.solver.minimise`.
        counts : dict, optional
            As for :class:`gso.solver.problem.Problem`.
        """
        clock = time.perf_counter()
        variables = stage.unknowns(coordinates)
        # The stage before may have the same sparsity pattern, as with other directions of offsets.
        before, self._problem = self._problem, None
        terms = stage.items if items is None else items
        problem = Problem(terms, variables, stage.limits, like=before, counts=counts)
        del before
        self._problem = problem
        x = variables.project(coordinates)
        bounds = None if stage.bounds is None else stage.bounds(coordinates)
        if bounds is not None:
            x = np.clip(x, *bounds)
        self.timings.setup += time.perf_counter() - clock
        most = stage.iterations
        budget = self.case.request.start.iterations
        if budget is not None:
            most = min(most, max(budget - self.iterations - reserved, 0))
        minimum = minimise(
            problem,
            x,
            iterations=most,
            tolerance=stage.tolerance,
            remaining=remaining,
            continuation=stage.continuation if items is None else stage.continuation[-1:],
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


def solution_at(
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


def _guard(plan: Plan, state: PlanState) -> tuple[Array, dict[str, float]]:
    """Return the coordinates and their energy, or the fallback's if that has less."""
    stage, coordinates = state.stage, state.coordinates
    if plan.fallback is None:
        return coordinates, (state.energies or objective(stage, coordinates))[0]
    if state.energies is not None:
        energy, other = state.energies
    elif plan.fallback_energy is not None and stage is plan.stages[-1]:
        energy, other = objective(stage, coordinates)[0], plan.fallback_energy
    else:
        energy, other = objective(stage, coordinates, plan.fallback)
    if not sum(energy.values()) <= sum(other.values()):
        return plan.fallback, other
    return coordinates, energy


def _enter_first(plan: Plan) -> Plan:
    """Return an equivalent plan whose start is that of its first stage."""
    if not plan.stages:
        return plan
    first, *others = plan.stages
    return replace(
        plan, start=first.enter(plan.start), stages=[replace(first, enter=same), *others]
    )


def _against_cold_start(plan: Plan) -> tuple[Plan, str]:
    """Say that the start has more energy than a cold start; empty if it has not.

    The plan is returned with its fallback's energy, if that is the start.
    """
    if plan.cold_start is None or not plan.stages:
        return plan, ""
    # A spline is fitted to the result of the stage before its own: compare there.
    stages = plan.stages if plan.spline is None else plan.stages[:-1]
    coordinates = plan.start
    for stage in stages:
        coordinates = stage.enter(coordinates)
    found = objective(stages[-1], coordinates, plan.cold_start())
    fallback = plan.fallback if stages is plan.stages else None
    if fallback is not None and np.array_equal(coordinates, fallback):
        plan = replace(plan, fallback_energy=found[0])
    warm, cold = (sum(energy.values()) for energy in found)
    if warm <= cold:
        return plan, ""
    return plan, f"its energy, {warm:.3g}, is above that of the start without it, {cold:.3g}"
