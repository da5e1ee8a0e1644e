"""The solve of a mesh: normalise, plan, solve the stages, return to the user's frame."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from gso import linalg, tasks
from gso.components import several
from gso.constraints import TIGHT, Compiled, Constraint, compile_constraints
from gso.errors import ConvergenceWarning, MeshError, OptionError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.result import Result
from gso.spelling import known_keywords
from gso.spline.fit import describe_spline
from gso.status import Status
from gso.tasks.base import Options, Request, Solution
from gso.tno import components
from gso.tno.job import Job
from gso.tno.judged import judged, requirements, warning
from gso.tno.layout import lay_out
from gso.tno.normalise import Canonical
from gso.tno.run import Run
from gso.tno.solver import Callback
from gso.tno.start import Start


@known_keywords()
def optimize(
    mesh: Any,
    *,
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    constraints: Sequence[Constraint] = (),
    max_deviation: float | None = None,
    max_strain: float | None = None,
    target_curvature: float | None = None,
    x0: Any = None,
    callback: Callback | None = None,
    verdict: bool = True,
) -> Result:
    """Make a surface developable, flatten it, denoise it, bend it, or map it to the plane.

    Each component of a mesh is solved on its own, in its own frame and with its own weights.
    Components that constraints join (glue, lengths, symmetry) are solved together, each with
    weights by its own size.

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, or path
        The design, in any unit of length.
    task : {"developable", "flatten", "denoise", "bend", "conformal"}
        What to do.
    formulation : str, optional
        Which energy; the task's first when not given.
    options : str or Options, optional
        "fast", "balanced" (default), "accurate", or an options dataclass of the task.
        "jiang2020" (`developable`, `flatten`) is the classical reference, by isometry.
    constraints : sequence of Constraint
        Constraints on the result: `Fixed`, `FixedBoundary`, `Handle`, `OnCurve`,
        `SlidingBoundary`, `Glue`, `SymmetryPlane`, `PlanarFaces`, `FixedLengths`. For
        `flatten` and `conformal` they apply to the flat image.
    max_deviation : float, optional
        `developable`: the largest distance between result and design, in both directions, in
        the mesh's unit. The result is as developable as this bound allows; by "ruled" it has as
        few strips as it allows.
    max_strain : float, optional
        `developable`: the largest principal strain, max ``|s - 1|``, of the result's flat
        pattern, such as 0.005. The displacement is the smallest that reaches it, or stays
        within `max_deviation` where that is given.
    target_curvature : float, optional
        `developable` by "curvature" only: the mean absolute curvature ``loss_gc_worst`` to
        reach within 5 %, with the smallest displacement. Its unit is 1/size^2, as in the
        metrics (size: the largest distance from the centroid). Each of several components
        reaches it by its own size.
    x0 : Mesh, array or Start, optional
        Warm start: vertices (n, 3) or a grid; (n, 2) or (H, W, 2) for a flat image.
        Proximity and lengths still refer to `mesh`. On grids, large-scale errors of the start
        are corrected on a coarser grid first. For `denoise` it replaces the smoothed surface.
        A :class:`gso.tno.Start` adds settings to it.
    callback : callable, optional
        Called with a :class:`gso.Progress` after each iteration; returning False stops
        the solve, and the best iterate so far is returned. Large meshes of several components
        are solved in worker processes: it is then called once for each finished component.
    verdict : bool
        Judge the result (:mod:`gso.verdict`) and, for `developable`, flatten it to measure its
        strain. False skips both, to save time.

    Returns
    -------
    Result

    Raises
    ------
    MeshError
        The input cannot be used.
    OptionError
        An option or constraint is unknown or contradictory.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> saddle = np.stack([u, v, 0.3 * u * v], axis=-1)
    >>> result = gso.tno.optimize(saddle)
    >>> result.metrics["loss_gc"] < result.metrics["loss_gc_before"]
    True

    References
    ----------
    Jiang et al. 2020, Quad-mesh based isometric mappings and developable surfaces.
    """
    clock = time.perf_counter()
    from gso.io import as_mesh

    design = as_mesh(mesh)
    design.check_joined()
    bounds = {
        "max_deviation": max_deviation,
        "max_strain": max_strain,
        "target_curvature": target_curvature,
    }
    module, chosen, settings = check(task, formulation, options, **bounds)
    given = x0 if isinstance(x0, Start) else Start(x0)
    flat = getattr(module, "BLOCK", "surface") == "flat"
    whole = Job(design, compile_constraints(constraints, design, flat=flat), given)
    asked = Asked(task, chosen, settings, bounds, formulation is not None, verdict)
    if given.iterations is not None and asked.bounded:
        module.check_iterations(bounds)
    one = partial(_solved, asked)
    pieces = components.parts(design, whole.constraints)
    if pieces and chosen == "ruled":
        raise MeshError(
            f"the formulation 'ruled' takes one surface, and this mesh has {len(pieces)} "
            "components: solve each on its own"
        )
    if pieces:
        result = components.solve(one, whole, pieces, callback)
    else:
        result = one(whole, callback)
    result.seconds["total"] = time.perf_counter() - clock
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=3)
    return result


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
    record_violations(compiled, frame, solution)
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


def record_violations(compiled: Compiled, frame: Canonical, solution: Solution) -> None:
    """Record the violation of each constraint, in the user's unit; note missed hard ones."""
    if not compiled.names:
        return
    unit = frame.frame.scale
    misses = compiled.violations(solution.blocks[compiled.block])
    lengths = {name: unit * miss.length for name, miss in misses.items()}
    solution.details = {**solution.details, "constraints": lengths}
    broken = [k for k, miss in misses.items() if miss.hard and not miss.length <= TIGHT]
    for name in broken:
        where = ", ".join(map(str, frame.names[misses[name].vertices]))
        solution.notes += (f"{name} is missed by {lengths[name]:.3g} (vertices {where})",)
    if broken and solution.status is not Status.CANCELLED:
        solution.status = Status.CONSTRAINTS_MISSED


def packed(
    task: str,
    formulation: str,
    design: Mesh,
    frame: Canonical,
    solution: Solution,
    run: Run,
) -> Result:
    """Convert a solution to a result in the user's frame and numbering."""
    # The numbering of a cut mesh begins with the user's.
    own = {"flat"} if solution.cut is not None else set()
    blocks = {k: x if k in own else frame.back(k, x) for k, x in solution.blocks.items()}
    flat = blocks["flat"] * frame.frame.scale if "flat" in blocks else None
    pattern = None
    if solution.cut is not None and flat is not None:
        pattern = Pattern(flat, solution.cut.mesh.faces, solution.cut.vertex, solution.cut.seams)
        flat = None
    if solution.status is Status.ALREADY_GOOD:
        mesh = design
    elif "surface" in blocks:
        mesh = design.replaced(frame.frame.to_user(blocks["surface"]))
    elif pattern is not None:
        mesh = pattern.mesh
    else:
        mesh = design.replaced(np.c_[flat, np.zeros(len(design.vertices))])
    seconds = run.timings.as_dict()
    ruled = None
    if solution.ruled is not None:
        seconds["strips"] = run.converting
        ruled = solution.ruled.transformed(
            frame.frame.to_user, frame.frame.scale, lambda rows: frame.back("surface", rows)
        )
        mesh, pattern = ruled.mesh, ruled.pattern
        flat = None if pattern.is_cut else pattern.flat
    spline, details = None, dict(solution.details)
    lengths = getattr(tasks.get(task), "LENGTHS", ())
    details |= {name: details[name] * frame.frame.scale for name in lengths if name in details}
    if solution.spline is not None:
        before = solution.fitted
        fitted = None if before is None else frame.frame.to_user(frame.back("surface", before))
        spline, said = describe_spline(frame.frame.to_user(solution.spline), mesh, design, fitted)
        details = {**details, "spline": said}
    return Result(
        task=task,
        formulation=formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        pattern=pattern,
        cell_scale=blocks["scale"][:, 0] if "scale" in blocks else None,
        status=solution.status,
        iterations=run.iterations,
        energy=solution.energy,
        history=run.history,
        seconds=seconds,
        backend=solution.backend,
        notes=design.notes + solution.notes,
        details=details,
        spline=spline,
        ruled=ruled,
    )
