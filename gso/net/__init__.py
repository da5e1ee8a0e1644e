"""Neural networks that approximate the optimiser's results in a forward pass (GSO-Net)."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gso.net.catalogue import available as available
    from gso.net.inference.prediction import predict as predict
    from gso.net.models.coarse import CoarseNet as CoarseNet
    from gso.net.models.gsonet import GSONet as GSONet
    from gso.net.tasks import add_task as add_task
    from gso.net.training.loop import train as train
    from gso.net.weights import add_kind as add_kind
    from gso.net.weights import load as load
    from gso.net.weights import save as save

# Imported on first use, so that torch is loaded only when a net is used.
_NAMES = {
    "CoarseNet": "gso.net.models.coarse",
    "GSONet": "gso.net.models.gsonet",
    "add_kind": "gso.net.weights",
    "add_task": "gso.net.tasks",
    "available": "gso.net.catalogue",
    "load": "gso.net.weights",
    "predict": "gso.net.inference.prediction",
    "save": "gso.net.weights",
    "train": "gso.net.training.loop",
}

__all__ = list(_NAMES)


def __getattr__(name: str) -> object:
    if name not in _NAMES:
        raise AttributeError(f"module 'gso.net' has no attribute {name!r}")
    value = getattr(importlib.import_module(_NAMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
