"""One call: the net predicts, the optimiser checks and finishes."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso import flat_start, tasks
from gso.components import Component, several
from gso.constraints import Compiled, compile_constraints, listed
from gso.hybrid.prediction import Prediction, predictions
from gso.hybrid.worth import pays
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.result import Result
from gso.spelling import known_keywords
from gso.status import ConvergenceWarning, GSOError, MeshError, OptionError, Status
from gso.tno import Start, check, components, optimize
from gso.tno.batch import Item
from gso.tno.canonical import Canonical
from gso.tno.job import Job
from gso.tno.pool import spread

Array = NDArray[np.float64]

#: Surfaces that go through a net together.
_BATCH = 64
#: Passes of a net whose result is solved from: what more of them change at large, a solve on a
#: coarser grid does as well in less time.
_PASSES = 1
#: Relative fall of the energy at which a solve from a net's result stops: most of the time
#: that is left after it gains some per mille.
_NEARLY = 2e-3


@known_keywords(optimize)
def solve(
    mesh: Any,
    *,
    task: str = "developable",
    net: Any = None,
    polish: bool | int = True,
    sparing: bool = False,
    **keywords: Any,
) -> Result:
    """Let a net make a start, and the optimiser finish it.

    The start is dropped, and the solve is that of :func:`gso.tno.optimize`, where there is
    no net (none for the task, PyTorch is not installed), where the design is small, is no
    grid and cannot be resampled to one, or has far more curvature than what nets are taught,
    and where the net's result turns cells of a flat image over, is not finite, or has more of
    the energy than the start without it. The result's `notes` then say so, and its
    `warm_start` is "cold".

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, or path
        The design. Grids of any size, and meshes of one piece with a boundary and without
        handles: those are resampled to a grid, and the displacement is carried back.
    task : str
        As for :func:`gso.tno.optimize`; nets make starts for "developable" and "flatten". There
        is nothing to start for "denoise", whose net is asked with ``polish=False`` only.
    net : str, path or net, optional
        As `model` of :func:`gso.net.predict`; the task's default when not given.
    polish : bool or int
        True: solve from there, until an iteration gains less than 0.2 % of the energy (or the
        options' tolerance, where that is more). A number: at most so many iterations, also
        without a net.
        False: the net's result as it is, whatever its energy, measured; hard constraints
        and `max_deviation` are kept. With `target_curvature` or `max_strain`, which take many
        solves, only True.
    sparing : bool
        Ask the net only where that has been found to save time: on large grids, and by
        curvature. Elsewhere the result is that of :func:`gso.tno.optimize`.
    **keywords
        Passed to :func:`gso.tno.optimize`: `formulation`, `options`, `constraints`,
        `max_deviation`, `max_strain`, `target_curvature`, `callback`, `verdict`.

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
    from gso.io import as_mesh

    clock = time.perf_counter()
    polish = _checked(task, polish, keywords)
    design = as_mesh(mesh)
    design.check_joined()
    pieces = _pieces(design, task, sparing, keywords)
    if pieces:
        result = _each(design, pieces, task, keywords | {"net": net, "polish": polish})
        result.seconds["total"] = time.perf_counter() - clock
        return result
    prediction = Prediction()
    if not sparing or pays(design, task, keywords):
        asked = {"task": task, "net": net, "passes": _passes(polish), "alone": polish is False}
        (prediction,) = predictions([design], **asked)
    result = _finished(design, prediction, task, polish, keywords)
    result.seconds["total"] = time.perf_counter() - clock
    return result


@known_keywords(optimize)
def solve_many(
    meshes: Iterable[Any],
    *,
    task: str = "developable",
    net: Any = None,
    polish: bool | int = True,
    sparing: bool = False,
    workers: int | None = None,
    **keywords: Any,
) -> Iterator[Item]:
    """:func:`solve` for many surfaces: one forward pass for many, then parallel processes.

    Parameters
    ----------
    meshes : iterable
        Anything :func:`solve` takes; read in blocks, so that a generator of any length fits.
    task, net, polish, sparing, **keywords
        As for :func:`solve`; a `callback` is left out.
    workers : int, optional
        Processes; the number of cores when not given, 0 for none (in this process).

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
    work = partial(_one, task, polish, keywords)
    worth = partial(pays, task=task, keywords=keywords, many=True) if sparing else None
    passes, alone = _passes(polish), polish is False
    ask = partial(predictions, task=task, net=net, passes=passes, alone=alone)
    with closing(spread(work, _started(meshes, worth, ask), workers=workers)) as results:
        for done in results:
            yield Item(done.index, done.value, done.error)


def _pieces(design: Mesh, task: str, sparing: bool, keywords: dict[str, Any]) -> list[Component]:
    """The components of a design for each of which a net is asked; none where it is not."""
    if not several(design):
        return []
    flat = getattr(tasks.get(task), "BLOCK", "surface") == "flat"
    compiled = compile_constraints(keywords["constraints"], design, flat=flat)
    pieces = components.parts(design, compiled)
    if sparing and not any(pays(piece.mesh, task, keywords) for piece in pieces):
        return []
    keywords["constraints"] = compiled
    return pieces


def _each(design: Mesh, pieces: list[Component], task: str, keywords: dict[str, Any]) -> Result:
    """Solve every component from a net's result of its own, where there is one."""
    callback, compiled = keywords.pop("callback", None), keywords.pop("constraints")

    def one(job: Job, told: Any) -> Result:
        kept = () if job.constraints.empty else job.constraints
        return solve(job.design, task=task, constraints=kept, callback=told, **keywords)

    whole = Job(design, compiled, Start(None))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        result = components.solve(one, whole, pieces, callback, workers=0)
    if not result.converged and result.status is not Status.MAX_ITERATIONS:
        warnings.warn(str(result.status), ConvergenceWarning, stacklevel=4)
    return result


@dataclass(frozen=True)
class _Started:
    """A design, or why it is none, with its prediction."""

    design: Mesh | GSOError
    prediction: Prediction


def _started(
    meshes: Iterable[Any],
    worth: Callable[[Mesh], bool] | None,
    ask: Callable[[list[Mesh]], list[Prediction]],
) -> Iterator[_Started]:
    """Designs with their predictions where they are worth it, a block at a time."""
    source = iter(meshes)
    while block := list(islice(source, _BATCH)):
        read = [_read(mesh) for mesh in block]
        seen = [isinstance(d, Mesh) and (worth is None or worth(d)) for d in read]
        chosen = [d for d, s in zip(read, seen, strict=True) if s and isinstance(d, Mesh)]
        found = iter(ask(chosen))
        for design, asked in zip(read, seen, strict=True):
            yield _Started(design, next(found) if asked else Prediction())


def _passes(polish: bool | int) -> int | None:
    """How many passes of a net are asked for: all where few or no iterations follow."""
    return _PASSES if polish is True else None


def _read(mesh: Any) -> Mesh | GSOError:
    from gso.io import as_mesh

    try:
        return as_mesh(mesh)
    except GSOError as error:
        return error


def _one(task: str, polish: bool | int, keywords: dict[str, Any], started: _Started) -> Result:
    if isinstance(started.design, GSOError):
        raise started.design
    result = _finished(started.design, started.prediction, task, polish, keywords)
    result.metrics  # noqa: B018 - computed here, where there is a processor for it
    return result


def _checked(task: str, polish: Any, keywords: dict[str, Any]) -> bool | int:
    """Check what needs no mesh; the polish as what it is, the constraints as a list."""
    if not isinstance(polish, bool | np.bool_ | int | np.integer) or polish < 0:
        raise OptionError(f"polish is {polish!r}; take True, False, or a number of iterations")
    if "x0" in keywords:
        raise OptionError("the net makes the start; for one of your own call gso.tno.optimize")
    names = ("formulation", "options", "max_deviation", "max_strain", "target_curvature")
    check(task, **{name: keywords[name] for name in names if name in keywords})
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
    design: Mesh,
    prediction: Prediction,
    task: str,
    polish: bool | int,
    keywords: dict[str, Any],
) -> Result:
    """Solve from a prediction, if there is a sound one."""
    refused, result = prediction.refused, None
    if prediction.points is not None:
        try:
            refused = _unsound(design, prediction.points)
            if not refused:
                result = _polished(design, prediction.points, task, polish, keywords)
        except MeshError as error:
            # A start may have no area. What is wrong with the design comes again.
            refused = str(error)
    if result is None:
        most = None if isinstance(polish, bool) else polish
        result = optimize(design, task=task, x0=Start(None, iterations=most), **keywords)
        if refused:
            result.notes += (f"solved without a net: {refused}",)
    result.seconds["net"] = prediction.seconds
    result.seconds["total"] += prediction.seconds
    if prediction.net:
        result.details = {**result.details, "net": prediction.net}
    return result


def _unsound(design: Mesh, points: Array) -> str:
    """Why nothing can start from a net's result."""
    if not np.isfinite(points).all():
        return "its result is not finite"
    turned = flat_start.flips(design, points) if points.shape[1] == 2 else 0
    return f"its result turns {turned} corner triangles over" if turned else ""


def _polished(
    design: Mesh,
    points: Array,
    task: str,
    polish: bool | int,
    keywords: dict[str, Any],
) -> Result:
    """Solve from a net's result."""
    # One that is not polished is what was asked for, whatever it is like.
    start = Start(
        points,
        source="net",
        guarded=polish is not False,
        iterations=None if polish is True else int(polish),
        tolerance=_NEARLY,
    )
    result = optimize(design, task=task, x0=start, **keywords)
    if task == "flatten" and result.warm_start == "net" and not keywords["constraints"]:
        _place(result)
    return result


def _place(result: Result) -> None:
    """Put a flat image, which is where the net's was, where the optimiser puts its own."""
    frame, flat = Canonical(result.design), np.asarray(result.flat)
    result.flat = frame.back("flat", flat_start.place(frame.mesh, flat[frame.order]))
    result.pattern = Pattern.whole(result.design, result.flat)
    result.mesh = result.mesh.replaced(np.pad(result.flat, ((0, 0), (0, 1))))
