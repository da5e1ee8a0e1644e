"""Distribution of work to a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from importlib.util import find_spec
from typing import Any

from gso import parallel
from gso.errors import GSOError, SchedulerError
from gso.parallel import Done

#: Seconds within which a scheduler must answer.
PATIENCE = 20


def either(
    function: Callable[[Any], Any],
    pieces: Iterable[Any],
    *,
    workers: int | None,
    scheduler: str | None,
    caller: bool = True,
) -> Generator[Done, None, None]:
    """Apply a function to many items in processes of this machine, or on a cluster.

    Parameters
    ----------
    function, pieces, scheduler
        As for :func:`spread`; no scheduler: processes of this machine.
    workers, caller
        As for :func:`gso.parallel.spread`.
    """
    if scheduler is not None:
        return spread(function, pieces, scheduler=scheduler)
    return parallel.spread(function, pieces, workers=workers, caller=caller)


def spread(
    function: Callable[[Any], Any], pieces: Iterable[Any], *, scheduler: str
) -> Generator[Done, None, None]:
    """Apply a function to many items on a Dask cluster, and yield results as they finish.

    If a worker is lost, its items are repeated on other workers. An item that repeatedly
    loses its worker becomes an error.

    Parameters
    ----------
    function : callable
        Function of one argument; the packages that it needs must be installed on the workers.
    pieces : iterable
        The items, read lazily as workers become free.
    scheduler : str
        Address of the scheduler, such as ``tcp://host:8786``.

    Yields
    ------
    Done
        Results in the order of completion.

    Raises
    ------
    SchedulerError
        Dask is not installed, the scheduler does not answer, or it has no workers.
    """
    if find_spec("distributed") is None:
        raise SchedulerError(
            'a scheduler needs Dask: pip install ".[cluster]" in the folder of gso'
        )
    from distributed import Client, as_completed

    try:
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchedulerError(f"no Dask scheduler answers at {scheduler}: {reason}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise SchedulerError(f"the Dask scheduler at {scheduler} has no workers") from None
        numbered = enumerate(pieces)
        waiting: dict[Any, int] = {}
        running = as_completed(loop=client.loop)

        def fill() -> None:
            # Two items per worker: no worker idles, and few results are held at a time.
            room = 2 * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1) - len(waiting)
            for _ in range(room):
                entry = next(numbered, None)
                if entry is None:
                    return
                future = client.submit(function, entry[1], pure=False)
                waiting[future.key] = entry[0]
                running.add(future)

        fill()
        while waiting:
            future = next(running)
            index = waiting.pop(future.key)
            try:
                # This waits for recomputation if the worker that held the value has died.
                done = Done(index, future.result())
            except GSOError as error:
                done = Done(index, error=str(error))
            except Exception as error:  # any exception of the worker
                done = Done(index, error=f"{type(error).__name__}: {error}")
            del future
            yield done
            fill()
