"""Large values between processes, through memory that both of them have."""

from __future__ import annotations

import mmap
import os
import pickle  # noqa: TID251, between processes of this package only
from collections.abc import Sequence
from multiprocessing import reduction
from multiprocessing.connection import Connection
from typing import Any

#: Bytes of arrays from which they do not go through the connection.
_LARGE = 1 << 20
#: Arrays begin at multiples of this.
_ALIGNED = 64


class Ended(Exception):
    """The other process has ended."""


def send(connection: Connection, value: Any) -> None:
    """Send a value.

    On Linux large arrays are written to anonymous shared memory, of which the other process gets
    the handle. Elsewhere, and where there is none, they go through the connection. A value that
    cannot be pickled raises before anything is sent.

    Raises
    ------
    Ended
        The other process has ended.
    """
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    parts = [buffer.raw() for buffer in buffers]
    places, size = [], 0
    for part in parts:
        places.append((size, part.nbytes))
        size += -(-part.nbytes // _ALIGNED) * _ALIGNED
    handle = _shared(parts, places, size) if size >= _LARGE else None
    try:
        if handle is None:
            connection.send((head, [bytearray(part) for part in parts], 0))
        else:
            connection.send((head, places, size))
            reduction.send_handle(connection, handle, 0)
    except ConnectionError:
        raise Ended from None
    finally:
        if handle is not None:
            os.close(handle)


def _shared(
    parts: Sequence[memoryview], places: Sequence[tuple[int, int]], size: int
) -> int | None:
    """Write arrays to shared memory, and return its handle; None where there is none."""
    if not hasattr(os, "memfd_create"):
        return None
    try:
        handle = os.memfd_create("gso")
    except OSError:
        return None
    try:
        os.ftruncate(handle, size)
        with mmap.mmap(handle, size) as memory:
            for (start, count), part in zip(places, parts, strict=True):
                memory[start : start + count] = part
    except OSError:
        os.close(handle)
        return None
    return handle


def receive(connection: Connection) -> Any:
    """Receive what :func:`send` has sent; arrays can be changed, and have memory of their own.

    Raises
    ------
    Ended
        The other process has ended.
    """
    try:
        head, parts, size = connection.recv()
    except (EOFError, ConnectionError):
        raise Ended from None
    if size:
        handle = reduction.recv_handle(connection)
        try:
            with mmap.mmap(handle, size) as memory:
                parts = [bytearray(memory[start : start + count]) for start, count in parts]
        finally:
            os.close(handle)
    return pickle.loads(head, buffers=parts)  # noqa: S301
