"""Optimisation of many surfaces in parallel processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from gso import cluster
from gso.result import Result
from gso.spelling import known_keywords
from gso.tno.optimize import optimize
from gso.typing import Keywords

if TYPE_CHECKING:
    from gso.io.convert import MeshLike


@dataclass(frozen=True)
class Item:
    """One surface of a batch: its place in the input, and its result or its error."""

    index: int
    result: Result | None
    error: str | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a result."""
        return self.result is not None


def _one(keywords: Keywords, mesh: MeshLike) -> Result:
    result = optimize(mesh, **keywords)
    result.metrics  # noqa: B018 - computed here, in the worker process
    return result


@known_keywords(optimize)
def optimize_many(
    meshes: Iterable[MeshLike],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    **keywords: Any,
) -> Iterator[Item]:
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
    **keywords
        Passed to :func:`gso.tno.optimize`; a `callback` is ignored.

    Yields
    ------
    Item
        In the order of completion; `index` says which input it belongs to. A surface
        that fails is reported in `error` and does not end the batch.

    Examples
    --------
    >>> import numpy as np, gso
    >>> flat = np.dstack([*np.mgrid[:4., :4.], np.zeros((4, 4))])
    >>> [item.index for item in gso.tno.optimize_many([flat], workers=0)]
    [0]
    """
    keywords.pop("callback", None)
    if isinstance(keywords.get("constraints"), Iterator):
        # The first surface would exhaust the iterator.
        keywords["constraints"] = list(keywords["constraints"])
    work = partial(_one, keywords)
    spread = cluster.either(work, meshes, workers=workers, scheduler=scheduler)
    with closing(spread) as results:
        for done in results:
            yield Item(done.index, done.value, done.error)
