"""Hybrid solves in one call: the net predicts, the optimiser checks and refines."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from gso import parametrization, tasks
from gso.components import Component, several
from gso.constraints import Compiled, compile_constraints, listed
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, GSOError, MeshError, OptionError
from gso.executors import Executor, Item, open_executor
from gso.hybrid.plain_solve import (
    LARGE,
    checked_request,
    large_grid,
    plain_options,
    without_gain,
)
from gso.hybrid.time_model import net_saves_time
from gso.hybrid.two_starts import better_start
from gso.hybrid.warm_start import Prediction, predictions
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.net.catalogue import SIZE, NetLike
from gso.pattern import Pattern
from gso.pipeline import component_solves
from gso.pipeline.case import Case
from gso.pipeline.normalise import Canonical
from gso.quantities import as_length, as_positive
from gso.result import Result
from gso.status import Progress, Status
from gso.tno import Start, check, optimize
from gso.typing import Array, Keywords, MeshLike

#: Surfaces that are read and predicted together.
_BATCH = 64
#: Whether a net is to be used for a design.
Worth: TypeAlias = "Callable[[Mesh], bool]"
#: Notes on results that do not begin with the net's.
_LOST = "the design's own minimum on a coarse grid is lower than that from the net's result"
_TOO_FAR = "solved without a net: on a coarse grid its minimum is too far from the design"
#: Shares of the energy that are left to further iterations: with less than the effort of a cold
#: solve, and with the same.
LEFT = (3.5e-3, 3e-4)
#: Relative energy decrease of an iteration at which other solves from a net's result stop.
NEARLY = 3e-3


def solve(
    mesh: MeshLike | Pieces,
    *,
    task: str = "developable",
    net: NetLike | None = None,
    polish: bool | int = True,
    sparing: bool = False,
    effort: float = 0.5,
    **keywords: Any,
) -> Result:
    """Solve from a warm start that a net predicts.

    The net runs at its own size, and its displacements are carried to the design's grid. Large
    grids with free vertices, or with `effort` from 1 on, are first solved at the net's size, from
    the design and from the net's result; the lower minimum of the two is refined.

    The solve is a cold start, the same as :func:`gso.tno.optimize`, in these cases:

    - No net is available: none for the task, or PyTorch is not installed, or, for an exported net
      (a .onnx file), ONNX Runtime. Warm starts of the task
      "flatten" were not found to help.
    - The design is no grid: warm starts of other meshes were not found to help. It is small,
      developable as it is, or has far more curvature than the training data.
    - The design is cut into pieces, or `max_deviation` or the formulation "ruled" is asked for:
      warm starts were not found to help there.
    - The net's result is not finite, or has a higher energy than the cold start.

    Grids with 256 vertices or more along a side are solved without a net, too, where offsets along
    normals are the unknowns and `effort` is below 1. They end early, as `effort` says, and a net
    would take longer. The result's `notes` say so in all cases, and its `warm_start` is "cold".

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, path, or Pieces
        The design. With ``polish=False`` nets take components with a boundary and without
        handles, too: these are resampled to a grid, and the displacement is interpolated back.
    task : str
        As for :func:`gso.tno.optimize`; nets make starts for "developable". Those for "flatten"
        and "denoise" are used only with ``polish=False``.
    net : str, path or net, optional
        As `model` of :func:`gso.net.predict`. When not given, it is the task's net for warm
        starts ("developable-start") if `polish` is True, and otherwise the task's default.
    polish : bool or int
        True: solve from the net's result, as `effort` says. A number: at most so many
        iterations, with or without a net.
        False: the net's result without iterations, whatever its energy; it is still measured,
        and hard constraints and `max_deviation` are enforced. `target_curvature` and
        `max_strain` take many solves, and need True.
    sparing : bool
        Use the net only where it was found to save time: on large grids, by the formulation
        "curvature". Elsewhere the result is that of :func:`gso.tno.optimize`.
    effort : float
        Time to aim for, relative to a cold solve, by the formulation "curvature" without limits
        and constraints. Below 1 a solve from a net's result ends when further iterations are
        expected to lower the energy by less than 0.35 % of it. From 1 on these are 0.03 %, and the
        start is corrected for longer: that takes about the time of a cold solve, and the median
        energy is between 0.1 % more and 0.3 % less, the lower the larger the grid.
    **keywords
        Passed to :func:`gso.tno.optimize`: `formulation`, `options`, `constraints`,
        `max_deviation`, `max_strain`, `target_curvature`, `unit`, `callback`, `terms`, `verdict`.

    Returns
    -------
    Result
        Its `warm_start` is "net" or "cold", `seconds` has an entry "net", and `details` the
        name of the "net".

    Raises
    ------
    MeshError
        The input cannot be used.
    OptionError
        An option is unknown or contradictory, or the net is for another task.
    WeightsError
        The net that is named does not exist, or its file is damaged.

    Examples
    --------
    >>> import gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> result = solve(np.stack([u, v, 0.3 * u * v], axis=-1), polish=3)
    >>> result.warm_start in ("net", "cold"), result.usable
    (True, True)
    """
    clock = time.perf_counter()
    polish = _checked(task, polish, keywords)
    effort = as_positive(effort, "effort")
    design = mesh if isinstance(mesh, Pieces) else as_mesh(mesh)
    why = _without_gain(design, task, polish, effort, keywords)
    if isinstance(design, Pieces) or why:
        refused = Prediction(refused="" if sparing else why)
        return _finished(design, refused, task, polish, effort, keywords)
    design.check_joined()
    worth = partial(net_saves_time, task=task, keywords=keywords, net=net) if sparing else None
    pieces = _pieces(design, task, worth, keywords)
    if pieces:
        further = {"net": net, "polish": polish, "effort": effort}
        result = _each(design, pieces, task, keywords | further)
        result.seconds["total"] = time.perf_counter() - clock
        return result
    prediction = Prediction()
    if worth is None or worth(design):
        (prediction,) = predictions([design], task=task, net=net, polish=polish)
    result = _finished(design, prediction, task, polish, effort, keywords)
    result.seconds["total"] = time.perf_counter() - clock
    return result


def solve_many(
    meshes: Iterable[MeshLike | Pieces],
    *,
    task: str = "developable",
    net: NetLike | None = None,
    polish: bool | int = True,
    sparing: bool = False,
    effort: float = 0.5,
    workers: int | None = None,
    scheduler: str | None = None,
    executor: Executor | None = None,
    **keywords: Any,
) -> Iterator[Item[Result]]:
    """Solve many surfaces: predictions in batches, then :func:`solve` in parallel processes.

    Parameters
    ----------
    meshes : iterable
        Anything :func:`solve` takes; read in blocks, so that a generator of any length fits.
    task, net, polish, sparing, effort, **keywords
        As for :func:`solve`; a `callback` is ignored. Worker processes need the functions of
        `terms` at the top level of a module.
    workers : int, optional
        Number of worker processes; the number of cores when not given, 0 to solve in this one.
    scheduler : str, optional
        Address of a Dask scheduler whose workers solve instead; predictions are made here.
    executor : Executor, optional
        Solves instead, and stays open for other calls: :class:`gso.executors.ProcessExecutor`.

    Yields
    ------
    Item
        In the order of completion; `index` says which input it belongs to. A surface that
        fails is reported in `error` and does not end the batch.

    Examples
    --------
    >>> flat = np.dstack([*np.mgrid[:4.0, :4.0], np.zeros((4, 4))])
    >>> [item.index for item in solve_many([flat], workers=0)]
    [0]
    """
    keywords.pop("callback", None)
    polish = _checked(task, polish, keywords)
    effort = as_positive(effort, "effort")
    work = partial(_one, task, polish, effort, keywords)
    worth: Worth | None = None
    if sparing:
        worth = partial(net_saves_time, task=task, keywords=keywords, net=net, many=True)
    ask = partial(predictions, task=task, net=net, polish=polish)
    refuse = partial(_without_gain, task=task, polish=polish, effort=effort, keywords=keywords)
    started = _started(meshes, refuse, worth, ask)
    own = nullcontext(executor) if executor else open_executor(workers, scheduler, main=True)
    with own as ready:
        ready.check_sent("terms", keywords.get("terms", ()))
        yield from ready.as_completed(work, started)


def _pieces(design: Mesh, task: str, worth: Worth | None, keywords: Keywords) -> list[Component]:
    """Return the components that are predicted one by one; none for the design as a whole."""
    if not several(design):
        return []
    flat = tasks.get(task).flat
    compiled = compile_constraints(keywords["constraints"], design, flat=flat)
    pieces = component_solves.parts(design, compiled)
    if worth is not None and not any(worth(piece.mesh) for piece in pieces):
        return []
    keywords["constraints"] = compiled
    return pieces


def _each(design: Mesh, pieces: list[Component], task: str, keywords: Keywords) -> Result:
    """Solve every component from its own prediction, where there is one."""
    callback, compiled = keywords.pop("callback", None), keywords.pop("constraints")
    far, unit = keywords.get("max_deviation"), keywords.pop("unit", "mm")
    if far is not None:
        # A share is of the whole design's diagonal.
        size = design.diagonal
        keywords["max_deviation"] = as_length(far, "max_deviation", diagonal=size, unit=unit)

    def one(case: Case, told: Callable[[Progress], object] | None) -> Result:
        kept = () if case.constraints.empty else case.constraints
        return solve(case.design, task=task, constraints=kept, callback=told, **keywords)

    whole = Case(check(task), design, compiled)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        result = component_solves.solve_components(one, whole, pieces, callback, workers=0)
    if not result.converged and result.status is not Status.MAX_ITERATIONS:
        warnings.warn(str(result.status), ConvergenceWarning, stacklevel=3)
    return result


@dataclass(frozen=True)
class _Started:
    """A design, or the error on reading it, with its prediction."""

    design: Mesh | Pieces | GSOError
    prediction: Prediction


def _started(
    meshes: Iterable[MeshLike | Pieces],
    refuse: Callable[[Mesh | Pieces], str],
    worth: Worth | None,
    ask: Callable[[list[Mesh]], list[Prediction]],
) -> Iterator[_Started]:
    """Read designs block by block, and predict those for which `worth` is true.

    Without it, those are predicted that `refuse` names no reason against.
    """
    source = iter(meshes)
    while block := list(islice(source, _BATCH)):
        read = [_read(mesh) for mesh in block]
        why = ["" if isinstance(d, GSOError) else refuse(d) for d in read]
        chosen = {
            k: d
            for k, d in enumerate(read)
            if isinstance(d, Mesh) and not why[k] and (worth is None or worth(d))
        }
        found = dict(zip(chosen, ask(list(chosen.values())), strict=True))
        for k, design in enumerate(read):
            refused = Prediction(refused="" if worth else why[k])
            yield _Started(design, found.get(k, refused))


def _without_gain(
    design: Mesh | Pieces, task: str, polish: bool | int, effort: float, keywords: Keywords
) -> str:
    """Say why no net is used, whatever the design's shape; empty if one may be.

    Where the net's result itself is wanted, only pieces are a reason against it.
    """
    if polish is False and isinstance(design, Mesh):
        return ""
    why = without_gain(design, task, keywords)
    if not why and _ends_early(design, task, polish, effort, keywords):
        why = f"with {LARGE} vertices along a side or more, nets were not found to help"
    return why


def _ends_early(
    design: Mesh | Pieces, task: str, polish: bool | int, effort: float, keywords: Keywords
) -> bool:
    """Return whether a cold solve that ends early is faster than one from a net's result."""
    if polish is not True or effort >= 1.0 or isinstance(design, Pieces):
        return False
    return large_grid(design, task, keywords)


def _read(mesh: MeshLike | Pieces) -> Mesh | Pieces | GSOError:
    try:
        return mesh if isinstance(mesh, Pieces) else as_mesh(mesh)
    except GSOError as error:
        return error


def _one(
    task: str, polish: bool | int, effort: float, keywords: Keywords, started: _Started
) -> Result:
    if isinstance(started.design, GSOError):
        raise started.design
    result = _finished(started.design, started.prediction, task, polish, effort, keywords)
    result.metrics  # noqa: B018 - computed here, in the worker process
    return result


def _checked(task: str, polish: bool | int, keywords: Keywords) -> bool | int:
    """Check the arguments that need no mesh, make the constraints a list, return `polish`."""
    if not isinstance(polish, bool | np.bool_ | int | np.integer) or polish < 0:
        raise OptionError(f"polish is {polish!r}; take True, False, or a number of iterations")
    signature(optimize).bind(None, **keywords)
    if "x0" in keywords:
        raise OptionError("the net makes the start; for one of your own call gso.tno.optimize")
    checked_request(task, keywords)
    polish = bool(polish) if isinstance(polish, bool | np.bool_) else int(polish)
    for name in ("max_strain", "target_curvature"):
        if polish is not True and keywords.get(name) is not None:
            raise OptionError(
                f"{name} takes many solves: it needs the optimiser, without a limit of "
                f"iterations; leave it out, or polish={polish!r} (a net alone)"
            )
    given = keywords.get("constraints", ())
    keywords["constraints"] = given if isinstance(given, Compiled) else listed(given)
    return polish


def _finished(
    design: Mesh | Pieces,
    prediction: Prediction,
    task: str,
    polish: bool | int,
    effort: float,
    keywords: Keywords,
) -> Result:
    """Solve from a prediction if it is valid, else from a cold start."""
    refused, result = prediction.refused, None
    if prediction.points is not None and isinstance(design, Mesh):
        try:
            refused = _unsound(design, prediction.points)
            if not refused:
                start = _start(design, prediction.points, task, polish, effort, keywords)
                result = optimize(design, task=task, x0=start, **keywords)
                if start.points is None:
                    result.notes += (_TOO_FAR,)
                elif start.source == "cold":
                    result.notes += (_LOST,)
                flat = prediction.points.shape[1] == 2 and result.warm_start == "net"
                if flat and not keywords["constraints"]:
                    _place(result)
        except MeshError as error:
            # The start may have no area. An error in the design is raised again below.
            refused = str(error)
    if result is None:
        most = None if isinstance(polish, bool) else polish
        early = bool(refused) and _ends_early(design, task, polish, effort, keywords)
        cold = Start(None, iterations=most, remaining=LEFT[0] if early else 0.0)
        result = optimize(design, task=task, x0=cold, **keywords)
        if refused:
            result.notes += (f"solved without a net: {refused}",)
    result.seconds["net"] = prediction.seconds
    result.seconds["total"] += prediction.seconds
    if prediction.net:
        result.details = {**result.details, "net": prediction.net}
    return result


def _unsound(design: Mesh, points: Array) -> str:
    """Say why a net's result cannot be a start; empty if it can."""
    if not np.isfinite(points).all():
        return "its result is not finite"
    turned = parametrization.flips(design, points) if points.shape[1] == 2 else 0
    return f"its result turns {turned} corner triangles over" if turned else ""


def _start(
    design: Mesh,
    points: Array,
    task: str,
    polish: bool | int,
    effort: float,
    keywords: Keywords,
) -> Start:
    """Return the start that a net's result makes."""
    options = plain_options(design, task, keywords) if polish is True else None
    if options is None or design.grid_shape is None:
        # Without iterations the net's result itself is wanted, whatever its energy.
        most = None if polish is True else int(polish)
        guarded = polish is not False
        return Start(points, "net", guarded=guarded, iterations=most, tolerance=NEARLY)
    left = LEFT[effort >= 1.0]
    start = Start(points, "net", guarded=True, remaining=left, resolution=SIZE)
    if max(design.grid_shape) >= LARGE:
        more = {k: v for k, v in keywords.items() if k in ("formulation", "terms")}
        solve = partial(optimize, task=task, **more)
        judged = bool(keywords.get("verdict", True))
        lower = better_start(design, points, SIZE, options, solve, judged)
        if lower is not None:
            again = replace(lower, guarded=True, remaining=left)
            return lower if lower.points is None else again
    return start


def _place(result: Result) -> None:
    """Move a flat image from the net's position to where the optimiser places its own."""
    frame, flat = Canonical(result.design), np.asarray(result.flat)
    result.flat = frame.back("flat", parametrization.place(frame.mesh, flat[frame.order]))
    result.pattern = Pattern.whole(result.design, result.flat)
    result.mesh = result.mesh.replaced(np.pad(result.flat, ((0, 0), (0, 1))))
