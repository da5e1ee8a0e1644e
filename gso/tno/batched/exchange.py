"""Large values between processes, through memory that both of them have."""

from __future__ import annotations

import mmap
import os
import pickle  # noqa: TID251, between processes of this package only
from multiprocessing import reduction
from multiprocessing.connection import Connection
from typing import Any

#: Bytes of arrays from which they do not go through the connection.
_LARGE = 1 << 20
#: Arrays begin at multiples of this.
_ALIGNED = 64


def send(connection: Connection, value: Any) -> None:
    """Send a value.

    On Linux large arrays are written to anonymous shared memory, of which the other process gets
    the handle. Elsewhere they go through the connection.
    """
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    raw = [buffer.raw() for buffer in buffers]
    places, size = [], 0
    for part in raw:
        places.append((size, part.nbytes))
        size += -(-part.nbytes // _ALIGNED) * _ALIGNED
    if size < _LARGE or not hasattr(os, "memfd_create"):
        connection.send((head, [part.tobytes() for part in raw], 0))
        return
    handle = os.memfd_create("gso")
    try:
        os.ftruncate(handle, size)
        with mmap.mmap(handle, size) as memory:
            for (start, count), part in zip(places, raw, strict=True):
                memory[start : start + count] = part
        connection.send((head, places, size))
        reduction.send_handle(connection, handle, 0)
    finally:
        os.close(handle)


def receive(connection: Connection) -> Any:
    """Receive what :func:`send` has sent.

    Raises
    ------
    EOFError, OSError
        The other process has ended.
    """
    head, parts, size = connection.recv()
    if size:
        handle = reduction.recv_handle(connection)
        try:
            memory = memoryview(mmap.mmap(handle, size))
        finally:
            os.close(handle)
        parts = [memory[start : start + count] for start, count in parts]
    return pickle.loads(head, buffers=parts)  # noqa: S301
