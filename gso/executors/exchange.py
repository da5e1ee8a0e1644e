"""Values between processes, through memory that both of them have."""

from __future__ import annotations

import os
import pickle  # noqa: TID251, between processes of this package only
from concurrent.futures import BrokenExecutor
from multiprocessing import reduction
from multiprocessing.connection import Connection
from typing import Any


class Ended(BrokenExecutor):
    """The other process has ended."""


def unsendable(value: object) -> str:
    """Say why a value cannot be sent to another process; empty if it can.

    >>> unsendable(abs), "lambda" in unsendable(lambda x: x)
    ('', True)
    """
    try:
        pickle.dumps(value, protocol=5)
    # What a value's own methods raise has no class in common.
    except Exception as error:
        return str(error)
    return ""


def send(connection: Connection, value: object) -> None:
    """Send a value; one that cannot be pickled raises before anything is sent.

    On Linux the value is written to anonymous memory, of which the other process gets the handle:
    arrays would take longer through the connection.

    Raises
    ------
    Ended
        The other process has ended.
    """
    try:
        if not hasattr(os, "memfd_create"):
            connection.send_bytes(pickle.dumps(value, protocol=5))
            return
        with os.fdopen(os.memfd_create("gso"), "wb") as memory:
            pickle.dump(value, memory, protocol=5)
            memory.flush()
            reduction.send_handle(connection, memory.fileno(), 0)
    except ConnectionError:
        raise Ended from None


def receive(connection: Connection) -> Any:
    """Receive what :func:`send` has sent.

    Raises
    ------
    Ended
        The other process has ended.
    """
    try:
        if not hasattr(os, "memfd_create"):
            return pickle.loads(connection.recv_bytes())  # noqa: S301
        handle = reduction.recv_handle(connection)
    except (EOFError, ConnectionError):
        raise Ended from None
    with os.fdopen(handle, "rb") as memory:
        memory.seek(0)
        return pickle.load(memory)  # noqa: S301
