"""From a mesh to a result: normalise, plan, solve the stages, give back in the user's frame."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso import tasks
from gso.constraints import TIGHT, Constraint
from gso.fit import describe_spline
from gso.mesh import Mesh
from gso.result import Result
from gso.status import ConvergenceWarning, OptionError, Status
from gso.tasks.base import Options, Request
from gso.tno import linear
from gso.tno.canonical import Canonical
from gso.tno.judged import asked_of, judged, warning
from gso.tno.run import Outcome, Run
from gso.tno.search import reach_target, stay_within
from gso.tno.solver import Callback
from gso.tno.start import Start

Array = NDArray[np.float64]


def optimize(
    mesh: Any,
    *,
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    constraints: Sequence[Constraint] = (),
    max_deviation: float | None = None,
    target_curvature: float | None = None,
    x0: Any = None,
    callback: Callback | None = None,
    verdict: bool = True,
) -> Result:
    """Make a surface developable, flatten it, denoise it, bend it, or map it to the plane.

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
        What the result must keep: `Fixed`, `FixedBoundary`, `Handle`, `OnCurve`,
        `SlidingBoundary`, `Glue`, `SymmetryPlane`, `PlanarFaces`, `FixedLengths`. For
        `flatten` and `conformal` they are about the flat image.
    max_deviation : float, optional
        `developable` by "curvature" only: no vertex of the result is farther than this from
        the design, in the mesh's unit; as developable as that allows.
    target_curvature : float, optional
        `developable` by "curvature" only: the mean absolute curvature ``loss_gc`` to reach, in
        1/size^2 as the metrics have it (size: the largest distance from the centroid), with
        the smallest displacement that does.
    x0 : Mesh, array or Start, optional
        Where to start: vertices (n, 3) or a grid; (n, 2) or (H, W, 2) for a flat image.
        Proximity and lengths stay those of `mesh`. On grids what is wrong with a surface
        at large is put right on a coarser grid first. For `denoise` it takes the place of the
        smoothed surface. A :class:`gso.tno.Start` says more about it.
    callback : callable, optional
        Called with a :class:`gso.Progress` after each iteration; returning False stops
        the solve, and the best iterate so far is returned.
    verdict : bool
        Judge the result (:mod:`gso.verdict`) and, where it is a developable surface, lay it out
        to measure its strain. Without it neither is done, which saves their time.

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
    module, formulation, settings = check(
        task, formulation, options, max_deviation, target_curvature
    )
    frame = Canonical(design)
    given = x0 if isinstance(x0, Start) else Start(x0)
    if target_curvature is not None and given.iterations is not None:
        raise OptionError(
            "target_curvature takes many solves, which the iterations of a start would cut off; "
            "leave one of them out"
        )
    flat = getattr(module, "BLOCK", "surface") == "flat"
    request = Request(
        frame.mesh,
        settings,
        formulation,
        frame.constraints(constraints, flat=flat),
        start=frame.start(given.points, flat=flat),
    )
    run = Run(
        module,
        callback,
        guarded=given.guarded,
        budget=given.iterations,
        tolerance=given.tolerance,
    )
    if max_deviation is not None:
        outcome = stay_within(run, request, max_deviation / frame.frame.scale)
    elif target_curvature is not None:
        outcome = reach_target(run, request, target_curvature)
    else:
        outcome = run(request)
    judge(request, frame, outcome)
    result = packed(task, formulation, design, frame, outcome, run)
    if run.refused:
        result.notes += (f"the start ({given.source}) was not used: {run.refused}",)
    elif given.points is not None:
        result.warm_start = given.source
    if verdict:
        limits = {"max_deviation": max_deviation, "target_curvature": target_curvature}
        result = judged(result, asked_of(request, frame.frame.scale, **limits))
    result.seconds["total"] = time.perf_counter() - clock
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=2)
    return result


def check(
    task: str,
    formulation: str | None = None,
    options: Any = None,
    max_deviation: float | None = None,
    target_curvature: float | None = None,
) -> tuple[ModuleType, str, Options]:
    """Check what can be checked before there is a mesh; arguments as for :func:`optimize`.

    Returns
    -------
    module, formulation, options
        The task's module, its formulation, its settings.

    Raises
    ------
    OptionError
        Something is unknown or contradictory.
    BackendError
        The backend that is asked for is not installed.
    """
    module = tasks.get(task)
    formulation, kind = tasks.choose(module, formulation, options)
    settings = kind.coerce(options)
    if settings.backend is not None:
        linear.find(settings.backend)
    for name, value in (("max_deviation", max_deviation), ("target_curvature", target_curvature)):
        if value is None:
            continue
        if task != "developable":
            raise OptionError(f"{name} belongs to task 'developable', not {task!r}")
        if formulation != "curvature":
            raise OptionError(f"{name} belongs to the formulation 'curvature', not {formulation!r}")
        if not (isinstance(value, int | float | np.number) and 0 < value < np.inf):
            raise OptionError(f"{name} is {value!r}; it must be a positive number")
    if max_deviation is not None and target_curvature is not None:
        raise OptionError("give max_deviation or target_curvature, not both")
    return module, formulation, settings


def judge(request: Request, frame: Canonical, outcome: Outcome) -> None:
    """Say how well the constraints are kept, in the user's unit, and which are not."""
    compiled = request.constraints
    if not compiled.names:
        return
    unit = frame.frame.scale
    misses = compiled.misses(outcome.blocks[compiled.block])
    lengths = {name: unit * miss.length for name, miss in misses.items()}
    outcome.details = {**outcome.details, "constraints": lengths}
    broken = [k for k, miss in misses.items() if miss.hard and not miss.length <= TIGHT]
    for name in broken:
        where = ", ".join(map(str, frame.order[misses[name].vertices]))
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
    """An outcome in the user's frame and numbering."""
    blocks = {name: frame.back(name, values) for name, values in outcome.blocks.items()}
    flat = blocks["flat"] * frame.frame.scale if "flat" in blocks else None
    if outcome.status is Status.ALREADY_GOOD:
        mesh = design
    elif "surface" in blocks:
        mesh = design.replaced(frame.frame.to_user(blocks["surface"]))
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
