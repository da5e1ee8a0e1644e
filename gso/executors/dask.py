"""Workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from importlib.util import find_spec
from typing import Any

from gso.errors import SchedulerError
from gso.executors.base import Executor, R

#: Seconds within which a scheduler must answer.
PATIENCE = 20


class DaskExecutor(Executor):
    """Workers of a Dask cluster, which have this package installed.

    If a worker is lost, its items are repeated on other workers. An item that repeatedly loses its
    worker becomes an error.

    Parameters
    ----------
    scheduler : str
        Address of the scheduler, such as ``tcp://host:8786``.

    Raises
    ------
    SchedulerError
        Dask is not installed, the scheduler does not answer, or it has no workers.
    """

    def __init__(self, scheduler: str):
        if find_spec("distributed") is None:
            raise SchedulerError(
                'a scheduler needs Dask: pip install ".[cluster]" in the folder of gso'
            )
        import distributed

        connect: Any = distributed.Client
        try:
            self._client = connect(scheduler, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, RuntimeError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise SchedulerError(f"no Dask scheduler answers at {scheduler}: {reason}") from None
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            self._client.close()
            raise SchedulerError(f"the Dask scheduler at {scheduler} has no workers") from None
        self._pool = self._client.get_executor(pure=False)

    @property
    def workers(self) -> int:  # type: ignore[override]
        return len(self._client.scheduler_info(n_workers=-1)["workers"])

    def submit(self, function: Callable[..., R], *given: object) -> Future[R]:
        future: Future[R] = self._pool.submit(function, *given)
        return future

    def shutdown(self) -> None:
        self._client.close()
