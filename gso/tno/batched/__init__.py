"""Solves of many surfaces at once, on PyTorch tensors whose last axis is that of the surfaces.

Raises
------
BackendError
    PyTorch is not installed.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from gso.errors import BackendError
from gso.first_use import at_first_use

if find_spec("torch") is None:
    raise BackendError('batched solves need torch: pip install ".[net]" in the folder of gso')

if TYPE_CHECKING:
    from gso.tno.batched.batches import check_batch, solve_batch
    from gso.tno.batched.device_executor import DeviceExecutor, minimise_elsewhere
    from gso.tno.batched.many import solve_all

__all__ = ["DeviceExecutor", "check_batch", "minimise_elsewhere", "solve_all", "solve_batch"]

__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "batches": "check_batch solve_batch",
        "device_executor": "DeviceExecutor minimise_elsewhere",
        "many": "solve_all",
    },
)
