"""Nets that PyTorch applies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from gso.net.models.base import Net, device_of, exact
from gso.net.weights import cached
from gso.typing import Array


@dataclass(frozen=True)
class TorchNet:
    """A net on a device; see :class:`gso.net.inference.applied_net.AppliedNet`."""

    net: Net
    device: torch.device

    @property
    def task(self) -> str:
        return self.net.task

    @property
    def passes(self) -> int:
        return self.net.passes

    @property
    def told(self) -> bool:
        return bool(getattr(self.net, "sigma", False))

    def start(self, unit: Array) -> Array:
        found: Array = self.net.initial_geometry(torch.as_tensor(unit)).numpy()
        return found

    def displacements(self, seen: Array, unit: Array, noise: Array | None, passes: int) -> Array:
        coarse, level = self._single(seen), None if noise is None else self._single(noise)
        with torch.inference_mode(), exact():
            if seen.shape == unit.shape:
                moved = self.net.displacements(coarse, level, passes=passes)
            else:
                moved = self.net.displacements_at(coarse, self._single(unit), level, passes=passes)
        return np.asarray(moved.double().cpu().numpy())

    def _single(self, values: Array) -> torch.Tensor:
        return torch.as_tensor(values, dtype=torch.float32, device=self.device)


def torch_net(model: Net | Path, device: str | None) -> TorchNet:
    """Place a net, or that of a .safetensors file, on a device.

    Raises
    ------
    OptionError
        There is no such device.
    WeightsError
        The file is missing or damaged.
    """
    where = device_of(device)
    return TorchNet(model.to(where) if isinstance(model, Net) else cached(model, where), where)
