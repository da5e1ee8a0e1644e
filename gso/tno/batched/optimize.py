"""The solve of many surfaces of one size: plan each, solve those of one structure together."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import parent_process
from types import ModuleType
from typing import Any

import numpy as np
import torch

from gso import tasks
from gso.constraints import Compiled
from gso.errors import GSOError, MeshError, OptionError
from gso.linalg import blas_threads
from gso.mesh import Mesh
from gso.parallel import processors, spread
from gso.result import Result
from gso.spelling import known_keywords
from gso.tasks.base import Options, Plan, Request
from gso.tno.batched import stages
from gso.tno.judged import judged, requirements
from gso.tno.normalise import Canonical
from gso.tno.optimize import check, optimize
from gso.tno.packed import packed
from gso.tno.run import Run
from gso.typing import Array

#: Formulations whose stages can be solved in batches, by task.
FORMULATIONS = {"developable": ("curvature",), "flatten": ("strain", "lengths")}
#: Surfaces solved together on a processor, and most surfaces and vertices of them together on a
#: graphics processor.
_TOGETHER, _TOGETHER_THERE, _MOST_THERE = 16, 256, 1 << 20


@dataclass(frozen=True)
class Asked:
    """What every surface of a batch is solved for, with checked options."""

    task: str
    formulation: str
    options: Options
    device: str
    verdict: bool

    @property
    def module(self) -> ModuleType:
        """The task."""
        return tasks.get(self.task)


@known_keywords()
def optimize_batch(
    points: Any,
    *,
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    device: str = "cpu",
    workers: int | None = None,
    verdict: bool = False,
) -> list[Result]:
    """Make many grids of one size developable, or flatten them, in batches on PyTorch tensors.

    The objective and the stages are those of :func:`gso.tno.optimize`, and so are the results,
    up to rounding errors and what the iterations make of them. A result does not depend on the
    other surfaces. On a graphics processor all surfaces are solved together. Surfaces whose
    stages differ from those of the others, such as noisy or closed ones, are solved in smaller
    batches, or one by one.

    Parameters
    ----------
    points : array_like or Tensor, (B, H, W, 3)
        The designs, in any unit of length; each may be in its own.
    task : {"developable", "flatten"}
        What to do.
    formulation : str, optional
        "curvature" for `developable`; "strain" (default) or "lengths" for `flatten`.
    options : str or Options, optional
        "fast", "balanced" (default), "accurate", or an options dataclass of the task. The linear
        backend and the number of threads in it are not used.
    device : str
        PyTorch's name of the device: "cpu", "cuda", "cuda:1" ...
    workers : int, optional
        "cpu": number of worker processes; as many as save time when not given, 0 for none.
    verdict : bool
        Judge the results, and flatten developable ones to measure their strain. This is done
        surface by surface on the processor.

    Returns
    -------
    list of Result
        In the order of the designs. Their `seconds` are a share of those of their batch.

    Raises
    ------
    MeshError
        The designs are not grids of one size, or one cannot be used; the message has its index.
    OptionError
        An option is unknown, has no batched solve, or the device does not exist.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> saddles = np.stack([np.stack([u, v, s * u * v], axis=-1) for s in (0.2, 0.3)])
    >>> results = gso.tno.optimize_batch(saddles, workers=0)
    >>> [r.metrics["loss_gc"] < r.metrics["loss_gc_before"] for r in results]
    [True, True]
    """
    designs = _designs(points)
    asked = checked(task, formulation, options, device, verdict)
    out: list[Result] = []
    for index, found in enumerate(solved(asked, list(designs), workers)):
        if isinstance(found, GSOError):
            raise type(found)(f"surface {index}: {found}")
        out.append(found)
    return out


def checked(
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    device: str = "cpu",
    verdict: bool = False,
) -> Asked:
    """Check the arguments of :func:`optimize_batch` that do not depend on the surfaces.

    Raises
    ------
    OptionError
        Something is unknown, or has no batched solve.
    """
    _, chosen, settings = check(task, formulation, options)
    known = FORMULATIONS.get(task, ())
    if chosen not in known:
        there = "; ".join(f"{name}: {', '.join(some)}" for name, some in FORMULATIONS.items())
        raise OptionError(
            f"task {task!r} with formulation {chosen!r} is not solved in batches ({there} are); "
            "use gso.tno.optimize_many"
        )
    try:
        torch.zeros(1, dtype=torch.float64, device=device).item()
    except (RuntimeError, AssertionError, TypeError) as error:
        reason = str(error).splitlines()[0]
        raise OptionError(f"device {device!r} cannot be used ({reason}); take 'cpu'") from None
    return Asked(task, chosen, settings, str(device), verdict)


def _designs(points: Any) -> Array:
    """Return designs (B, H, W, 3) as an array, or say what is wrong with which."""
    if isinstance(points, torch.Tensor):
        points = points.detach().cpu().numpy()
    try:
        designs = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError):
        designs = None
    if designs is None:
        shapes = [np.shape(p) for p in points] if isinstance(points, Sequence) else []
        odd = next((k for k, s in enumerate(shapes) if s != shapes[0]), None)
        if odd is not None:
            raise MeshError(
                f"surface {odd} has shape {shapes[odd]} and surface 0 has {shapes[0]}; a batch "
                "has grids of one size, others are solved by gso.tno.optimize_many"
            )
        raise MeshError("the surfaces must be an array of numbers (B, H, W, 3)")
    if designs.ndim != 4 or designs.shape[-1] != 3:
        raise MeshError(f"expected a batch of grids (B, H, W, 3), not {designs.shape}")
    bad = ~np.isfinite(designs).all(axis=(1, 2, 3))
    if bad.any():
        k = int(bad.argmax())
        i, j = np.argwhere(~np.isfinite(designs[k]).all(axis=-1))[0]
        raise MeshError(f"surface {k}: grid vertex ({i}, {j}) is not finite")
    return designs


def solved(
    asked: Asked, designs: Sequence[Any], workers: int | None = 0
) -> Iterator[Result | GSOError]:
    """Solve grids of one size, arrays (H, W, 3) or meshes; yield results or errors in order."""
    there = asked.device.partition(":")[0] != "cpu"
    together = _TOGETHER
    if there and len(designs):
        vertices = np.size(getattr(designs[0], "vertices", designs[0])) // 3
        together = max(min(_MOST_THERE // vertices, _TOGETHER_THERE), 1)
    pieces = [designs[k : k + together] for k in range(0, len(designs), together)]
    if workers is None:
        workers = _paying(len(pieces))
    if workers <= 0 or there:
        for piece in pieces:
            yield from _together(asked, piece)
        return
    # Smaller pieces where they leave no process without work.
    share = -(-len(designs) // (workers * -(-len(pieces) // workers)))
    pieces = [designs[k : k + share] for k in range(0, len(designs), share)]
    done: dict[int, Any] = {}
    work = partial(_measured, asked)
    with closing(spread(work, pieces, workers=min(workers, len(pieces)), caller=False)) as results:
        for one in results:
            if one.error is not None:
                raise GSOError(f"surfaces from {one.index * share} on: {one.error}")
            done[one.index] = one.value
    for k in range(len(pieces)):
        yield from done.pop(k)


def _measured(asked: Asked, designs: Sequence[Any]) -> list[Result | GSOError]:
    """Solve designs in a worker process, and compute their metrics there."""
    found = _together(asked, designs)
    for result in found:
        if isinstance(result, Result):
            result.metrics  # noqa: B018
    return found


def _paying(pieces: int) -> int:
    """Return the number of worker processes that saves time, 0 inside a worker process."""
    if parent_process() is not None or pieces < 4:
        return 0
    return min(processors(), pieces)


@dataclass
class _Begun:
    """One surface that is being solved."""

    design: Mesh
    frame: Canonical
    run: Run
    request: Request
    plan: Plan
    seconds: float


def _together(asked: Asked, designs: Sequence[Any]) -> list[Result | GSOError]:
    """Solve designs in one batch for each structure that their stages have."""
    out: list[Any] = [None] * len(designs)
    groups: dict[bytes, list[tuple[int, _Begun]]] = {}
    with _one_thread(asked.device), blas_threads(asked.options.threads):
        for index, given in enumerate(designs):
            try:
                begun = _begun(asked, given)
            except GSOError as error:
                out[index] = error
                continue
            key = stages.structure(begun.plan)
            if key is None:
                out[index] = _alone(asked, given)
            else:
                groups.setdefault(key, []).append((index, begun))
        for group in groups.values():
            found: Sequence[Result | GSOError]
            try:
                found = _solved([begun for _, begun in group], asked)
            except stages.Unbatchable:
                found = [_alone(asked, designs[index]) for index, _ in group]
            for (index, _), result in zip(group, found, strict=True):
                out[index] = result
    return out


@contextmanager
def _one_thread(device: str) -> Iterator[None]:
    """Use one thread on a processor: worker processes use the others."""
    before = torch.get_num_threads()
    if device.partition(":")[0] == "cpu":
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _begun(asked: Asked, given: Any) -> _Begun:
    from gso.io import as_mesh

    clock = time.perf_counter()
    design = as_mesh(given)
    design.check_joined()
    frame = Canonical(design)
    flat = getattr(asked.module, "BLOCK", "surface") == "flat"
    analysis = tasks.analyse(asked.module, frame.mesh, Compiled(flat=flat))
    run = Run(asked.module, analysis)
    request = Request(asked.options.in_unit(frame.frame.scale), asked.formulation)
    plan = asked.module.plan(analysis, request)
    return _Begun(design, frame, run, request, plan, time.perf_counter() - clock)


def _alone(asked: Asked, given: Any) -> Result | GSOError:
    """Solve a surface by itself."""
    import warnings

    from gso.errors import ConvergenceWarning

    try:
        with warnings.catch_warnings():
            # The status says the same.
            warnings.simplefilter("ignore", ConvergenceWarning)
            return optimize(
                given,
                task=asked.task,
                formulation=asked.formulation,
                options=asked.options,
                verdict=asked.verdict,
            )
    except GSOError as error:
        return error


def _solved(group: list[_Begun], asked: Asked) -> list[Result]:
    """Solve surfaces whose stages have one structure, in halves where memory is short."""
    clock = time.perf_counter()
    plans, half = [begun.plan for begun in group], len(group) // 2
    try:
        reached, iterations, timings = stages.solve(
            plans, asked.options.method, torch.device(asked.device)
        )
    except torch.cuda.OutOfMemoryError:
        if not half:
            raise
        reached = []
    if not reached:
        torch.cuda.empty_cache()
        return _solved(group[:half], asked) + _solved(group[half:], asked)
    each = (time.perf_counter() - clock) / len(group)
    out = []
    for begun, state, count in zip(group, reached, iterations, strict=True):
        clock = time.perf_counter()
        run = begun.run
        run.iterations, run.history = count, state.minimum.history
        for phase, seconds in timings.as_dict().items():
            setattr(run.timings, phase, seconds / len(group))
        run.timings.setup += begun.seconds
        solution = run.concluded(begun.plan, state)
        result = packed(asked.task, asked.formulation, begun.design, begun.frame, solution, run)
        if asked.verdict:
            scale = begun.frame.frame.scale
            result = judged(result, requirements(begun.frame.mesh, Compiled(), scale))
        result.seconds["total"] = begun.seconds + each + time.perf_counter() - clock
        out.append(result)
    return out
