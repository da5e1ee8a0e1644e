"""Functions that tests call in worker processes: a module that is imported in no time."""

from __future__ import annotations

import os
import time
from threading import Lock

from gso import MeshError
from gso.executors import ProcessExecutor, useful_workers


def square(x):
    if x < 0:
        raise ValueError(f"{x} is negative")
    return x * x, os.getpid()


def refuse(x):
    raise MeshError(f"face {x} is bad")


class Odd(Exception):
    """An exception that cannot be read where it is sent to."""

    def __init__(self, one, other):
        super().__init__(f"{one} and {other}")


def odd(x):
    raise Odd(x, x)


def leave(x):
    if x == 2:
        os._exit(1)
    return 10 * x


def leave_others(x):
    if os.getpid() != x:
        os._exit(1)
    return x


def lock(x):
    return Lock()


def sleep(seconds):
    time.sleep(seconds)
    return seconds


def sleep_and_tell(seconds):
    time.sleep(seconds)
    return os.getpid()


def large(size):
    return bytes(size)


def nested(x):
    with ProcessExecutor(1) as own:
        return [item.result for item in own.as_completed(abs, [x])], useful_workers(9)
