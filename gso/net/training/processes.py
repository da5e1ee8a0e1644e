"""The processes of a training run: those started by torchrun, or a single one."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import distributed

from gso.net.models.base import device_of


@dataclass(frozen=True)
class Processes:
    """One process of a run, and its communication with the others.

    Attributes
    ----------
    rank, world : int
        Number of this process, and number of processes.
    device : torch.device
        Device of this process.
    """

    rank: int
    world: int
    device: torch.device

    @property
    def first(self) -> bool:
        """Whether this is the process that writes files (rank 0)."""
        return self.rank == 0

    def agreed(self, value: float) -> float:
        """Broadcast a number from the first process to all."""
        if self.world == 1:
            return value
        shared = torch.tensor([value], dtype=torch.float64, device=self.device)
        distributed.broadcast(shared, 0)
        return float(shared)

    def summed(self, value: torch.Tensor) -> torch.Tensor:
        """Sum a tensor over all processes; every process gets the sum."""
        if self.world == 1:
            return value
        shared = value.to(self.device)
        distributed.all_reduce(shared)
        return shared.to(value.device)

    def wait(self) -> None:
        """Wait for all processes (barrier)."""
        if self.world > 1:
            distributed.barrier()


@contextmanager
def interruption() -> Iterator[Callable[[], bool]]:
    """Defer Ctrl-C: provide a function that tells whether it was pressed.

    A second Ctrl-C interrupts at once.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    asked = False

    def ask(number: int, frame: object) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def processes(device: str | None = None) -> Iterator[Processes]:
    """Join the process group of torchrun, if there is one, for the duration of a block.

    Raises
    ------
    OptionError
        There is no such device.
    """
    world, rank = (int(os.environ.get(n, d)) for n, d in (("WORLD_SIZE", "1"), ("RANK", "0")))
    where = device_of(device)
    if where == torch.device("cuda") and world > 1:
        where = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
    if world == 1:
        yield Processes(0, 1, where)
        return
    if where.type == "cuda":
        torch.cuda.set_device(where)
    distributed.init_process_group("nccl" if where.type == "cuda" else "gloo")
    try:
        yield Processes(rank, world, where)
    finally:
        distributed.destroy_process_group()
