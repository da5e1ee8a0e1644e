"""The solve of a mesh: normalise, plan, solve the stages, return to the user's frame."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from gso import linalg, parametrization, tasks
from gso.components import several
from gso.constraints import TIGHT, Constraint, compile_constraints
from gso.errors import ConvergenceWarning, OptionError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.result import Result
from gso.spelling import known_keywords
from gso.spline.fit import describe_spline
from gso.status import Status
from gso.tasks.base import Options, Request
from gso.tno import components
from gso.tno.job import Job
from gso.tno.judged import asked_of, judged, warning
from gso.tno.normalise import Canonical
from gso.tno.run import Outcome, Run
from gso.tno.search import of_curvature, of_strain, reach, stay_within, strain_left
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
        the mesh's unit. The result is as developable as this bound allows.
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

    design, given_formulation = as_mesh(mesh), formulation
    design.check_joined()
    module, formulation, settings = check(
        task, formulation, options, max_deviation, target_curvature, max_strain
    )
    given = x0 if isinstance(x0, Start) else Start(x0)
    if given.iterations is not None:
        for name, value in (("target_curvature", target_curvature), ("max_strain", max_strain)):
            if value is not None:
                raise OptionError(
                    f"{name} takes many solves, which the iterations of a start would cut off; "
                    "leave one of them out"
                )
    flat = getattr(module, "BLOCK", "surface") == "flat"
    whole = Job(design, compile_constraints(constraints, design, flat=flat), given)
    wanted = {
        "max_deviation": max_deviation,
        "max_strain": max_strain,
        "target_curvature": target_curvature,
    }
    one = partial(_solved, task, formulation, given_formulation, settings, wanted, verdict)
    pieces = components.parts(design, whole.constraints)
    if pieces:
        result = components.solve(one, whole, pieces, callback)
    else:
        result = one(whole, callback)
    result.seconds["total"] = time.perf_counter() - clock
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=3)
    return result


def _solved(
    task: str,
    formulation: str,
    given_formulation: str | None,
    settings: Options,
    wanted: dict[str, float | None],
    verdict: bool,
    job: Job,
    callback: Callback | None,
) -> Result:
    """Solve one job: a single component, or several that constraints join."""
    module, given = tasks.get(task), job.start
    frame = Canonical(job.design, job.names)
    flat = job.constraints.flat
    request = Request(
        frame.mesh,
        settings,
        formulation,
        frame.constraints(job.constraints, flat=flat),
        start=frame.start(given.points, flat=flat),
    )
    run = Run(
        module,
        callback,
        guarded=given.guarded,
        budget=given.iterations,
        tolerance=given.tolerance,
    )
    bound = wanted["max_deviation"]
    outcome, request = _searched(
        run,
        request,
        None if bound is None else bound / frame.frame.scale,
        wanted["max_strain"],
        wanted["target_curvature"],
        others=others(request, given_formulation),
    )
    formulation = request.formulation
    judge(request, frame, outcome)
    result = packed(task, formulation, job.design, frame, outcome, run)
    if several(job.design):
        result.notes += ("its components are joined by constraints and solved together",)
    if run.refused:
        result.notes += (f"the start ({given.source}) was not used: {run.refused}",)
    elif given.points is not None:
        result.warm_start = given.source
    if verdict:
        result = judged(result, asked_of(request, frame.frame.scale, **wanted))
    return result


def _searched(
    run: Run,
    request: Request,
    bound: float | None,
    max_strain: float | None,
    target_curvature: float | None,
    *,
    others: Sequence[Request],
) -> tuple[Outcome, Request]:
    """Solve once, or search for the given bounds; return the outcome and its request.

    If a bound on distance or strain is missed, the other formulations are tried too.
    """
    if target_curvature is not None:
        return reach(run, request, of_curvature(request, target_curvature))[0], request
    if bound is None and max_strain is None:
        return run(request), request
    best: Any = None
    least, chosen = np.inf, request
    for asked in (request, *others):
        if bound is not None:
            outcome, met = stay_within(run, asked, bound, max_strain)
        else:
            outcome, met = reach(run, asked, of_strain(asked, max_strain))  # type: ignore[arg-type]
        if best is not None or not met:
            value = strain_left(asked, outcome)
        if best is None or met or value < least:
            best, chosen = outcome, asked
        if met:
            break
        least = min(least, value)
    return best, chosen


def others(request: Request, formulation: str | None) -> list[Request]:
    """Return a request for "isometry", if the user named no formulation and it is applicable.

    It is for meshes that can be flattened, without hard constraints, B-splines or options of
    another formulation than "curvature".
    """
    kind = tasks.get("developable").OPTIONS
    usual = type(request.options) is kind["curvature"] and request.options.variables != "surface"
    hard = any(part.hard for part in request.constraints.parts)
    if formulation is not None or not usual or hard or not parametrization.flattens(request.mesh):
        return []
    return [replace(request, formulation="isometry", options=kind["isometry"](), start=None)]


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
        if task != "developable":
            raise OptionError(f"{name} belongs to task 'developable', not {task!r}")
        if name == "target_curvature" and formulation != "curvature":
            raise OptionError(f"{name} belongs to the formulation 'curvature', not {formulation!r}")
        if not (isinstance(value, int | float | np.number) and 0 < value < np.inf):
            raise OptionError(f"{name} is {value!r}; it must be a positive number")
    if target_curvature is not None:
        for name in ("max_deviation", "max_strain"):
            if bounds[name] is not None:
                raise OptionError(f"give {name} or target_curvature, not both")
    return module, formulation, settings


def judge(request: Request, frame: Canonical, outcome: Outcome) -> None:
    """Record the violation of each constraint, in the user's unit; note missed hard ones."""
    compiled = request.constraints
    if not compiled.names:
        return
    unit = frame.frame.scale
    misses = compiled.misses(outcome.blocks[compiled.block])
    lengths = {name: unit * miss.length for name, miss in misses.items()}
    outcome.details = {**outcome.details, "constraints": lengths}
    broken = [k for k, miss in misses.items() if miss.hard and not miss.length <= TIGHT]
    for name in broken:
        where = ", ".join(map(str, frame.names[misses[name].vertices]))
        outcome.notes += (f"{name} is missed by {lengths[name]:.3g} (vertices {where})",)
    if broken and outcome.status is not Status.CANCELLED:
        outcome.status = Status.CONSTRAINTS_MISSED


def packed(
    task: str,
    formulation: str,
    design: Mesh,
    frame: Canonical,
    outcome: Outcome,
    run: Run,
) -> Result:
    """Convert an outcome to a result in the user's frame and numbering."""
    # The numbering of a cut mesh begins with the user's.
    own = {"flat"} if outcome.cut is not None else set()
    blocks = {k: x if k in own else frame.back(k, x) for k, x in outcome.blocks.items()}
    flat = blocks["flat"] * frame.frame.scale if "flat" in blocks else None
    pattern = None
    if outcome.cut is not None and flat is not None:
        pattern = Pattern(flat, outcome.cut.mesh.faces, outcome.cut.vertex, outcome.cut.seams)
        flat = None
    if outcome.status is Status.ALREADY_GOOD:
        mesh = design
    elif "surface" in blocks:
        mesh = design.replaced(frame.frame.to_user(blocks["surface"]))
    elif pattern is not None:
        mesh = pattern.mesh
    else:
        mesh = design.replaced(np.c_[flat, np.zeros(len(design.vertices))])
    seconds = run.timings.as_dict()
    spline, details = None, dict(outcome.details)
    lengths = getattr(tasks.get(task), "LENGTHS", ())
    details |= {name: details[name] * frame.frame.scale for name in lengths if name in details}
    if outcome.spline is not None:
        before = outcome.fitted.get("surface")
        fitted = None if before is None else frame.frame.to_user(frame.back("surface", before))
        spline, said = describe_spline(mesh, outcome.spline, design, fitted)
        details = {**details, "spline": said}
    return Result(
        task=task,
        formulation=formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        pattern=pattern,
        cell_scale=blocks["scale"][:, 0] if "scale" in blocks else None,
        status=outcome.status,
        iterations=run.iterations,
        energy=outcome.energy,
        history=run.history,
        seconds=seconds,
        backend=outcome.backend,
        notes=design.notes + outcome.notes,
        details=details,
        spline=spline,
    )
