"""Checkpoints: the state of a training run in one file, written atomically."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as packed
from torch import Tensor

from gso.errors import WeightsError
from gso.io.atomic import write_bytes
from gso.net.models.base import Net
from gso.typing import Json

_DAMAGED = "{} is no checkpoint of this run ({}); remove it to begin anew"
Optimisers = Sequence[torch.optim.Optimizer]


def save(path: Path, net: Net, average: Net, optimisers: Optimisers, state: Json) -> None:
    """Write the net, its moving average, the optimisers' moments, and the JSON `state`."""
    tensors: dict[str, Tensor] = {}
    for prefix, module in (("net", net), ("average", average)):
        tensors |= {f"{prefix}.{k}": v for k, v in module.state_dict().items()}
    for number, optimiser in enumerate(optimisers):
        for k, moments in optimiser.state_dict()["state"].items():
            tensors |= {f"optimiser.{number}.{k}.{name}": value for name, value in moments.items()}
    tensors = {k: v.detach().cpu().contiguous() for k, v in tensors.items()}
    data = packed(tensors, metadata={"state": json.dumps(state)})
    write_bytes(path, data)


def load(path: Path, net: Net, average: Net, optimisers: Optimisers) -> Json:
    """Restore what :func:`save` wrote into the nets and optimisers, and return `state`.

    Raises
    ------
    WeightsError
        The file is damaged, or belongs to another net.
    """
    state = numbers(path)
    try:
        with safe_open(path, framework="pt") as file:
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        for prefix, module in (("net", net), ("average", average)):
            module.load_state_dict(_part(tensors, prefix))
        for number, optimiser in enumerate(optimisers):
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in _part(tensors, f"optimiser.{number}").items():
                k, name = key.split(".")
                moments.setdefault(int(k), {})[name] = value
            optimiser.load_state_dict({**optimiser.state_dict(), "state": moments})
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise WeightsError(_DAMAGED.format(path, error)) from None
    return state


def numbers(path: Path) -> Json:
    """Read the JSON `state` that :func:`save` wrote, without the tensors.

    Raises
    ------
    WeightsError
        The file is damaged.
    """
    try:
        with safe_open(path, framework="pt") as file:
            return dict(json.loads((file.metadata() or {})["state"]))
    except (OSError, SafetensorError, KeyError, TypeError, ValueError) as error:
        raise WeightsError(_DAMAGED.format(path, error)) from None


def _part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    start = f"{prefix}."
    return {k.removeprefix(start): v for k, v in tensors.items() if k.startswith(start)}
