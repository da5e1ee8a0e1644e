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
from gso.constraints import Constraint, compile_constraints
from gso.errors import ConvergenceWarning, MeshError, OptionError
from gso.mesh import Mesh
from gso.result import Result
from gso.seams import Pieces
from gso.spelling import known_keywords
from gso.tasks.base import Options, Request
from gso.tno import components, joint, joint_bounds, ruled_pieces
from gso.tno.job import Job
from gso.tno.judged import judged, requirements, warning
from gso.tno.layout import lay_out
from gso.tno.normalise import Canonical
from gso.tno.packed import packed, record_violations
from gso.tno.run import Run
from gso.tno.solver import Callback
from gso.tno.start import Start
from gso.verdict import Asked as Requirements


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
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, path, or Pieces
        The design, in any unit of length. A design that :func:`gso.cut` or :func:`gso.pieces` has
        cut into pieces is solved as a whole: each piece becomes developable, the seams stay
        closed, and may become creases. The result's `pieces` has its pieces. By "ruled" each
        piece then becomes strips that follow that result: their seams are closed up to the
        distance in ``details["seam_gap"]``.
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
    bounds = {
        "max_deviation": max_deviation,
        "max_strain": max_strain,
        "target_curvature": target_curvature,
    }
    module, chosen, settings = check(task, formulation, options, **bounds)
    given = x0 if isinstance(x0, Start) else Start(x0)
    if isinstance(mesh, Pieces) and not isinstance(options, Options):
        settings = settings.for_pieces()
    asked = Asked(task, chosen, settings, bounds, formulation is not None, verdict)
    if given.iterations is not None and asked.bounded:
        module.check_iterations(bounds)
    if isinstance(mesh, Pieces) and chosen == "ruled":
        ask = ruled_pieces.Ask(settings, max_deviation, verdict)
        result = ruled_pieces.solved(mesh, ask, constraints, given, callback, optimize)
    elif isinstance(mesh, Pieces):
        result = _in_pieces(mesh, asked, constraints, given, callback)
    else:
        from gso.io import as_mesh

        design = as_mesh(mesh)
        design.check_joined()
        result = _one_mesh(asked, callback, design, constraints, given)
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


def _in_pieces(
    pieces: Pieces,
    asked: Asked,
    constraints: Sequence[Constraint],
    start: Start,
    callback: Callback | None,
) -> Result:
    """Solve a design in pieces, within a distance of it where one is given."""

    def solve(what: Asked) -> Result:
        one = partial(_one_mesh, what, callback)
        return joint.solved(pieces, what.task, constraints, start, one)

    allowed = asked.bounds["max_deviation"]
    if allowed is None:
        return solve(asked)
    bounds = {**asked.bounds, "max_deviation": None}
    free = replace(asked, bounds=bounds, verdict=False)
    result = solve(free) if free.bounded else None
    # A bound on strain or curvature is met with the least displacement, which may be too much.
    if result is None or joint_bounds.deviation(pieces, result) > allowed:
        free = replace(free, bounds=dict.fromkeys(bounds))
        result = joint_bounds.within(
            pieces, allowed, asked.options, lambda options: solve(replace(free, options=options))
        )
    if asked.verdict:
        limits: dict[str, Any] = dict(asked.bounds)
        result = judged(result, Requirements(**limits))
    return result


def _one_mesh(
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
    parts = components.parts(design, whole.constraints)
    if parts and asked.formulation == "ruled":
        raise MeshError(
            f"the formulation 'ruled' takes one surface, and this mesh has {len(parts)} "
            "components: solve each on its own"
        )
    if parts:
        return components.solve(one, whole, parts, callback)
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
