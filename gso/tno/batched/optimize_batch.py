"""The solve of many grids of one size in batches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from torch import Tensor

from gso.errors import GSOError, MeshError
from gso.executors import Executor
from gso.executors.base import check_workers
from gso.result import Result
from gso.tasks.base import Options
from gso.tasks.request import OwnTerms
from gso.tno.batched import device as devices
from gso.tno.batched.batches import check_batch
from gso.tno.batched.many import solve_all
from gso.typing import Array


def optimize_batch(
    points: Tensor | ArrayLike,
    *,
    task: str = "developable",
    formulation: str | None = None,
    options: str | Options | None = None,
    device: str = "cpu",
    workers: int | None = None,
    executor: Executor | None = None,
    terms: Sequence[OwnTerms] = (),
    verdict: bool = False,
) -> list[Result]:
    """Make many grids of one size developable, or flatten them, in batches on PyTorch tensors.

    The objective and the stages are those of :func:`gso.tno.optimize`, and so are the results,
    up to rounding errors and what the iterations make of them. But for these, a result does not
    depend on the other surfaces. Each surface is solved once, also with `verdict`: a result that
    strains too much, is too far away or folds is refused, where ``optimize`` solves again, and
    curvature that coarse quads hide (``loss_gc_image``) is not removed. On a graphics processor up
    to a thousand are solved together.
    On a processor PyTorch uses one thread of this process for as long as it runs.
    Surfaces whose stages differ from those of the others, such as noisy or closed ones, are
    solved in smaller batches, or one by one.

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
        Number of processes that work at a time; as many as save time when not given, 0 for this
        one alone. On a processor workers solve whole batches. With a graphics processor they plan,
        and this process minimises; as many more wait for it meanwhile.
    executor : Executor, optional
        Works instead, and stays open for other calls: :class:`gso.executors.ProcessExecutor`. With
        a graphics processor it needs two processes for each that works at a time.
    terms : sequence of callable
        As for :func:`gso.tno.optimize`. Surfaces are solved one by one where the residual of a
        term is not a function at the top level of a module. Workers need all functions there; with
        terms there are none unless `workers` or `executor` is given.
    verdict : bool
        Judge the results, and flatten developable ones to measure their strain. This is done
        surface by surface on the processor.

    Returns
    -------
    list of Result
        In the order of the designs. Their `seconds` are a share of those of their batch, which
        may include the time that it waits for others with a graphics processor. There
        are no warnings: the status of each says whether it has converged.

    Raises
    ------
    MeshError
        The designs are not grids of one size, or one cannot be used; the message has its index.
    OptionError
        An option is unknown, has no batched solve, or the device does not exist; or terms cannot
        be sent to workers.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> saddles = np.stack([np.stack([u, v, s * u * v], axis=-1) for s in (0.2, 0.3)])
    >>> results = gso.tno.optimize_batch(saddles, workers=0)
    >>> [r.metrics["loss_gc"] < r.metrics["loss_gc_before"] for r in results]
    [True, True]
    """
    check_workers(workers)
    designs = _designs(points)
    devices.check_device(device)
    batch = check_batch(task, formulation, options, device, verdict, terms)
    out: list[Result] = []
    for index, found in enumerate(solve_all(batch, list(designs), workers, executor)):
        if isinstance(found, GSOError):
            raise type(found)(f"surface {index}: {found}")
        out.append(found)
    return out


def _designs(points: Tensor | ArrayLike) -> Array:
    """Return designs (B, H, W, 3) as an array, or say what is wrong with which."""
    if isinstance(points, Tensor):
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
    if designs.shape == (0,):
        return np.zeros((0, 3, 3, 3))
    if designs.ndim != 4 or designs.shape[-1] != 3:
        raise MeshError(f"expected a batch of grids (B, H, W, 3), not {designs.shape}")
    bad = ~np.isfinite(designs).all(axis=(1, 2, 3))
    if bad.any():
        k = int(bad.argmax())
        i, j = np.argwhere(~np.isfinite(designs[k]).all(axis=-1))[0]
        raise MeshError(f"surface {k}: grid vertex ({i}, {j}) is not finite")
    return designs
