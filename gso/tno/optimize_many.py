"""Optimisation of many surfaces in parallel processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from functools import partial
from inspect import signature
from typing import Any

from gso.cut_pieces import Pieces
from gso.executors import Executor, Item, open_executor
from gso.result import Result
from gso.tasks.request import checked_terms
from gso.tno.optimize import optimize
from gso.typing import Keywords, MeshLike


def _one(keywords: Keywords, mesh: MeshLike | Pieces) -> Result:
    result = optimize(mesh, **keywords)
    result.metrics  # noqa: B018 - computed here, in the worker process
    return result


def optimize_many(
    meshes: Iterable[MeshLike | Pieces],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    executor: Executor | None = None,
    **keywords: Any,
) -> Iterator[Item[Result]]:
    """Optimise many surfaces in parallel processes, and yield results as they finish.

    Parameters
    ----------
    meshes : iterable
        Anything :func:`gso.tno.optimize` takes; read as workers become free, so a
        generator of any length fits in memory.
    workers : int, optional
        Number of worker processes; the number of cores when not given, 0 to solve in this one.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``, whose workers solve instead.
    executor : Executor, optional
        Solves instead, and stays open for other calls: :class:`gso.executors.ProcessExecutor`.
    **keywords
        Passed to :func:`gso.tno.optimize`; a `callback` is ignored. Worker processes need the
        functions of `terms` at the top level of a module.

    Yields
    ------
    Item
        In the order of completion; `index` says which input it belongs to. A surface
        that fails is reported in `error` and does not end the batch.

    Raises
    ------
    OptionError
        `terms` are no callables, or cannot be sent to worker processes.

    Examples
    --------
    >>> import numpy as np, gso
    >>> flat = np.dstack([*np.mgrid[:4., :4.], np.zeros((4, 4))])
    >>> [item.index for item in gso.tno.optimize_many([flat], workers=0)]
    [0]
    """
    signature(optimize).bind(None, **keywords)
    keywords.pop("callback", None)
    terms = checked_terms(keywords.get("terms", ()), "optimize_many", takes=True)
    if isinstance(keywords.get("constraints"), Iterator):
        # The first surface would exhaust the iterator.
        keywords["constraints"] = list(keywords["constraints"])
    own = nullcontext(executor) if executor else open_executor(workers, scheduler, main=True)
    with own as ready:
        ready.check_sent("terms", terms)
        yield from ready.as_completed(partial(_one, keywords), meshes)
