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
from gso.constraints import Constraint, compile_constraints
from gso.mesh import Mesh
from gso.result import Result
from gso.status import ConvergenceWarning, OptionError, Status
from gso.tasks.base import Options, Request
from gso.tno import linear
from gso.tno.canonical import Canonical
from gso.tno.run import Outcome, Run
from gso.tno.search import reach_target, stay_within
from gso.tno.solver import Callback

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
) -> Result:
    """Make a surface developable, flatten it, or denoise it.

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, or path
        The design, in any unit of length.
    task : {"developable", "flatten", "denoise"}
        What to do.
    formulation : str, optional
        Which energy; the task's first when not given.
    options : str or Options, optional
        "fast", "balanced" (default), "accurate", or the task's options dataclass.
    constraints : sequence of Fixed, FixedBoundary, Handle
        What the result must keep.
    max_deviation : float, optional
        `developable` only: no vertex of the result is farther than this from the design,
        in the mesh's unit; as developable as that allows.
    target_curvature : float, optional
        `developable` only: the mean absolute curvature ``loss_gc`` to reach, with the
        smallest displacement that does.
    x0 : Mesh or array, optional
        Where to start: vertices (n, 3) or a grid; (n, 2) or (H, W, 2) for `flatten`.
        Proximity and lengths stay those of `mesh`.
    callback : callable, optional
        Called with a :class:`gso.Progress` after each iteration; returning False stops
        the solve, and the best iterate so far is returned.

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
    request = Request(
        frame.mesh,
        settings,
        formulation,
        compile_constraints(constraints, design).mapped(frame.frame.to_unit, frame.new_index),
        start=frame.start(x0, flat=task == "flatten"),
    )
    run = Run(module, callback)
    if max_deviation is not None:
        outcome = stay_within(run, request, max_deviation / frame.frame.scale)
    elif target_curvature is not None:
        outcome = reach_target(run, request, target_curvature)
    else:
        outcome = run(request)
    result = _result(task, formulation, design, frame, outcome, run)
    result.warm_start = "cold" if x0 is None else "x0"
    result.seconds["total"] = time.perf_counter() - clock
    if not result.converged and result.status is not Status.MAX_ITERATIONS:
        warnings.warn(str(result.status), ConvergenceWarning, stacklevel=2)
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
    formulation = formulation or module.FORMULATIONS[0]
    if formulation not in module.FORMULATIONS:
        raise OptionError(
            f"task {task!r} has no formulation {formulation!r}; "
            f"there are {', '.join(module.FORMULATIONS)}"
        )
    settings = module.Options.coerce(options)
    if settings.backend is not None:
        linear.find(settings.backend)
    for name, value in (("max_deviation", max_deviation), ("target_curvature", target_curvature)):
        if value is None:
            continue
        if task != "developable":
            raise OptionError(f"{name} belongs to task 'developable', not {task!r}")
        if not (isinstance(value, int | float | np.number) and 0 < value < np.inf):
            raise OptionError(f"{name} is {value!r}; it must be a positive number")
    if max_deviation is not None and target_curvature is not None:
        raise OptionError("give max_deviation or target_curvature, not both")
    return module, formulation, settings


def _result(
    task: str,
    formulation: str,
    design: Mesh,
    frame: Canonical,
    outcome: Outcome,
    run: Run,
) -> Result:
    blocks = {name: frame.back(values) for name, values in outcome.blocks.items()}
    flat = blocks["flat"] * frame.frame.scale if "flat" in blocks else None
    if outcome.status is Status.ALREADY_GOOD:
        mesh = design
    elif "surface" in blocks:
        mesh = design.replaced(frame.frame.to_user(blocks["surface"]))
    else:
        mesh = design.replaced(np.c_[flat, np.zeros(len(design.vertices))])
    seconds = run.timings.as_dict()
    return Result(
        task=task,
        formulation=formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        status=outcome.status,
        iterations=run.iterations,
        energy=outcome.energy,
        history=run.history,
        seconds=seconds,
        backend=outcome.backend,
        notes=design.notes + outcome.notes,
        details=outcome.details,
    )
