"""The public solve of one design."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace

from gso import linalg
from gso.constraints import Constraint
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, OptionError
from gso.pipeline.component_solves import solve_mesh
from gso.pipeline.judgement import warning
from gso.quantities import Length, Strain
from gso.result import Result
from gso.ruled.paneling.options import RULED
from gso.ruled.paneling.options import Options as StripsOptions
from gso.ruled.paneling.strips_request import StripsRequest
from gso.seams import joint_solve
from gso.solver import Callback
from gso.tasks import request as requests
from gso.tasks.base import Options
from gso.tasks.request import OwnTerms, Request, checked_terms
from gso.tasks.start import Start
from gso.typing import MeshLike

_log = logging.getLogger("gso")


def optimize(
    mesh: MeshLike | Pieces,
    *,
    task: str = "developable",
    formulation: str | None = None,
    options: str | Options | None = None,
    constraints: Sequence[Constraint] = (),
    max_deviation: Length | None = None,
    max_strain: Strain | None = None,
    target_curvature: float | None = None,
    unit: str = "mm",
    x0: MeshLike | Start | None = None,
    callback: Callback | None = None,
    terms: Sequence[OwnTerms] = (),
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
        closed, and may become creases. The result's `pieces` has its pieces.
    task : {"developable", "flatten", "denoise", "bend", "conformal"}
        What to do.
    formulation : str, optional
        Which energy; the task's first when not given. `developable` by "ruled" is
        :func:`gso.strips`.
    options : str or Options, optional
        "fast", "balanced" (default), "accurate", or an options dataclass of the task.
        "jiang2020" (`developable`, `flatten`) is the classical reference, by isometry.
    constraints : sequence of Constraint
        Constraints on the result: `Fixed`, `FixedBoundary`, `Handle`, `OnCurve`,
        `SlidingBoundary`, `Glue`, `SymmetryPlane`, `PlanarFaces`, `FixedLengths`. For
        `flatten` and `conformal` they apply to the flat image.
    max_deviation : float or str, optional
        `developable`: the largest distance between design and result, both ways: a number in the
        mesh's unit, or a text such as "5mm" or "0.5%" (of the diagonal of the bounding box). The
        result is as developable as this bound allows.
    max_strain : float or str, optional
        `developable`: the largest principal strain, max ``|s - 1|``, of the result's flat
        pattern, such as 0.005 or "0.5%". The displacement is the smallest that reaches it, or stays
        within `max_deviation` where that is given.
    target_curvature : float, optional
        `developable` by "curvature" only: the mean absolute curvature ``loss_gc_worst`` to
        reach within 5 %, with the smallest displacement. Its unit is 1/size^2, as in the
        metrics (size: the largest distance from the centroid). Each of several components
        reaches it by its own size.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates, for lengths that are texts.
    x0 : Mesh, array or Start, optional
        Warm start: vertices (n, 3) or a grid; (n, 2) or (H, W, 2) for a flat image.
        Proximity and lengths still refer to `mesh`. On grids, large-scale errors of the start
        are corrected on a coarser grid first. For `denoise` it replaces the smoothed surface.
        A :class:`gso.tno.Start` adds settings to it.
    callback : callable, optional
        Called with a :class:`gso.Progress` after each iteration; returning False stops
        the solve, and the best iterate so far is returned. Large meshes of several components
        are solved in worker processes: it is then called once for each finished component.
    terms : sequence of callable
        Terms of your own, which join the objective: each callable returns a list of
        :class:`gso.energy.Weighted` for a :class:`gso.Mesh`. It is called for the design, and for
        each coarser copy that is solved first; these meshes are in the unit ball, grids numbered
        row by row. `developable` by "curvature", and `flatten`. See ``docs/extending.rst``.
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

    design = mesh.design if isinstance(mesh, Pieces) else as_mesh(mesh)
    request = check(
        task,
        formulation,
        options,
        max_deviation=max_deviation,
        max_strain=max_strain,
        target_curvature=target_curvature,
        x0=x0,
        terms=terms,
        verdict=verdict,
        diagonal=design.diagonal,
        unit=unit,
    )
    settings = request.options
    if isinstance(settings, StripsOptions):
        # Imported here, as it imports SciPy.
        from gso.ruled.paneling.lay_strips import lay_strips

        wanted = StripsRequest(
            settings,
            request.limits,
            constraints=constraints,
            start=request.start,
            verdict=verdict,
            callback=callback,
        )
        result = lay_strips(mesh, wanted)
    elif isinstance(mesh, Pieces):
        checked_terms(terms, "a design cut into pieces")
        if not isinstance(options, Options):
            request = request.with_options(settings.for_pieces())
        result = joint_solve.solve_pieces(mesh, request, constraints, callback)
    else:
        design.check_joined()
        result = solve_mesh(request, design, constraints, callback)
    spent = result.seconds["total"] = time.perf_counter() - clock
    what = f"{result.task} by {result.formulation!r}"
    _log.info("%s: %d iterations in %.3g s, %s", what, result.iterations, spent, result.status)
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=2)
    return result


def check(
    task: str,
    formulation: str | None = None,
    options: str | Options | None = None,
    *,
    max_deviation: Length | None = None,
    max_strain: Strain | None = None,
    target_curvature: float | None = None,
    x0: MeshLike | Start | None = None,
    terms: Sequence[OwnTerms] = (),
    verdict: bool = True,
    diagonal: float = 1.0,
    unit: str = "mm",
) -> Request[Options]:
    """Check what :func:`optimize` is asked for, as far as it does not depend on the mesh.

    Parameters, result and errors are those of :func:`gso.tasks.request.check`; ``"ruled"`` stands
    for strips, with their own settings.
    """
    strips = formulation == RULED or (formulation is None and isinstance(options, StripsOptions))
    strips &= task == "developable"
    if strips:
        checked_terms(terms, f"formulation {RULED!r} of task 'developable'")
    request = requests.check(
        task,
        None if strips else formulation,
        None if strips else options,
        max_deviation=max_deviation,
        max_strain=max_strain,
        target_curvature=target_curvature,
        x0=x0,
        terms=terms,
        verdict=verdict,
        diagonal=diagonal,
        unit=unit,
    )
    if not strips:
        return request
    if target_curvature is not None:
        raise OptionError(f"target_curvature belongs to the formulation 'curvature', not {RULED!r}")
    settings = StripsOptions.coerce(options)
    if settings.backend is not None:
        linalg.find(settings.backend)
    return replace(request.with_options(settings), formulation=RULED)
