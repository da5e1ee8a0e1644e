"""The solve of a mesh: normalise, plan, solve the stages, return to the user's frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from gso import linalg, tasks
from gso.components import several
from gso.constraints import Constraint, compile_constraints
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.pipeline import component_solves
from gso.pipeline.job import Job
from gso.pipeline.judgement import judged, requirements
from gso.pipeline.lay_flat import lay_out
from gso.pipeline.normalise import Canonical
from gso.pipeline.run import Run
from gso.pipeline.start import Start
from gso.pipeline.user_result import packed, record_violations
from gso.result import Result
from gso.solver import Callback
from gso.tasks.base import Options, Request


@dataclass(frozen=True)
class Asked:
    """What the user asked for, with checked options.

    Attributes
    ----------
    task, formulation, options
        As for :func:`optimize`.
    bounds : dict
        Bounds on the result by name, in the user's unit; None where there is none.
    formulation_given : bool
        Whether the user named the formulation.
    verdict : bool
        Whether to judge the result.
    """

    task: str
    formulation: str
    options: Options
    bounds: dict[str, float | None]
    formulation_given: bool
    verdict: bool

    @property
    def bounded(self) -> bool:
        """Whether there is any bound."""
        return any(value is not None for value in self.bounds.values())


def solve_mesh(
    asked: Asked,
    callback: Callback | None,
    design: Mesh,
    constraints: Sequence[Constraint],
    start: Start,
) -> Result:
    """Solve a mesh: each of its components that no constraint joins to others on its own."""
    flat = getattr(tasks.get(asked.task), "BLOCK", "surface") == "flat"
    whole = Job(design, compile_constraints(constraints, design, flat=flat), start)
    one = partial(_solved, asked)
    parts = component_solves.parts(design, whole.constraints)
    if parts:
        return component_solves.solve(one, whole, parts, callback)
    return one(whole, callback)


def _solved(asked: Asked, job: Job, callback: Callback | None) -> Result:
    """Solve one job: a single component, or several that constraints join."""
    module, given = tasks.get(asked.task), job.start
    frame = Canonical(job.design, job.names)
    unit = frame.frame.scale
    flat = job.constraints.flat
    compiled = frame.constraints(job.constraints, flat=flat)
    analysis = tasks.analyse(module, frame.mesh, compiled)
    run = Run(
        module,
        analysis,
        callback,
        guarded=given.guarded,
        budget=given.iterations,
        tolerance=given.tolerance,
        lay_out=lay_out,
    )
    options = asked.options.in_unit(unit)
    request = Request(options, asked.formulation, frame.start(given.points, flat=flat))
    if asked.bounded:
        solution, formulation = module.search(
            run, request, asked.bounds, unit, others=not asked.formulation_given
        )
    else:
        if not run.usable_start(request):
            request = replace(request, start=None)
        solution, formulation = run(request), asked.formulation
    record_violations(compiled, frame, solution.blocks[compiled.block], solution)
    result = packed(asked.task, formulation, job.design, frame, solution, run)
    if several(job.design):
        result.notes += ("its components are joined by constraints and solved together",)
    if run.start_refused:
        result.notes += (f"the start ({given.source}) was not used: {run.start_refused}",)
    elif given.points is not None:
        result.warm_start = given.source
    if asked.verdict:
        result = judged(result, requirements(frame.mesh, compiled, unit, **asked.bounds))
    return result


def check(
    task: str,
    formulation: str | None = None,
    options: Any = None,
    max_deviation: float | None = None,
    target_curvature: float | None = None,
    max_strain: float | None = None,
) -> tuple[ModuleType, str, Options]:
    """Check the arguments of :func:`optimize` that do not depend on the mesh.

    Returns
    -------
    module, formulation, options
        The task's module, its formulation, its settings.

    Raises
    ------
    OptionError
        Something is unknown or contradictory.
    BackendError
        The requested backend is not installed.
    """
    module = tasks.get(task)
    formulation, kind = tasks.choose(module, formulation, options)
    settings = kind.coerce(options)
    if settings.backend is not None:
        linalg.find(settings.backend)
    bounds = {
        "max_deviation": max_deviation,
        "max_strain": max_strain,
        "target_curvature": target_curvature,
    }
    for name, value in bounds.items():
        if value is None:
            continue
        if not hasattr(module, "check_bounds"):
            raise OptionError(f"{name} belongs to task 'developable', not {task!r}")
        if not (isinstance(value, int | float | np.number) and 0 < value < np.inf):
            raise OptionError(f"{name} is {value!r}; it must be a positive number")
    if any(value is not None for value in bounds.values()):
        module.check_bounds(formulation, bounds)
    return module, formulation, settings
