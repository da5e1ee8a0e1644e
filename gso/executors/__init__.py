"""Work on many items: in this process, in worker processes, or on a Dask cluster."""

from __future__ import annotations

from gso.executors.base import SERIAL, Executor, Item, check_workers, processors, useful_workers
from gso.executors.dask import DaskExecutor
from gso.executors.process_pool import ProcessExecutor

__all__ = [
    "SERIAL",
    "DaskExecutor",
    "Executor",
    "Item",
    "ProcessExecutor",
    "open_executor",
    "processors",
    "useful_workers",
]


def open_executor(
    workers: int | None = None, scheduler: str | None = None, *, main: bool = False
) -> Executor:
    """Open the executor that a number of workers or a scheduler asks for.

    Parameters
    ----------
    workers : int, optional
        Number of worker processes; one for each processor when not given, 0 for this process.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``, whose workers work instead.
    main : bool
        As for :class:`ProcessExecutor`.

    Raises
    ------
    OptionError
        The number of workers is negative.
    SchedulerError
        The scheduler cannot be used; see :class:`DaskExecutor`.

    Examples
    --------
    >>> with open_executor(workers=0) as executor:
    ...     executor.map(abs, [-1, 2])
    [1, 2]
    """
    if scheduler is not None:
        return DaskExecutor(scheduler)
    check_workers(workers)
    return SERIAL if workers == 0 else ProcessExecutor(workers, main=main)
